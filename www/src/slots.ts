import type { DepthMap, Photo } from "./image-worker/contents.js";
// The inputs of a pair, and the files they come from.

/** The decoded content of each input. */
export interface Contents {
  target: Photo;
  reference: Photo;
  targetDepth: DepthMap;
  referenceDepth: DepthMap;
  /** xt, yt, xr, yr of every match, in pixels of the original photos. */
  matches: Float32Array;
}

export type SlotName = keyof Contents;
export type PhotoSlot = "target" | "reference";

export const photoSlots: readonly PhotoSlot[] = ["target", "reference"];
export const slotNames: readonly SlotName[] = [
  ...photoSlots,
  "targetDepth",
  "referenceDepth",
  "matches",
];
export const depthSlot = { target: "targetDepth", reference: "referenceDepth" } as const;

export interface Loaded<T> {
  readonly file: File;
  readonly content: T;
  /** All files of the sample are removed when the user loads a photo. */
  readonly origin: "sample" | "own";
}

export type Slots = { readonly [K in SlotName]: Loaded<Contents[K]> | null };
