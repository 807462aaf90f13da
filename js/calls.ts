import type {
  Alignment,
  DepthInput,
  Depths,
  EstimateInputs,
  Features,
  Geometry,
  ImageInput,
  ImageMatches,
  ImageOutput,
  ManyInputs,
  Mask,
  Matches,
  Model,
  Models,
  Mosaic,
  Options,
  PhotoInput,
  Quality,
  StitchInputs,
  StitchManyResult,
  StitchResult,
  Warped,
} from "./types.js";

/** The calls that the core serves: arguments and result of each, as data that can be sent between threads. */
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
  stitchMany: {
    args: [photos: readonly PhotoInput[], inputs: ManyInputs, options: Partial<Options>];
    result: StitchManyResult;
  };
  detect: { args: [image: ImageInput, options: Partial<Options>]; result: Features };
  match: {
    args: [target: Features, reference: Features, options: Partial<Options>];
    result: Matches;
  };
  matchImages: {
    args: [target: ImageInput, reference: ImageInput, options: Partial<Options>];
    result: ImageMatches;
  };
  estimate: { args: [inputs: EstimateInputs, options: Partial<Options>]; result: Geometry };
  align: {
    args: [
      target: ImageInput,
      reference: ImageInput,
      inputs: StitchInputs,
      options: Partial<Options>,
    ];
    result: Alignment;
  };
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
  blend: {
    args: [
      warped: Warped,
      reference: ImageInput,
      inputs: { readonly reliable?: Mask | null | undefined },
      options: Partial<Options>,
    ];
    result: Mosaic;
  };
  fill: {
    args: [mosaic: ImageInput, voidMask: Mask, options: Partial<Options>];
    result: ImageOutput;
  };
  /** A task of `stitchMany`: the features of two photos, matched. */
  matchPhotos: {
    args: [features: Features[], strongestFirst: boolean, options: Partial<Options>];
    result: object;
  };
  /** A task of `stitchMany`: stereo of two photos. */
  matchStereo: {
    args: [
      photos: (ImageInput & { depth: DepthInput })[],
      models: Model[],
      error: number[],
      options: Partial<Options>,
    ];
    result: object;
  };
  measure: {
    args: [warped: Warped, reference: ImageInput, gains: readonly number[] | undefined];
    result: Quality;
  };
}

export type CallName = keyof Calls;
export type Call = { [N in CallName]: { name: N; args: Calls[N]["args"] } }[CallName];
export type Result = Calls[CallName]["result"];

/** The calls that may leave tasks, which are calls as well, to other workers. */
export type SharedCall = Extract<Call, { name: "stitch" | "align" | "stitchMany" }>;
