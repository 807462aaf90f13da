// A case rendered from a few flat surfaces at different depths: the true map is a shift along x by the disparity, so that
// everything about it is known.
import { mkdir, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { encodeGrayPng, encodePng } from "../../dist/codecs.js";

export const WIDTH = 240;
export const HEIGHT = 180;
/** Pixels of shift per unit of inverse depth, from target to reference. */
const BASELINE = -0.1;

/**
 * A flat surface: inverse depth (as the depth map says it), and the columns and rows it covers, from and up to.
 *
 * @typedef {{ depth: number, left: number, right: number, top: number, bottom: number }} Surface
 */

/** From back to front. @type {Surface[]} */
const SURFACES = [
  { depth: 40, left: -Infinity, right: Infinity, top: -Infinity, bottom: Infinity },
  { depth: 80, left: 20, right: 90, top: 20, bottom: 80 },
  { depth: 120, left: 130, right: 200, top: 90, bottom: 160 },
  { depth: 160, left: 120, right: 180, top: 15, bottom: 70 },
  { depth: 200, left: 40, right: 100, top: 100, bottom: 165 },
];

/**
 * The front surface at (x, y) of the target (`view` 0) or the reference (1), and where that is on the surface.
 *
 * @param {number} x
 * @param {number} y
 * @param {number} view
 */
function hit(x, y, view) {
  const hits = SURFACES.map((surface, index) => ({
    ...surface,
    index,
    u: x - view * BASELINE * surface.depth,
  })).filter(({ u, left, right, top, bottom }) => u >= left && u < right && y >= top && y < bottom);
  const front = hits.at(-1);
  if (!front) throw new Error("the background covers everything");
  return front;
}

/** @param {number} u @param {number} y @param {number} index */
function colour(u, y, index) {
  const wave = (/** @type {number} */ fx, /** @type {number} */ fy, /** @type {number} */ phase) =>
    128 + 90 * Math.sin(u * fx + y * fy + phase + 2 * index);
  return [wave(0.31, 0.11, 0), wave(0.13, 0.27, 1), wave(0.21, -0.19, 2), 255];
}

/** @param {number} view */
function render(view) {
  const image = new Uint8ClampedArray(4 * WIDTH * HEIGHT);
  const depth = new Uint8Array(WIDTH * HEIGHT);
  for (let y = 0; y < HEIGHT; y++) {
    for (let x = 0; x < WIDTH; x++) {
      const front = hit(x, y, view);
      image.set(colour(front.u, y, front.index), 4 * (y * WIDTH + x));
      depth[y * WIDTH + x] = front.depth;
    }
  }
  return {
    image: { data: image, width: WIDTH, height: HEIGHT },
    depth: { data: depth, width: WIDTH, height: HEIGHT },
  };
}

/** Points every few pixels that both photos see, with their places in both: xt, yt, xr, yr. */
function matches() {
  const rows = [];
  for (let y = 4; y < HEIGHT; y += 11) {
    for (let x = 4; x < WIDTH; x += 13) {
      const seen = hit(x, y, 0);
      const moved = x + BASELINE * seen.depth;
      if (moved < 0 || hit(moved, y, 1).index !== seen.index) continue;
      rows.push([x, y, moved, y]);
    }
  }
  return rows;
}

/**
 * Writes the case to `folder` and returns its matches. `change` overrides keys of case.json; `keep` is how many matches
 * are written.
 *
 * @param {string} folder
 * @param {{ change?: object, keep?: number }} [options]
 */
export async function writeCase(folder, { change = {}, keep = Infinity } = {}) {
  await mkdir(folder, { recursive: true });
  const [target, reference] = [render(0), render(1)];
  const rows = matches().slice(0, keep);
  const description = {
    target: "target.png",
    reference: "reference.png",
    target_depth: "target_depth.png",
    reference_depth: "reference_depth.png",
    matches: "matches.csv",
    depth: { kind: "inverse", scale: 0.5, invalid: null },
    // The scale halves the depth, so the true epipole is twice as long.
    truth: { H_inf: [1, 0, 0, 0, 1, 0, 0, 0, 1], e_prime: [2 * BASELINE, 0, 0] },
    ...change,
  };
  await Promise.all([
    writeFile(join(folder, "case.json"), JSON.stringify(description)),
    writeFile(join(folder, "target.png"), await encodePng(target.image)),
    writeFile(join(folder, "reference.png"), await encodePng(reference.image)),
    writeFile(join(folder, "target_depth.png"), await encodeGrayPng(target.depth)),
    writeFile(join(folder, "reference_depth.png"), await encodeGrayPng(reference.depth)),
    writeFile(
      join(folder, "matches.csv"),
      ["xt,yt,xr,yr", ...rows.map((row) => row.join(","))].join("\n"),
    ),
  ]);
  return rows;
}
