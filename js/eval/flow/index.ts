/**
 * Dense optical flow by inverse search: T. Kroeger, R. Timofte, D. Dai and L. Van Gool, *Fast Optical Flow using Dense
 * Inverse Search*, ECCV 2016, with patches compared after their means are taken out, candidates from neighbouring
 * patches, and a variational refinement, as OpenCV's `DISOpticalFlow` has them; its preset "medium".
 */
import { at, halved, plane, resized, sample, type Flow, type Plane } from "./plane.js";
import { refine } from "./refinement.js";

/** Side of a patch, and distance from one to the next. */
const PATCH = 8;
const STRIDE = 3;
/** Steps of the descent, in each of the passes forth and back over the patches. */
const STEPS = 12;
/** Least determinant of a structure tensor. */
const FLAT = 1e-3;
/** Candidates pass from patch to patch within so many parts of the picture, one below the other: a wrong one stays in its own. */
const STRIPES = 8;
/** The flow is found at half the size, and interpolated. */
const FINEST = 1;

/** The flow that leads from each pixel of `from` to the same thing in `to`, which is as large. */
export function denseFlow(from: Plane, to: Plane): Flow {
  const { width, height } = from;
  const deepest = Math.min(
    Math.floor(Math.log2(Math.max(width, height) / (4 * PATCH)) + 0.5),
    Math.floor(Math.log2(Math.min(width, height) / PATCH)),
  );
  const pyramid = [{ from, to }];
  for (let level = 1; level <= deepest; level++) {
    const finer = pyramid[level - 1] as { from: Plane; to: Plane };
    pyramid.push({ from: halved(finer.from), to: halved(finer.to) });
  }
  let flow: Flow | undefined;
  for (let level = pyramid.length - 1; level >= Math.min(FINEST, pyramid.length - 1); level--) {
    const { from, to } = pyramid[level] as { from: Plane; to: Plane };
    const scaled = (part: Plane | undefined): Plane =>
      part ? resized(part, from.width, from.height, 2) : plane(from.width, from.height);
    const start = { u: scaled(flow?.u), v: scaled(flow?.v) };
    flow = refine(from, to, densified(from, to, searched(from, to, start)));
  }
  const full = (part: Plane): Plane => resized(part, width, height, width / part.width);
  const found = flow ?? { u: plane(width, height), v: plane(width, height) };
  return { u: full(found.u), v: full(found.v) };
}

/** One flow per patch. */
function searched(from: Plane, to: Plane, start: Flow): Flow {
  const count = (side: number): number => 1 + Math.max(0, Math.floor((side - PATCH) / STRIDE));
  const [columns, rows] = [count(from.width), count(from.height)];
  const [u, v] = [plane(columns, rows), plane(columns, rows)];
  const { gx, gy } = sobel(from);
  const middle = PATCH >> 1;
  const stripe = (row: number): number => Math.floor(row / Math.ceil(rows / STRIPES));
  const scratch: Difference = { cost: 0, du: 0, dv: 0 };
  for (const direction of [1, -1]) {
    for (let k = 0; k < rows * columns; k++) {
      const i = direction > 0 ? k : rows * columns - 1 - k;
      const [column, row] = [i % columns, Math.floor(i / columns)];
      const [x, y] = [column * STRIDE, row * STRIDE];
      const patch = patchAt(from, gx, gy, x, y);
      if (direction > 0) {
        u.data[i] = at(start.u, x + middle, y + middle);
        v.data[i] = at(start.v, x + middle, y + middle);
      }
      let best = i;
      let least = difference(patch, to, u.data[i] as number, v.data[i] as number, scratch);
      const beside = column - direction;
      const above = row - direction;
      const candidates = [
        beside >= 0 && beside < columns ? i - direction : -1,
        above >= 0 && above < rows && stripe(above) === stripe(row) ? i - direction * columns : -1,
      ];
      for (const candidate of candidates.filter((candidate) => candidate >= 0)) {
        const [cu, cv] = [u.data[candidate] as number, v.data[candidate] as number];
        const cost = difference(patch, to, cu, cv, scratch);
        if (cost < least) [least, best] = [cost, candidate];
      }
      [u.data[i], v.data[i]] = descended(patch, to, u.data[best] as number, v.data[best] as number);
    }
  }
  return { u, v };
}

interface Patch {
  readonly x: number;
  readonly y: number;
  readonly values: Float32Array;
  readonly gx: Float32Array;
  readonly gy: Float32Array;
}

function patchAt(from: Plane, gx: Plane, gy: Plane, x: number, y: number): Patch {
  const cut = (picture: Plane): Float32Array => {
    const out = new Float32Array(PATCH * PATCH);
    for (let i = 0; i < out.length; i++) out[i] = at(picture, x + (i % PATCH), y + (i >> 3));
    return out;
  };
  return { x, y, values: cut(from), gx: cut(gx), gy: cut(gy) };
}

/** How a patch differs from another place, and which way that grows. Written in place: it is asked for millions of times. */
interface Difference {
  cost: number;
  du: number;
  dv: number;
}

