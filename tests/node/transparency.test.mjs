// Masked pixels of photos, through the API and on the command line.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { detect, stitch, stitchMany } from "depthstitch";
import { decodeImage, encodePng } from "depthstitch/codecs";
import { rejection, sample } from "./sample.mjs";

const MAIN = fileURLToPath(new URL("../../dist/cli/main.js", import.meta.url));

/** @type {string} */
let folder;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-alpha-"));
});
after(() => rm(folder, { recursive: true, force: true }));

/**
 * The image without a disc in its middle; beneath is a colour that is nowhere else.
 *
 * @param {import("depthstitch").ImageOutput} image
 * @param {number[]} colour
 */
function masked({ data, width, height }, colour) {
  const out = data.slice();
  for (let i = 0; i < width * height; i++) {
    const [x, y] = [(i % width) - width / 2, Math.floor(i / width) - height / 2];
    if (x * x + y * y < (height / 8) ** 2) out.set(colour, 4 * i);
  }
  return { data: out, width, height };
}

const MAGENTA = [255, 0, 255, 0];
const GREEN = [0, 255, 0, 127];

test("what is beneath transparent pixels makes no difference", async () => {
  const { target, reference, inputs } = await sample();
  const run = (/** @type {number[]} */ colour) =>
    stitch(masked(target, colour), masked(reference, colour), inputs);
  const [first, second] = [await run(MAGENTA), await run(GREEN)];
  assert.deepEqual(first.mosaic.data, second.mosaic.data);
  assert.deepEqual(first.seam.data, second.seam.data);
  assert.deepEqual(first.quality, second.quality);
  // In the middle of the reference something is seen, if not the reference.
  const { offset, seam, mosaic } = first;
  const at =
    (offset.y + Math.floor(reference.height / 2)) * seam.width +
    offset.x +
    Math.floor(reference.width / 2);
  assert.notEqual(seam.data[at], 2);
  assert.equal(mosaic.data[4 * at + 3], 255);
  const opaque = await stitch(target, reference, inputs);
  assert.ok((seam.data[at] ?? 0) === 1 || (first.voidMask.data[at] ?? 0) > 0);
  assert.notDeepEqual(first.mosaic.data, opaque.mosaic.data);
});

test("features and many photos take no notice of them either", async () => {
  const { target, reference } = await sample();
  const features = await Promise.all(
    [MAGENTA, GREEN].map((colour) => detect(masked(target, colour))),
  );
  assert.deepEqual(features[0], features[1]);
  const run = (/** @type {number[]} */ colour) =>
    stitchMany([target, masked(reference, colour)], { reference: 1 });
  const [first, second] = [await run(MAGENTA), await run(GREEN)];
  assert.deepEqual(first.mosaic.data, second.mosaic.data);
});

test("a photo that is wholly transparent is named", async () => {
  const { target, reference } = await sample();
  const nothing = { ...target, data: new Uint8ClampedArray(target.data.length) };
  const error = await rejection(stitch(target, nothing));
  assert.equal(error.code, "invalid-argument");
  assert.match(error.message, /^reference is transparent/);
  assert.equal(error.details.pixels, target.width * target.height);
  const many = await rejection(stitchMany([target, reference, nothing]));
  assert.match(many.message, /^photos\[2\]: photo is transparent/);
  assert.equal(many.details.photo, 2);

  const clear = join(folder, "clear.png");
  await writeFile(clear, await encodePng(nothing));
  const args = [MAIN, clear, clear, "-o", join(folder, "none.png")];
  const { status, stderr } = spawnSync(process.execPath, args, { encoding: "utf8" });
  assert.equal(status, 2);
  assert.match(stderr, /^depthstitch: invalid-argument: target is transparent/);
});

test("the command line reads alpha from PNG files", async () => {
  const { target, reference } = await sample();
  const write = async (/** @type {string} */ name, /** @type {number[]} */ colour) => {
    const paths = ["target", "reference"].map((photo) => join(folder, `${name}-${photo}.png`));
    await writeFile(paths[0] ?? "", await encodePng(target));
    await writeFile(paths[1] ?? "", await encodePng(masked(reference, colour)));
    const mosaic = join(folder, `${name}.png`);
    const { status, stderr } = spawnSync(process.execPath, [MAIN, ...paths, "-o", mosaic, "-q"]);
    assert.equal(status, 0, String(stderr));
    return decodeImage(await readFile(mosaic));
  };
  assert.deepEqual(await write("magenta", MAGENTA), await write("green", GREEN));
});
