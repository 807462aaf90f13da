import type { DepthOutput } from "depthstitch";
import type { Bytes, Held, Rgba, Size } from "../image-worker/contents.js";
import { coloursOf, type ManyOutcome, type Outcome } from "../state.js";
import { hold, imageTask } from "../image-worker/client.js";
import type { GainField } from "../image-worker/gain.js";
import type { Shown } from "../image-worker/paint.js";
import { Picture } from "./picture.js";
import type { ViewContext } from "./view-types.js";

const cache = new WeakMap<object, Map<string, Promise<unknown>>>();

/** What is made from `source`, cached by `kind`. */
export function cached<T>(source: object, kind: string, make: () => Promise<T>): Promise<T> {
  const kinds = cache.get(source) ?? new Map<string, Promise<unknown>>();
  cache.set(source, kinds);
  const made = (kinds.get(kind) as Promise<T> | undefined) ?? make();
  kinds.set(kind, made);
  made.catch(() => kinds.delete(kind));
  return made;
}

function picture(
  source: object,
  kind: string,
  size: Size,
  view: ViewContext,
  render: (shown: Shown) => Promise<ImageBitmap>,
): Promise<Picture> {
  return cached(source, kind, () => Picture.of(size, render, view.redraw));
}

/** A picture of an outcome, in the colour space of that. */
export function pictureOf(
  image: Held<Rgba>,
  outcome: Outcome | ManyOutcome,
  view: ViewContext,
): Promise<Picture> {
  return picture(image, "picture", image, view, (shown) =>
    imageTask("pictureBitmap", image, shown, coloursOf(outcome)),
  );
}

/** The same, at most `width` pixels wide. */
export function smallBitmap(
  image: Held<Rgba>,
  outcome: Outcome,
  width: number,
): Promise<ImageBitmap> {
  const scale = Math.min(1, width / image.width);
  const size = { width: Math.round(image.width * scale), height: Math.round(image.height * scale) };
  const part = { x: 0, y: 0, width: image.width, height: image.height };
  return imageTask("pictureBitmap", image, { part, size }, coloursOf(outcome));
}

export function voidsPicture(
  { result }: Outcome | ManyOutcome,
  view: ViewContext,
): Promise<Picture> {
  const { mosaic, voidMask } = result;
  return picture(result, "voids", mosaic, view, (shown) =>
    imageTask("voidBitmap", mosaic, shown, voidMask),
  );
}

export function seamPicture(
  { result }: Outcome,
  seam: Held<Bytes>,
  view: ViewContext,
): Promise<Picture> {
  const { mosaic } = result;
  return picture(result, "seam", mosaic, view, (shown) =>
    imageTask("seamBitmap", mosaic, shown, seam),
  );
}

/** Each photo of a mosaic in its colour (`colours`, RGB one after another). */
export function labelsPicture(
  { result }: ManyOutcome,
  colours: Uint8Array<ArrayBuffer>,
  view: ViewContext,
): Promise<Picture> {
  const { mosaic, labels } = result;
  return picture(result, "labels", mosaic, view, (shown) =>
    imageTask("labelsBitmap", mosaic, shown, labels, colours),
  );
}

/** The second photo as the mosaic shows it. */
export function shownReference({ job, result }: Outcome): Held<Rgba> {
  return result.projectedReference ?? job.reference.pixels;
}

/** The gain of the first photo; `averaged` makes the mosaic in which both photos are averaged. */
export function gainFieldOf(outcome: Outcome, averaged: () => Promise<Rgba>): Promise<GainField> {
  const { result } = outcome;
  return cached(result, "gain field", async () => {
    const mosaic = await hold(await averaged());
    return imageTask("gainField", result.warped, mosaic, shownReference(outcome), result.offset);
  });
}

export function gainPicture(
  { result }: Outcome,
  field: GainField,
  view: ViewContext,
): Promise<Picture> {
  const { warped } = result;
  return picture(result, "gain", warped, view, (shown) =>
    imageTask("gainBitmap", warped, shown, field),
  );
}

/** Maximum width in pixels; depth maps have no finer detail. */
const depthWidth = 1600;

export function depthBitmap(map: Held<DepthOutput>): Promise<ImageBitmap> {
  const settings = { kind: "inverse", invalid: null } as const;
  return cached(map, "depth", () => imageTask("depthBitmap", map, settings, depthWidth));
}
