import type {
  Depths,
  EstimateInputs,
  Geometry,
  ImageInput,
  ImageOutput,
  Mask,
  Models,
  Mosaic,
  Options,
  Quality,
  StitchInputs,
  StitchResult,
  Warped,
} from "./types.js";

/** What the core can be asked to do: arguments and result of each call, as plain data that can change threads. */
export interface Calls {
  stitch: {
    args: [
      target: ImageInput,
      reference: ImageInput,
      inputs: StitchInputs,
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
