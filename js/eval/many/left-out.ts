/**
 * One photo of a set is left out, the others are stitched, and what they show in its place is compared with that photo as
 * the solution of all puts it.
 */
import { onPlane } from "../modes.js";
import {
  stitchMany,
  warp,
  type ImageOutput,
  type Options,
  type StitchManyResult,
} from "../../index.js";
import { compare, type Comparison } from "../comparison.js";

/**
 * The photo with most matches of those without which the others still hang together; not the reference, which says where
 * everything is. Undefined of fewer than three photos, and where each one is needed.
 */
export function dispensable({ photos, pairs, reference }: StitchManyResult): number | undefined {
  const links = pairs.filter(
    ({ linked, photos: ends }) => linked && ends.every((photo) => photos[photo]?.used),
  );
  const connected = (without: number): boolean => {
    const found = new Set([reference]);
    for (const photo of found) {
      for (const { photos: ends } of links) {
        if (ends.includes(photo) && !ends.includes(without)) ends.forEach((end) => found.add(end));
      }
    }
    return found.size === photos.filter(({ used }) => used).length - 1;
  };
  const matches = (photo: number): number =>
    links
      .filter(({ photos: ends }) => ends.includes(photo))
      .reduce((sum, { inliers }) => sum + inliers, 0);
  const candidates = photos.flatMap(({ used }, photo) =>
    used && photo !== reference && connected(photo) ? [photo] : [],
  );
  return candidates.sort((a, b) => matches(b) - matches(a))[0];
}

/** What a comparison says where hardly anything is shown: nothing else. */
type Shown = Partial<Comparison> & Pick<Comparison, "share">;

/** Undefined where no photo can be left out. */
export async function compareLeftOut(
  photos: readonly ImageOutput[],
  settings: Partial<Options>,
): Promise<Shown | undefined> {
  // On the plane both pictures are in the reference's own pixels.
  const options = onPlane(settings);
  const all = await stitchMany(photos, { ...options, outputDepth: true, fill: "none" });
  const out = photos.length > 2 ? dispensable(all) : undefined;
  const own = all.photos[out ?? -1];
  const left = own?.undistorted ?? photos[out ?? -1];
  const base = all.photos[all.reference]?.undistorted ?? photos[all.reference];
  if (out === undefined || !left || !own?.forward || !own.reverse || !base) return undefined;
  // Some pairs were only found with the geometry of all: without it, the others may not hang together.
  const others = await stitchMany(
    photos.filter((_, photo) => photo !== out),
    {
      ...options,
      reference: all.reference - (out < all.reference ? 1 : 0),
      outputDepth: true,
      fill: "none",
    },
  );
  const { forward, reverse, inverseDepth } = own;
  const geometry = { forward, reverse };
  const depths = {
    targetDepth: inverseDepth,
    referenceDepth: inverseDepth && all.photos[all.reference]?.inverseDepth,
  };
  const wanted = await warp(left, base, geometry, { ...depths, worker: false });
  // The lens may be found to be another one: the middles are the same.
  const frame = others.photos[others.reference]?.undistorted ?? photos[all.reference] ?? base;
  const [x, y] = [(base.width - frame.width) / 2, (base.height - frame.height) / 2];
  const there = { x: others.offset.x - x, y: others.offset.y - y };
  return compareShown(wanted, { mosaic: others.mosaic, offset: there });
}

/** Compares where both show something: in the rectangle around the warped photo. */
function compareShown(
  { warped, offset }: { readonly warped: ImageOutput; readonly offset: Offset },
  { mosaic, offset: there }: { readonly mosaic: ImageOutput; readonly offset: Offset },
): Shown {
  let [left, top, right, bottom] = [warped.width, warped.height, 0, 0];
  for (let i = 0; i < warped.width * warped.height; i++) {
    if (warped.data[4 * i + 3] === 0) continue;
    const [x, y] = [i % warped.width, Math.floor(i / warped.width)];
    [left, right] = [Math.min(left, x), Math.max(right, x + 1)];
    [top, bottom] = [Math.min(top, y), Math.max(bottom, y + 1)];
  }
  if (right <= left) return { share: 0 };
  const size = { width: right - left, height: bottom - top };
  const picture = { data: new Uint8ClampedArray(4 * size.width * size.height), ...size };
  const truth = { data: picture.data.slice(), ...size };
  let drawn = 0;
  for (let y = 0; y < size.height; y++) {
    for (let x = 0; x < size.width; x++) {
      const [to, from] = [4 * (y * size.width + x), 4 * ((y + top) * warped.width + x + left)];
      truth.data.set(warped.data.subarray(from, from + 4), to);
      if (warped.data[from + 3] === 0) continue;
      drawn += 1;
      const [column, row] = [x + left - offset.x + there.x, y + top - offset.y + there.y];
      const outside = column < 0 || row < 0 || column >= mosaic.width || row >= mosaic.height;
      const at = 4 * (row * mosaic.width + column);
      if (!outside) picture.data.set(mosaic.data.subarray(at, at + 4), to);
    }
  }
  const found = compare(picture, truth);
  if (!found) return { share: 0 };
  return { ...found, share: (found.share * size.width * size.height) / drawn };
}

interface Offset {
  readonly x: number;
  readonly y: number;
}
