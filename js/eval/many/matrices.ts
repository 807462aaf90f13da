/** Arithmetic of 3×3 matrices, row by row, and of points. */
export type Matrix = ArrayLike<number>;
export type Point = readonly [number, number, number];

export function times(m: Matrix, [x, y, z]: Point): Point {
  const row = (i: number): number =>
    (m[3 * i] ?? NaN) * x + (m[3 * i + 1] ?? NaN) * y + (m[3 * i + 2] ?? NaN) * z;
  return [row(0), row(1), row(2)];
}

/** a·b. */
export function product(a: Matrix, b: Matrix): number[] {
  const columns = [0, 1, 2].map((k) => times(a, [b[k] ?? NaN, b[3 + k] ?? NaN, b[6 + k] ?? NaN]));
  return [0, 1, 2].flatMap((i) => columns.map((column) => column[i] ?? NaN));
}

export function transposed(m: Matrix): number[] {
  return [0, 3, 6, 1, 4, 7, 2, 5, 8].map((i) => m[i] ?? NaN);
}

export function minus(a: Point, b: Point): Point {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

/** The angle between two directions, in degrees. */
export function angle(a: Point, b: Point): number {
  const dot = (p: Point, q: Point): number => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
  return degrees(dot(a, b) / Math.sqrt(dot(a, a) * dot(b, b)));
}

/** By how much a rotation turns, in degrees. */
export function turn(m: Matrix): number {
  return degrees(((m[0] ?? NaN) + (m[4] ?? NaN) + (m[8] ?? NaN) - 1) / 2);
}

function degrees(cosine: number): number {
  return (Math.acos(Math.min(1, Math.max(-1, cosine))) * 180) / Math.PI;
}
