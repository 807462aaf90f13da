import type {
  Alignment,
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
  Models,
  Mosaic,
  Options,
  PhotoInput,
  Quality,
  Size,
  StitchInputs,
  StitchManyResult,
  StitchResult,
  Warped,
} from "./types.js";

/** What `stitch` takes besides the photos, and their features if they are known. */
export interface KnownInputs extends StitchInputs {
  /** Of target and reference. */
  readonly features?: readonly Features[] | undefined;
}

/** What `stitchMany` takes besides the photos, and their features if they are known. */
export interface KnownManyInputs extends ManyInputs {
  readonly features?: readonly Features[] | undefined;
}

/** The calls that the core serves: arguments and result of each, as data that can be sent between threads. */
export interface Calls {
  stitch: {
    args: [
      target: ImageInput,
      reference: ImageInput,
      inputs: KnownInputs,
      options: Partial<Options>,
    ];
    result: StitchResult;
  };
  stitchMany: {
    args: [photos: readonly PhotoInput[], inputs: KnownManyInputs, options: Partial<Options>];
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
      inputs: KnownInputs,
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
  /** How many times over the memory that `stitch` is predicted to take may be taken. */
  affordable: {
    args: [
      photos: readonly [target: Size, reference: Size],
      depth: readonly [target: boolean, reference: boolean],
      options: Partial<Options>,
    ];
    result: number;
  };
  /** The same of `stitchMany`. */
  affordableMany: {
    args: [photos: readonly Size[], options: Partial<Options>];
    result: number;
  };
  measure: {
    args: [warped: Warped, reference: ImageInput, gains: readonly number[] | undefined];
    result: Quality;
  };
}

export type CallName = keyof Calls;
export type Call = { [N in CallName]: { name: N; args: Calls[N]["args"] } }[CallName];
export type Result = Calls[CallName]["result"];
