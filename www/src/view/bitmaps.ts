import type { Outcome } from "../state.js";
import { studio } from "../studio/client.js";
import type { DepthMap } from "../studio/contents.js";
import type { GainPicture } from "../studio/gain.js";
import type { Bytes, Rgba } from "../studio/paint.js";

const known = new WeakMap<object, Map<string, Promise<unknown>>>();

/** A picture made from `source`, once for each `kind`, which is of one type. */
function bitmap<T = ImageBitmap>(source: object, kind: string, make: () => Promise<T>): Promise<T> {
  const kinds = known.get(source) ?? new Map<string, Promise<unknown>>();
  known.set(source, kinds);
  const made = (kinds.get(kind) as Promise<T> | undefined) ?? nextTask().then(make);
  kinds.set(kind, made);
  made.catch(() => kinds.delete(kind));
  return made;
}

/** Sending a large picture takes its time; not in the same breath as whatever asked for it. */
function nextTask(): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve));
}

export function pictureBitmap(image: Rgba): Promise<ImageBitmap> {
  const { data, width, height } = image;
  return bitmap(image, "picture", () => studio("bitmapOf", { data, width, height }));
}

export function voidsBitmap({ result }: Outcome): Promise<ImageBitmap> {
  return bitmap(result, "voids", () => studio("voidBitmap", result.mosaic, result.voidMask));
}

export function seamBitmap({ result }: Outcome, seam: Bytes): Promise<ImageBitmap> {
  return bitmap(result, "seam", () => studio("seamBitmap", result.mosaic, seam));
}

export function gainBitmap(
  { result, job }: Outcome,
  averaged: () => Promise<Rgba>,
): Promise<GainPicture> {
  return bitmap(result, "gain", async () => {
    const { data, width, height } = job.reference;
    const mosaic = await averaged();
    return studio("gainPicture", result.warped, mosaic, { data, width, height }, result.offset);
  });
}

/** At most this many pixels wide: depth has no finer detail to show. */
const depthWidth = 1600;

export function depthBitmap(map: DepthMap): Promise<ImageBitmap> {
  const { data, width, height } = map;
  const settings = { kind: "inverse", invalid: null } as const;
  return bitmap(map, "depth", () =>
    studio("depthBitmap", { data, width, height }, settings, depthWidth),
  );
}
