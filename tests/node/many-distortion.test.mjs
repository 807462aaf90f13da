// `stitchMany` and the command line with photos by a lens that distorts.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { stitchMany } from "depthstitch";
import { encodePng } from "depthstitch/codecs";
import { rejection } from "./sample.mjs";
import { sampleSet } from "./sample-set.mjs";

const MAIN = fileURLToPath(new URL("../../dist/cli/main.js", import.meta.url));
const K = 0.2;

/** A photo as a lens shows it that distorts by K. @param {import("depthstitch").ImageInput} photo */
function distorted({ data, width, height }) {
  const out = new Uint8ClampedArray(data.length);
  const [cx, cy] = [(width - 1) / 2, (height - 1) / 2];
  for (let i = 0; i < width * height; i++) {
    const [dx, dy] = [(i % width) - cx, Math.floor(i / width) - cy];
    const factor = 1 / (1 + (K * (dx * dx + dy * dy)) / (width * width + height * height));
    const [x, y] = [cx + dx * factor, cy + dy * factor];
    const [left, top] = [Math.min(Math.floor(x), width - 2), Math.min(Math.floor(y), height - 2)];
    for (let c = 0; c < 4; c++) {
      const at = (/** @type {number} */ column, /** @type {number} */ row) =>
        data[4 * (row * width + column) + c] ?? NaN;
      const along = (/** @type {number} */ row) =>
        at(left, row) + (at(left + 1, row) - at(left, row)) * (x - left);
      out[4 * i + c] = along(top) + (along(top + 1) - along(top)) * (y - top);
    }
  }
  return { data: out, width, height };
}

/** @type {string} */
let folder;
/** @type {ReturnType<typeof distorted>[]} */
let photos;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-distortion-"));
  photos = (await sampleSet()).photos.map(distorted);
});
after(() => rm(folder, { recursive: true, force: true }));

test("distortion is found, told, and not shown", async () => {
  const found = await stitchMany(photos, { outputDepth: true, worker: false });
  assert.ok(Math.abs(found.distortion - K) < 0.06, `${found.distortion}`);
  for (const [i, { undistorted, inverseDepth }] of found.photos.entries()) {
    const { width, height } = photos[i] ?? {};
    assert.ok(undistorted && width && height);
    // Of a pincushion the sides move inwards, by as much on either side.
    assert.ok(undistorted.width < width && undistorted.height < height);
    assert.equal((width - undistorted.width) % 2, 0);
    assert.equal(undistorted.data.length, 4 * undistorted.width * undistorted.height);
    assert.equal(inverseDepth?.width, undistorted.width);
  }
  const [one, two] = [
    await stitchMany(photos, { workers: 1, distortion: K }),
    await stitchMany(photos, { workers: 2, distortion: K }),
  ];
  assert.equal(one.distortion, K);
  assert.deepEqual(two.mosaic, one.mosaic);
  const none = await stitchMany(photos, { distortion: 0, outputDepth: true });
  assert.equal(none.distortion, 0);
  assert.ok(none.photos.every((photo) => !("undistorted" in photo)));
});

test("what no lens does is refused", async () => {
  for (const distortion of [-1.5, 2, NaN]) {
    const error = await rejection(stitchMany(photos, { distortion }));
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, /distortion/);
  }
});

test("the command line writes the distortion, and takes it back with the cameras", async () => {
  const files = await Promise.all(
    photos.map(async (photo, i) => {
      const file = join(folder, `${i}.png`);
      await writeFile(file, await encodePng(photo));
      return file;
    }),
  );
  const [mosaic, report] = [join(folder, "m.png"), join(folder, "r.json")];
  const run = async (/** @type {string[]} */ ...args) => {
    const all = [MAIN, ...files, ...args, "-o", mosaic, "--report", report];
    const { status, stderr } = spawnSync(process.execPath, all, { encoding: "utf8" });
    assert.equal(status, 0, stderr);
    return JSON.parse(await readFile(report, "utf8"));
  };
  const first = await run();
  assert.ok(Math.abs(first.distortion - K) < 0.06, `${first.distortion}`);
  const cameras = join(folder, "cameras.json");
  await writeFile(cameras, JSON.stringify(first));
  const again = await run("--cameras", cameras);
  assert.equal(again.distortion, first.distortion);
  assert.equal((await run("--distortion", "0")).distortion, 0);
});
