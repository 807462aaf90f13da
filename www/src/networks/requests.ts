import type { ImageInput, ImageOutput, Mask } from "depthstitch";
import type { EstimatedDepth } from "depthstitch/depth";

/** Requests to the worker that runs networks. */
export interface Requests {
  depth: {
    args: {
      readonly photo: ImageInput;
      readonly model: DepthModelName;
      /** Host of Depth Anything; empty for the default of the library. */
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
      /** URL of the weights; empty for where they were published. */
      readonly address: string;
    };
    result: ImageOutput;
  };
}

/** Depth Anything V2 Small, or a custom network in one ONNX file. */
export type DepthModelName = "small" | "onnx";

/** A custom network: its URL, its input range and its output. */
export interface OnnxDepth {
  readonly address: string;
  /** Colours from 0 to 1, or normalized by the mean and standard deviation of ImageNet. */
  readonly colours: "plain" | "imagenet";
  readonly output: "inverse" | "metric";
}
export type NetworkName = keyof Requests;
export type NetworkRequest = {
  [N in NetworkName]: { readonly name: N; readonly args: Requests[N]["args"] };
}[NetworkName];

/** Progress of a network, with bytes while downloading. */
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
