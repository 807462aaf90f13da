import { countSet, includes, valuesAt } from "./arrays.js";
import { decodeDepth } from "./decode-depth.js";
import { decodePhoto } from "./decode-photo.js";
import { holeShare } from "./depth-colours.js";
import { encode } from "./encode.js";
import { gainBitmap, gainField } from "./gain.js";
import { hold, release, take } from "./held.js";
import { turnDepth } from "./turn-depth.js";
import { depthBitmap, labelsBitmap, pictureBitmap, seamBitmap, voidBitmap } from "./paint.js";

/** Tasks that would block the main thread. */
export const tasks = {
  hold,
  take,
  release,
  decodePhoto,
  decodeDepth,
  pictureBitmap,
  depthBitmap,
  voidBitmap,
  seamBitmap,
  labelsBitmap,
  gainField,
  gainBitmap,
  countSet,
  includes,
  valuesAt,
  holeShare,
  turnDepth,
  encode,
};

export type Tasks = typeof tasks;
export type TaskName = keyof Tasks;

export interface Request {
  readonly id: number;
  readonly name: TaskName;
  readonly args: readonly unknown[];
}

export type Reply =
  | { readonly id: number; readonly value: unknown }
  | { readonly id: number; readonly message: string; readonly unusable: boolean };
