// Files to pictures and back.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { test } from "node:test";
import {
  decodeDepth,
  decodeImage,
  encodeGrayPng,
  encodeJpeg,
  encodePng,
  init,
} from "depthstitch/codecs";
import { root } from "../../js/tools/shared.mjs";
import { rejection, sample } from "./sample.mjs";

const { target } = await sample();

test("a PNG comes back as it was, alpha included", async () => {
  const data = target.data.slice();
  data[3] = 0;
  data[7] = 128;
  const png = await encodePng({ ...target, data });
  assert.deepEqual(await decodeImage(png), { ...target, data });
});

test("a JPEG comes back nearly as it was", async () => {
  const jpeg = await encodeJpeg(target, 95);
  const back = await decodeImage(jpeg);
  assert.deepEqual([back.width, back.height], [target.width, target.height]);
  const error = back.data.reduce((sum, value, i) => sum + (value - (target.data[i] ?? 0)) ** 2, 0);
  assert.ok(Math.sqrt(error / back.data.length) < 6);
  assert.ok((await encodeJpeg(target, 30)).length < jpeg.length);
});

test("a gray PNG comes back as a depth map of 8 bit", async () => {
  const mask = { data: Uint8Array.from([0, 255, 7, 9, 128, 3]), width: 3, height: 2 };
  assert.deepEqual(await decodeDepth(await encodeGrayPng(mask)), mask);
});

test("a file may be a Buffer, an ArrayBuffer or a part of one", async () => {
  const png = await encodePng(target);
  const padded = Buffer.concat([Buffer.alloc(5), png]);
  for (const file of [Buffer.from(png), png.buffer, padded.subarray(5)]) {
    assert.deepEqual(await decodeImage(file), target);
  }
});

test("bad files and arguments", async () => {
  const broken = await rejection(decodeImage(Uint8Array.of(1, 2, 3)));
  assert.equal(broken.code, "decode-failed");
  assert.equal(broken.details.bytes, 3);
  const png = await encodePng(target);
  assert.equal((await rejection(decodeImage(png.subarray(0, 200)))).code, "decode-failed");
  const large = await rejection(decodeImage(png, 100));
  assert.equal(large.code, "too-large");
  for (const call of [
    () => decodeImage(/** @type {any} */ ("photo.png")),
    () => decodeImage(png, NaN),
    () => encodeJpeg(target, 0),
    () => encodePng(/** @type {any} */ (null)),
    () => encodeGrayPng(/** @type {any} */ ({ data: [0], width: 1, height: 1 })),
  ]) {
    assert.equal((await rejection(call())).code, "invalid-argument");
  }
  assert.equal((await rejection(encodePng({ ...target, width: 1 }))).code, "size-mismatch");
});

test("loading ahead is allowed", async () => {
  await init();
  await init();
});

test("the module may be given as the URL of a file, as text too", () => {
  const script = `
    import { init, stitch } from "depthstitch";
    await init(import.meta.resolve("depthstitch/depthstitch.wasm"));
    await stitch({}, {}).catch(({ code }) => console.log(code));
  `;
  const args = ["--input-type=module", "--eval", script];
  const { stdout, stderr } = spawnSync(process.execPath, args, { cwd: root, encoding: "utf8" });
  assert.equal(stdout, "invalid-argument\n", stderr);
});
