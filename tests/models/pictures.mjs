// Pictures that the tests of the networks look at.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { decodeDepth, decodeImage } from "depthstitch/codecs";
import { root } from "../../js/tools/shared.mjs";
import { join } from "node:path";

/** @typedef {{ data: Uint8ClampedArray, width: number, height: number }} Picture */

/**
 * An opaque picture by its colours.
 *
 * @param {number} width
 * @param {number} height
 * @param {(x: number, y: number) => number[]} colour
 * @returns {Picture}
 */
export function paint(width, height, colour) {
  const data = new Uint8ClampedArray(4 * width * height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) data.set([...colour(x, y), 255], 4 * (y * width + x));
  }
  return { data, width, height };
}

/**
 * A mask by its pixels.
 *
 * @param {number} width
 * @param {number} height
 * @param {(x: number, y: number) => boolean} marked
 */
export function mask(width, height, marked) {
  const at = (/** @type {number} */ i) => marked(i % width, Math.floor(i / width));
  const data = Uint8Array.from({ length: width * height }, (_, i) => (at(i) ? 255 : 0));
  return { data, width, height };
}

/** The picture without the pixels of the mask. @param {Picture} picture @param {{ data: Uint8Array }} holes */
export function without({ data, width, height }, holes) {
  return { data: data.map((value, i) => (holes.data[i >> 2] ? 0 : value)), width, height };
}

/**
 * Fails unless exactly the pixels of the mask may have changed, and those are opaque.
 *
 * @param {Picture} filled
 * @param {Picture} before
 * @param {{ data: Uint8Array }} holes
 */
export function assertOnlyHoles(filled, before, holes) {
  assert.deepEqual([filled.width, filled.height], [before.width, before.height]);
  let changed = 0;
  let transparent = 0;
  holes.data.forEach((hole, i) => {
    const same = [0, 1, 2, 3].every((c) => filled.data[4 * i + c] === before.data[4 * i + c]);
    if (!hole && !same) changed++;
    if (hole && filled.data[4 * i + 3] !== 255) transparent++;
  });
  assert.deepEqual({ changed, transparent }, { changed: 0, transparent: 0 });
}

/** PSNR over the mask in dB. @param {Picture} a @param {Picture} b @param {{ data: Uint8Array }} holes */
export function psnr(a, b, holes) {
  let sum = 0;
  let count = 0;
  holes.data.forEach((hole, i) => {
    for (let c = 0; hole && c < 3; c++, count++) {
      sum += ((a.data[4 * i + c] ?? 0) - (b.data[4 * i + c] ?? 0)) ** 2;
    }
  });
  return 10 * Math.log10((255 * 255 * count) / sum);
}

/**
 * A photo with its true inverse depth, NaN where that is unknown.
 *
 * @param {string} folder of a case
 * @param {"target" | "reference"} view
 */
export async function withDepth(folder, view) {
  const about = JSON.parse(await readFile(join(folder, "case.json"), "utf8"));
  const file = (/** @type {string} */ name) => readFile(join(folder, name));
  const { data, width, height } = await decodeDepth(await file(about[`${view}_depth`]));
  const { kind, invalid } = about.depth;
  const truth = Float64Array.from(data, (value) =>
    value === invalid ? NaN : kind === "metric" ? 1 / value : value,
  );
  return { photo: await decodeImage(await file(about[view])), truth, width, height };
}

/**
 * Spearman's rank correlation of an estimate with the truth, over the estimate's grid.
 *
 * @param {{ data: Float32Array, width: number, height: number }} estimate
 * @param {{ truth: Float64Array, width: number, height: number }} scene
 */
export function rankCorrelation(estimate, { truth, width, height }) {
  /** @type {number[]} */
  const ours = [];
  /** @type {number[]} */
  const theirs = [];
  estimate.data.forEach((value, i) => {
    const x = Math.floor((((i % estimate.width) + 0.5) * width) / estimate.width);
    const y = Math.floor(((Math.floor(i / estimate.width) + 0.5) * height) / estimate.height);
    const known = truth[y * width + x] ?? NaN;
    if (Number.isNaN(known) || Number.isNaN(value)) return;
    ours.push(value);
    theirs.push(known);
  });
  return correlation(ranks(ours), ranks(theirs));
}

/** @param {number[]} values */
function ranks(values) {
  const order = [...values.keys()].sort((a, b) => (values[a] ?? 0) - (values[b] ?? 0));
  const out = new Float64Array(values.length);
  for (let from = 0; from < order.length;) {
    let to = from;
    while (to < order.length && values[order[to] ?? 0] === values[order[from] ?? 0]) to++;
    for (let k = from; k < to; k++) out[order[k] ?? 0] = (from + to - 1) / 2;
    from = to;
  }
  return out;
}

/** @param {Float64Array} a @param {Float64Array} b */
function correlation(a, b) {
  const mean = (/** @type {Float64Array} */ v) =>
    v.reduce((sum, value) => sum + value, 0) / v.length;
  const [ma, mb] = [mean(a), mean(b)];
  let [ab, aa, bb] = [0, 0, 0];
  a.forEach((value, i) => {
    const [p, q] = [value - ma, (b[i] ?? 0) - mb];
    ab += p * q;
    aa += p * p;
    bb += q * q;
  });
  return ab / Math.sqrt(aa * bb);
}

/** The sample pair of the page. */
export const sample = join(root, "www", "public", "sample");
