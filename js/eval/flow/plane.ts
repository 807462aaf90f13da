/** Values of a picture, row by row. */
export interface Plane {
  readonly data: Float32Array;
  readonly width: number;
  readonly height: number;
}

export function plane(width: number, height: number): Plane {
  return { data: new Float32Array(width * height), width, height };
}

/** Rec. 601 luma of an RGBA picture, rounded as in pictures of 8 bit. */
export function luma({
  data,
  width,
  height,
}: {
  readonly data: ArrayLike<number>;
  readonly width: number;
  readonly height: number;
}): Plane {
  const out = plane(width, height);
  for (let i = 0; i < out.data.length; i++) {
    const [r, g, b] = [data[4 * i] ?? 0, data[4 * i + 1] ?? 0, data[4 * i + 2] ?? 0];
    out.data[i] = Math.round(0.299 * r + 0.587 * g + 0.114 * b);
  }
  return out;
}

/** The value at (x, y), or at the nearest place of the frame. */
export function at({ data, width, height }: Plane, x: number, y: number): number {
  const column = x < 0 ? 0 : x >= width ? width - 1 : x;
  const row = y < 0 ? 0 : y >= height ? height - 1 : y;
  return data[row * width + column] as number;
}

/** The value between pixels, bilinearly; beyond the frame that of its border. */
export function sample(picture: Plane, x: number, y: number): number {
  const { data, width, height } = picture;
  const cx = x < 0 ? 0 : x > width - 1 ? width - 1 : x;
  const cy = y < 0 ? 0 : y > height - 1 ? height - 1 : y;
  const [x0, y0] = [Math.floor(cx), Math.floor(cy)];
  const [fx, fy] = [cx - x0, cy - y0];
  const i = y0 * width + x0;
  const right = x0 + 1 < width ? 1 : 0;
  const below = y0 + 1 < height ? width : 0;
  const top = (data[i] as number) * (1 - fx) + (data[i + right] as number) * fx;
  const bottom = (data[i + below] as number) * (1 - fx) + (data[i + below + right] as number) * fx;
  return top * (1 - fy) + bottom * fy;
}

/** Half the size, each value the mean of four, rounded as in pictures of 8 bit. */
export function halved(picture: Plane): Plane {
  const out = plane(Math.max(1, picture.width >> 1), Math.max(1, picture.height >> 1));
  for (let y = 0; y < out.height; y++) {
    for (let x = 0; x < out.width; x++) {
      const top = at(picture, 2 * x, 2 * y) + at(picture, 2 * x + 1, 2 * y);
      const bottom = at(picture, 2 * x, 2 * y + 1) + at(picture, 2 * x + 1, 2 * y + 1);
      out.data[y * out.width + x] = Math.round((top + bottom) / 4);
    }
  }
  return out;
}

/** Another size, bilinearly, every value times `factor`. */
export function resized(picture: Plane, width: number, height: number, factor: number): Plane {
  const out = plane(width, height);
  const [sx, sy] = [picture.width / width, picture.height / height];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const value = sample(picture, (x + 0.5) * sx - 0.5, (y + 0.5) * sy - 0.5);
      out.data[y * width + x] = factor * value;
    }
  }
  return out;
}

/** Where each pixel goes: pixels to the right and down. */
export interface Flow {
  readonly u: Plane;
  readonly v: Plane;
}
