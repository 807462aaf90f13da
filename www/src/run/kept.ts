import type { StitchResult } from "depthstitch";
import type { Lodged } from "../image-worker/contents.js";

/** A result whose pictures and maps are held by the image worker, with the number of void pixels. */
export type Kept<R> = Lodged<R> & { readonly voids: number };
export type PairResult = Kept<StitchResult>;
