import type {
  Depths,
  EstimateInputs,
  Geometry,
  ImageInput,
  ImageOutput,
  Mask,
  Matches,
  Mosaic,
  Options,
  Quality,
  StitchResult,
  Warped,
} from "./types.js";

export type Models = Pick<Geometry, "forward" | "reverse">;

/** What the core can be asked to do: arguments and result of each call, as plain data that can change threads. */
export interface Calls {
  stitch: {
    args: [
      target: ImageInput,
      reference: ImageInput,
      inputs: Depths & Matches,
      options: Partial<Options>,
    ];
    result: StitchResult;
  };
  estimate: { args: [inputs: EstimateInputs, options: Partial<Options>]; result: Geometry };
  warp: {
    args: [
      target: ImageInput,
      reference: ImageInput,
      geometry: Models,
      depths: Depths,
      options: Partial<Options>,
    ];
    result: Warped;
  };
  blend: { args: [warped: Warped, reference: ImageInput]; result: Mosaic };
  fill: {
    args: [mosaic: ImageInput, voidMask: Mask, options: Partial<Options>];
    result: ImageOutput;
  };
  measure: { args: [warped: Warped, reference: ImageInput]; result: Quality };
}

export type CallName = keyof Calls;
export type Call = { [N in CallName]: { name: N; args: Calls[N]["args"] } }[CallName];
export type Result = Calls[CallName]["result"];
