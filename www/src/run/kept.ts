import type { Output, StitchResultOf } from "depthstitch";
import type { Lodged } from "../image-worker/contents.js";

/** A result whose pictures and maps are held by the image worker, with the number of void pixels. */
export type Kept<R> = Lodged<R> & { readonly voids: number };

/** What is shown of a result of two photos at once. */
export const firstOutputs = [
  "mosaic",
  "voidMask",
  "projectedReference",
] as const satisfies readonly Output[];
/** What some views are made of besides the inverse depth. */
export const laterOutputs = ["seam", "warped"] as const satisfies readonly Output[];
export type PairResult = Kept<
  StitchResultOf<(typeof firstOutputs)[number] | (typeof laterOutputs)[number]>
>;
