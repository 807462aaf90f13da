// A case rendered from a few flat surfaces at different depths: the true map is a shift along x by the disparity, so that
// everything about it is known.
import { mkdir, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { encodeGrayPng, encodePng } from "../../dist/codecs.js";

export const WIDTH = 240;
export const HEIGHT = 180;
/** Pixels of shift per unit of inverse depth, from target to reference. */
export const BASELINE = -0.1;

/** Surfaces from back to front: inverse depth (as the depth map says it) and the columns and rows they cover. */
const SURFACES = [
  { depth: 40, columns: [-Infinity, Infinity], rows: [-Infinity, Infinity] },
  { depth: 80, columns: [20, 90], rows: [20, 80] },
  { depth: 120, columns: [130, 200], rows: [90, 160] },
  { depth: 160, columns: [120, 180], rows: [15, 70] },
  { depth: 200, columns: [40, 100], rows: [100, 165] },
];

/** The front surface at (x, y) of the target (`view` 0) or the reference (1), and where that is on the surface. */
function hit(x, y, view) {
  const hits = SURFACES.map((surface, index) => ({
    ...surface,
    index,
    u: x - view * BASELINE * surface.depth,
  })).filter(
    ({ u, columns, rows }) => u >= columns[0] && u < columns[1] && y >= rows[0] && y < rows[1],
  );
  const front = hits.at(-1);
  if (!front) throw new Error("the background covers everything");
  return front;
}

function colour(u, y, index) {
  const wave = (fx, fy, phase) => 128 + 90 * Math.sin(u * fx + y * fy + phase + 2 * index);
  return [wave(0.31, 0.11, 0), wave(0.13, 0.27, 1), wave(0.21, -0.19, 2), 255];
}

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
