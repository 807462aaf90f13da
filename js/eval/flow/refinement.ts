/**
 * Variational refinement of a flow: T. Brox, A. Bruhn, N. Papenberg and J. Weickert, *High Accuracy Optical Flow Estimation
 * Based on a Theory for Warping*, ECCV 2004, without a pyramid of its own. Constancy of values and gradients against
 * smoothness, all robust, by fixed-point iterations over successive over-relaxation.
 */
import { at, plane, sample, type Flow, type Plane } from "./plane.js";

/** Weights of smoothness, values and gradients. */
const ALPHA = 20;
const DELTA = 5;
const GAMMA = 10;
/** Keeps the normalisation by the gradient and the robust function from dividing by 0. */
const ZETA = 0.1;
const EPSILON = 1e-3;
const FIXED_POINT_ITERATIONS = 5;
const RELAXATIONS = 5;
const OMEGA = 1.6;

export function refine(from: Plane, to: Plane, { u, v }: Flow): Flow {
  const { width, height } = from;
  const make = (value: (i: number, x: number, y: number) => number): Plane => {
    const out = plane(width, height);
    for (let i = 0; i < out.data.length; i++) {
      out.data[i] = value(i, i % width, Math.floor(i / width));
    }
    return out;
  };
  const get = ({ data }: Plane, i: number): number => data[i] as number;
  const along = (p: Plane): Plane => make((_, x, y) => (at(p, x + 1, y) - at(p, x - 1, y)) / 2);
  const down = (p: Plane): Plane => make((_, x, y) => (at(p, x, y + 1) - at(p, x, y - 1)) / 2);

  const warped = make((i, x, y) => sample(to, x + get(u, i), y + get(v, i)));
  const mean = make((i) => (get(from, i) + get(warped, i)) / 2);
  const z = make((i) => get(warped, i) - get(from, i));
  const [ix, iy] = [along(mean), down(mean)];
  const [ixx, ixy, iyy] = [along(ix), down(ix), down(iy)];
  const [izx, izy] = [along(z), down(z)];

  const [du, dv] = [plane(width, height), plane(width, height)];
  const system = {
    a11: plane(width, height),
    a12: plane(width, height),
    a22: plane(width, height),
  };
  const right = { u: plane(width, height), v: plane(width, height) };
  const smooth = plane(width, height);
  for (let iteration = 0; iteration < FIXED_POINT_ITERATIONS; iteration++) {
    for (let i = 0; i < smooth.data.length; i++) {
      const [x, y, xx, xy, yy] = [get(ix, i), get(iy, i), get(ixx, i), get(ixy, i), get(iyy, i)];
      const [pu, pv] = [get(du, i), get(dv, i)];
      // Constancy of values, normalised by the gradient.
      const norm = x * x + y * y + ZETA * ZETA;
      const rest = get(z, i) + x * pu + y * pv;
      const value = DELTA / 2 / Math.sqrt((rest * rest) / norm + EPSILON * EPSILON) / norm;
      // Constancy of gradients, each component normalised by its own.
      const normX = xx * xx + xy * xy + ZETA * ZETA;
      const normY = yy * yy + xy * xy + ZETA * ZETA;
      const restX = get(izx, i) + xx * pu + xy * pv;
      const restY = get(izy, i) + xy * pu + yy * pv;
      const robust = (restX * restX) / normX + (restY * restY) / normY + EPSILON * EPSILON;
      const gradient = GAMMA / 2 / Math.sqrt(robust);
      const [wx, wy] = [gradient / normX, gradient / normY];
      system.a11.data[i] = value * x * x + wx * xx * xx + wy * xy * xy + ZETA * ZETA;
      system.a12.data[i] = value * x * y + wx * xx * xy + wy * xy * yy;
      system.a22.data[i] = value * y * y + wx * xy * xy + wy * yy * yy + ZETA * ZETA;
      right.u.data[i] = -(value * x * get(z, i) + wx * xx * get(izx, i) + wy * xy * get(izy, i));
      right.v.data[i] = -(value * y * get(z, i) + wx * xy * get(izx, i) + wy * yy * get(izy, i));
    }
    smoothness(u, v, du, dv, smooth);
    for (let sweep = 0; sweep < RELAXATIONS; sweep++) relax(u, v, du, dv, system, right, smooth);
  }
  return { u: make((i) => get(u, i) + get(du, i)), v: make((i) => get(v, i) + get(dv, i)) };
}

/** The robust weight of smoothness at every pixel. */
function smoothness(u: Plane, v: Plane, du: Plane, dv: Plane, out: Plane): void {
  const { width, height } = u;
  for (let i = 0; i < out.data.length; i++) {
    const right = i % width < width - 1 ? i + 1 : i;
    const below = i < width * (height - 1) ? i + width : i;
    const step = (p: Plane, dp: Plane, j: number): number => {
      const here = (p.data[i] as number) + (dp.data[i] as number);
      return (p.data[j] as number) + (dp.data[j] as number) - here;
    };
    const [ux, uy] = [step(u, du, right), step(u, du, below)];
    const [vx, vy] = [step(v, dv, right), step(v, dv, below)];
    const squares = ux * ux + uy * uy + vx * vx + vy * vy;
    out.data[i] = ALPHA / 2 / Math.sqrt(squares + EPSILON * EPSILON);
  }
}

/** One sweep of successive over-relaxation, in place: a chessboard's black pixels, then its white ones. */
function relax(
  u: Plane,
  v: Plane,
  du: Plane,
  dv: Plane,
  { a11, a12, a22 }: { a11: Plane; a12: Plane; a22: Plane },
  right: Flow,
  smooth: Plane,
): void {
  const { width, height } = u;
  for (let colour = 0; colour < 2; colour++) {
    for (let y = 0; y < height; y++) {
      for (let x = (y + colour) % 2; x < width; x += 2) {
        const i = y * width + x;
        // The weight between two pixels is that of the upper or left one.
        const here = smooth.data[i] as number;
        const toLeft = x > 0 ? (smooth.data[i - 1] as number) : 0;
        const toRight = x < width - 1 ? here : 0;
        const above = y > 0 ? (smooth.data[i - width] as number) : 0;
        const below = y < height - 1 ? here : 0;
        const weights = toLeft + toRight + above + below;
        const pull = (p: Float32Array, dp: Float32Array): number =>
          (toLeft > 0 ? toLeft * ((p[i - 1] as number) + (dp[i - 1] as number)) : 0) +
          (toRight > 0 ? toRight * ((p[i + 1] as number) + (dp[i + 1] as number)) : 0) +
          (above > 0 ? above * ((p[i - width] as number) + (dp[i - width] as number)) : 0) +
          (below > 0 ? below * ((p[i + width] as number) + (dp[i + width] as number)) : 0) -
          weights * (p[i] as number);
        const pu = du.data[i] as number;
        const pv = dv.data[i] as number;
        const mixed = a12.data[i] as number;
        const sumU = (right.u.data[i] as number) + pull(u.data, du.data);
        const nextU = pu + OMEGA * ((sumU - mixed * pv) / ((a11.data[i] as number) + weights) - pu);
        du.data[i] = nextU;
        const sumV = (right.v.data[i] as number) + pull(v.data, dv.data);
        const nextV = (sumV - mixed * nextU) / ((a22.data[i] as number) + weights);
        dv.data[i] = pv + OMEGA * (nextV - pv);
      }
    }
  }
}
