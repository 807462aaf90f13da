import { decodeDepth } from "./decode-depth.js";
import { decodePhoto } from "./decode-photo.js";
import { holeShare } from "./depth-colours.js";
import { encode } from "./encode.js";
import { gainPicture } from "./gain.js";
import { turnDepth } from "./turn-depth.js";
import { bitmapOf, depthBitmap, labelsBitmap, seamBitmap, voidBitmap } from "./paint.js";

/** Tasks that would block the main thread. */
export const tasks = {
  decodePhoto,
  decodeDepth,
  bitmapOf,
  depthBitmap,
  voidBitmap,
  seamBitmap,
  labelsBitmap,
  gainPicture,
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
