/** A rectangle of pixels. */
export interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** A part of the voids, and the crop of the image around it that is passed to the network. */
export interface Tile {
  voids: Box;
  crop: Box;
}

/** Counts marked pixels of any box in constant time. */
export interface Count {
  in(box: Box): number;
}

/** Builds a summed-area table (Crow 1984). */
export function countMarked(
  marked: (index: number) => boolean,
  width: number,
  height: number,
): Count {
  const stride = width + 1;
  const sums = new Uint32Array(stride * (height + 1));
  for (let y = 0; y < height; y++) {
    let row = 0;
    for (let x = 0; x < width; x++) {
      if (marked(y * width + x)) row++;
      const above = y * stride + x + 1;
      sums[above + stride] = (sums[above] ?? 0) + row;
    }
  }
  const upTo = (x: number, y: number) => sums[y * stride + x] ?? 0;
  return {
    in: ({ x, y, width, height }) =>
      upTo(x + width, y + height) - upTo(x, y + height) - upTo(x + width, y) + upTo(x, y),
  };
}

/**
 * Tiles that cover all voids. Crops have the size that the network was trained on, so that nothing is downsampled, unless
 * a void is so large that such a crop would contain too few known pixels: then the crop is enlarged.
 */
export function tilesAround(voids: Count, unknown: Count, image: Box, side: number): Tile[] {
  const all = shrink(image, voids);
  if (!all) return [];
  const known = (crop: Box) => 1 - unknown.in(crop) / (crop.width * crop.height);
  const divide = (box: Box): Tile[] => {
    const crop = around(box, image, side);
    if (Math.max(box.width, box.height) <= side / 2) return [{ voids: box, crop }];
    const halves = cut(box, voids)
      .map((half) => shrink(half, voids))
      .filter((half) => half !== undefined);
    // A half that is mostly void has too little context: a coarser view of the whole is better.
    const least = Math.min(0.4, 0.75 * known(crop));
    const enough = halves.every((half) => known(around(half, image, side)) >= least);
    if (!enough) return [{ voids: box, crop }];
    return halves.flatMap(divide);
  };
  return divide(all);
}

/** The square around a box, twice as wide and at least `side`, moved and clipped to lie within the image. */
function around(box: Box, image: Box, side: number): Box {
  const wanted = Math.max(side, 2 * Math.max(box.width, box.height));
  const span = (start: number, length: number, limit: number): [number, number] => {
    const size = Math.min(wanted, limit);
    const from = Math.round(start + (length - size) / 2);
    return [Math.max(0, Math.min(from, limit - size)), size];
  };
  const [x, width] = span(box.x, box.width, image.width);
  const [y, height] = span(box.y, box.height, image.height);
  return { x, y, width, height };
}

/** Splits a box across its longer side where the cut crosses the fewest voids, not too close to its ends. */
function cut(box: Box, voids: Count): Box[] {
  const wide = box.width >= box.height;
  const length = wide ? box.width : box.height;
  const part = (from: number, to: number): Box =>
    wide
      ? { ...box, x: box.x + from, width: to - from }
      : { ...box, y: box.y + from, height: to - from };
  let best = length >> 1;
  let fewest = Infinity;
  for (let at = length >> 2; at < length - (length >> 2); at++) {
    // Ties are broken in favour of the middle.
    const cost = voids.in(part(at, at + 1)) + Math.abs(at - length / 2) / length;
    if (cost < fewest) [best, fewest] = [at, cost];
  }
  return [part(0, best), part(best, length)];
}

/** The bounding box of the voids in a box. */
function shrink(box: Box, voids: Count): Box | undefined {
  const total = voids.in(box);
  if (total === 0) return undefined;
  // Width of the strip without voids along a side, by bisection.
  const free = (length: number, strip: (size: number) => Box): number => {
    let [low, high] = [0, length];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (voids.in(strip(middle)) === 0) low = middle;
      else high = middle;
    }
    return low;
  };
  const { x, y, width, height } = box;
  const left = free(width, (size) => ({ ...box, width: size }));
  const right = free(width, (size) => ({ ...box, x: x + width - size, width: size }));
  const top = free(height, (size) => ({ ...box, height: size }));
  const bottom = free(height, (size) => ({ ...box, y: y + height - size, height: size }));
  return { x: x + left, y: y + top, width: width - left - right, height: height - top - bottom };
}
