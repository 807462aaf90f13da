import type { Output, StitchResultOf } from "depthstitch";
import type { Lodged } from "../image-worker/contents.js";

/** A result whose pictures and maps are held by the image worker, with the number of void pixels. */
export type Kept<R> = Lodged<R> & { readonly voids: number };

/** What is shown of a result of two photos, or what views are made of. */
export const shownOutputs = [
  "mosaic",
  "voidMask",
  "seam",
  "warped",
  "projectedReference",
] as const satisfies readonly Output[];
export type PairResult = Kept<StitchResultOf<(typeof shownOutputs)[number]>>;