/** How the patch differs from what lies (u, v) away, means taken out. */
function difference(patch: Patch, to: Plane, u: number, v: number, out: Difference): number {
  const { values, gx, gy } = patch;
  const { data, width, height } = to;
  // Not farther out than a patch: the border's values are repeated there.
  const px = Math.min(Math.max(patch.x + u, 1 - PATCH), width - 1);
  const py = Math.min(Math.max(patch.y + v, 1 - PATCH), height - 1);
  const x0 = Math.floor(px);
  const y0 = Math.floor(py);
  const fx = px - x0;
  const fy = py - y0;
  let sum = 0;
  let squares = 0;
  let sx = 0;
  let sy = 0;
  let du = 0;
  let dv = 0;
  for (let i = 0; i < values.length; i++) {
    const x = x0 + (i % PATCH);
    const y = y0 + (i >> 3);
    const left = x < 0 ? 0 : x < width ? x : width - 1;
    const right = x < -1 ? 0 : x + 1 < width ? x + 1 : width - 1;
    const top = (y < 0 ? 0 : y < height ? y : height - 1) * width;
    const bottom = (y < -1 ? 0 : y + 1 < height ? y + 1 : height - 1) * width;
    const upper = (data[top + left] as number) * (1 - fx) + (data[top + right] as number) * fx;
    const lower =
      (data[bottom + left] as number) * (1 - fx) + (data[bottom + right] as number) * fx;
    const d = upper * (1 - fy) + lower * fy - (values[i] as number);
    const a = gx[i] as number;
    const b = gy[i] as number;
    sum += d;
    squares += d * d;
    sx += a;
    sy += b;
    du += d * a;
    dv += d * b;
  }
  const n = values.length;
  out.du = du - (sum * sx) / n;
  out.dv = dv - (sum * sy) / n;
  out.cost = squares - (sum * sum) / n;
  return out.cost;
}

/** Inverse search from (u, v): the gradient is the patch's own, so that its structure tensor is inverted once. */
function descended(patch: Patch, to: Plane, u: number, v: number): [u: number, v: number] {
  let [xx, xy, yy] = [0, 0, 0];
  patch.gx.forEach((a, i) => {
    const b = patch.gy[i] as number;
    xx += a * a;
    xy += a * b;
    yy += b * b;
  });
  const determinant = xx * yy - xy * xy;
  const inverse = 1 / (Math.abs(determinant) < FLAT ? FLAT : determinant);
  const scratch: Difference = { cost: 0, du: 0, dv: 0 };
  let [cu, cv, before] = [u, v, Infinity];
  for (let step = 0; step < STEPS; step++) {
    const cost = difference(patch, to, cu, cv, scratch);
    cu -= inverse * (yy * scratch.du - xy * scratch.dv);
    cv -= inverse * (xx * scratch.dv - xy * scratch.du);
    if (cost >= before) break;
    before = cost;
  }
  // Too far from where it began, it was led astray.
  return Math.hypot(cu - u, cv - v) <= PATCH ? [cu, cv] : [u, v];
}

/** The patches' flows at every pixel, those that fit it better weighing more. */
function densified(from: Plane, to: Plane, patches: Flow): Flow {
  const { width, height } = from;
  const [u, v] = [plane(width, height), plane(width, height)];
  const { width: columns, height: rows } = patches.u;
  const range = (at: number, count: number): [first: number, last: number] => {
    const last = Math.min(Math.floor(at / STRIDE), count - 1);
    return [Math.min(Math.max(0, Math.ceil((at - PATCH + 1) / STRIDE)), last), last];
  };
  for (let y = 0; y < height; y++) {
    const [top, bottom] = range(y, rows);
    for (let x = 0; x < width; x++) {
      const [left, right] = range(x, columns);
      const value = from.data[y * width + x] as number;
      let [weights, su, sv] = [0, 0, 0];
      for (let row = top; row <= bottom; row++) {
        for (let column = left; column <= right; column++) {
          const pu = patches.u.data[row * columns + column] as number;
          const pv = patches.v.data[row * columns + column] as number;
          const weight = 1 / Math.max(1, Math.abs(sample(to, x + pu, y + pv) - value));
          weights += weight;
          su += weight * pu;
          sv += weight * pv;
        }
      }
      u.data[y * width + x] = su / weights;
      v.data[y * width + x] = sv / weights;
    }
  }
  return { u, v };
}

/** Eight times the gradient: the descent takes steps of an eighth. */
function sobel(picture: Plane): { gx: Plane; gy: Plane } {
  const { width, height } = picture;
  const [gx, gy] = [plane(width, height), plane(width, height)];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const value = (dx: number, dy: number): number => at(picture, x + dx, y + dy);
      const column = (dx: number): number => value(dx, -1) + 2 * value(dx, 0) + value(dx, 1);
      const row = (dy: number): number => value(-1, dy) + 2 * value(0, dy) + value(1, dy);
      gx.data[y * width + x] = column(1) - column(-1);
      gy.data[y * width + x] = row(1) - row(-1);
    }
  }
  return { gx, gy };
}
