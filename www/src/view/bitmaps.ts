import { coloursOf, type ManyOutcome, type Outcome } from "../state.js";
import { imageTask } from "../image-worker/client.js";
import type { DepthMap } from "../image-worker/contents.js";
import type { GainPicture } from "../image-worker/gain.js";
import type { Bytes, Rgba } from "../image-worker/paint.js";

const cache = new WeakMap<object, Map<string, Promise<unknown>>>();

/** A bitmap made from `source`, cached by `kind`. */
function bitmap<T = ImageBitmap>(source: object, kind: string, make: () => Promise<T>): Promise<T> {
  const kinds = cache.get(source) ?? new Map<string, Promise<unknown>>();
  cache.set(source, kinds);
  const made = (kinds.get(kind) as Promise<T> | undefined) ?? nextTask().then(make);
  kinds.set(kind, made);
  made.catch(() => kinds.delete(kind));
  return made;
}

/** Posting a large image takes time, so it is done in a task of its own. */
function nextTask(): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve));
}

/** A picture of an outcome, in the colour space of that. */
export function pictureBitmap(image: Rgba, outcome: Outcome | ManyOutcome): Promise<ImageBitmap> {
  const { data, width, height } = image;
  return bitmap(image, "picture", () =>
    imageTask("bitmapOf", { data, width, height }, coloursOf(outcome)),
  );
}

export function voidsBitmap({ result }: Outcome | ManyOutcome): Promise<ImageBitmap> {
  return bitmap(result, "voids", () => imageTask("voidBitmap", result.mosaic, result.voidMask));
}

export function seamBitmap({ result }: Outcome, seam: Bytes): Promise<ImageBitmap> {
  return bitmap(result, "seam", () => imageTask("seamBitmap", result.mosaic, seam));
}

/** Each photo of a mosaic in its colour (`colours`, RGB one after another). */
export function labelsBitmap(
  { result }: ManyOutcome,
  colours: Uint8Array<ArrayBuffer>,
): Promise<ImageBitmap> {
  return bitmap(result, "labels", () =>
    imageTask("labelsBitmap", result.mosaic, result.labels, colours),
  );
}

/** The second photo as the mosaic shows it. */
export function shownReference({ job, result }: Outcome): Rgba {
  return result.projectedReference ?? job.reference;
}

export function gainBitmap(outcome: Outcome, averaged: () => Promise<Rgba>): Promise<GainPicture> {
  const { result } = outcome;
  return bitmap(result, "gain", async () => {
    const { data, width, height } = shownReference(outcome);
    const mosaic = await averaged();
    return imageTask("gainPicture", result.warped, mosaic, { data, width, height }, result.offset);
  });
}

/** Maximum width in pixels; depth maps have no finer detail. */
const depthWidth = 1600;

export function depthBitmap(map: DepthMap): Promise<ImageBitmap> {
  const { data, width, height } = map;
  const settings = { kind: "inverse", invalid: null } as const;
  return bitmap(map, "depth", () =>
    imageTask("depthBitmap", { data, width, height }, settings, depthWidth),
  );
}
