import type { ImageInput, ImageOutput, Mask } from "depthstitch";
import type { EstimatedDepth } from "depthstitch/depth";

/** What the worker of the networks is asked to do. */
export interface Requests {
  depth: {
    args: {
      readonly photo: ImageInput;
      readonly model: DepthModelName;
      /** Where Depth Anything is fetched from; empty for the library's own choice. */
      readonly host: string;
      readonly onnx: OnnxDepth;
    };
    result: EstimatedDepth & { device: string };
  };
  fill: {
    args: {
      readonly mosaic: ImageInput;
      readonly voidMask: Mask;
      readonly model: "migan" | "lama";
      /** Where the weights are; empty for where their authors published them. */
      readonly address: string;
    };
    result: ImageOutput;
  };
}

/** A size of Depth Anything, or a network of the user's own in one ONNX file. */
export type DepthModelName = "small" | "base" | "large" | "onnx";

/** A network of the user's own: where it is, what it takes and what it makes of it. */
export interface OnnxDepth {
  readonly address: string;
  /** Colours from 0 to 1, or those less ImageNet's mean and by its deviation. */
  readonly colours: "plain" | "imagenet";
  readonly output: "inverse" | "metric";
}
export type NetworkName = keyof Requests;
export type NetworkRequest = {
  [N in NetworkName]: { readonly name: N; readonly args: Requests[N]["args"] };
}[NetworkName];

/** How far a network has come: in which step it is, and bytes while it is being downloaded. */
export interface NetworkProgress {
  readonly stage: "download" | "prepare" | "run";
  readonly fraction: number;
  readonly loaded?: number;
  readonly total?: number;
}

export type NetworkReply =
  | { readonly progress: NetworkProgress }
  | { readonly result: unknown }
  | { readonly message: string };
