// Inpainting networks in Node.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { fill } from "depthstitch";
import { decodeImage } from "depthstitch/codecs";
import { loadInpainter } from "depthstitch/inpaint";
import { rejection } from "../node/sample.mjs";
import { lamaLike } from "./networks.mjs";
import { assertOnlyHoles, mask, paint, psnr, sample, without } from "./pictures.mjs";
import { weights } from "./weights.mjs";

/** @typedef {import("depthstitch/inpaint").Inpainter} Inpainter */
/** @typedef {import("./pictures.mjs").Picture} Picture */

const RED = [200, 30, 40];
const BLUE = [20, 60, 180];

/** Fills holes with the mean of what it sees: 512×512, as LaMa. @type {Inpainter} */
let average;
before(async () => {
  average = await loadInpainter({ model: "lama", weights: lamaLike(512) });
});

/** The colour of a pixel. @param {Picture} picture @param {number} x @param {number} y */
const at = ({ data, width }, x, y) => [
  ...data.subarray(4 * (y * width + x), 4 * (y * width + x) + 4),
];

/** @param {number[]} actual @param {number[]} expected @param {number} tolerance */
function assertNear(actual, expected, tolerance) {
  const far = expected.some((value, c) => Math.abs((actual[c] ?? NaN) - value) > tolerance);
  assert.ok(!far, `${actual.join(" ")} instead of ${expected.join(" ")}`);
}

test("each hole is filled from what is around it, and nothing else changes", async () => {
  const [width, height] = [2000, 700];
  const picture = paint(width, height, (x) => (x < 1000 ? RED : BLUE));
  const holes = mask(
    width,
    height,
    (x, y) => Math.hypot(x - 300, y - 350) < 60 || (x > 1600 && x < 1660 && y > 640),
  );
  const before = without(picture, holes);
  const kept = before.data.slice();
  const filled = await average.inpaint(before, holes);
  assertOnlyHoles(filled, before, holes);
  assert.deepEqual(before.data, kept, "the input stays as it was");
  assertNear(at(filled, 300, 350), [...RED, 255], 1);
  assertNear(at(filled, 1630, 690), [...BLUE, 255], 1);
});

test("what has no picture is neither looked at nor filled", async () => {
  const picture = paint(600, 600, () => RED);
  // The right half is beyond the mosaic's edge: transparent, and black.
  const outside = mask(600, 600, (x) => x >= 300);
  const holes = mask(600, 600, (x, y) => x >= 200 && x < 300 && y > 250 && y < 350);
  const before = without(without(picture, outside), holes);
  const filled = await average.inpaint(before, holes);
  assertOnlyHoles(filled, before, holes);
  assertNear(at(filled, 250, 300), [...RED, 255], 1);
  assert.deepEqual(at(filled, 400, 300), [0, 0, 0, 0]);
});

test("the border of a hole is unreliable", async () => {
  // Three pixels around the hole are white, as if mixed from two photos.
  const near = (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ reach) =>
    Math.max(Math.abs(x - 256), Math.abs(y - 256)) < 40 + reach;
  const picture = paint(512, 512, (x, y) => (near(x, y, 3) ? [255, 255, 255] : RED));
  const holes = mask(512, 512, (x, y) => near(x, y, 0));
  assertNear(at(await average.inpaint(picture, holes), 256, 256), [...RED, 255], 0);
  const model = { input: "float32", mask: "hole", outputMax: 255, tileSize: 512, dilation: 0 };
  const undilated = await loadInpainter({
    model: /** @type {any} */ (model),
    weights: lamaLike(512),
  });
  const [, green = 0] = at(await undilated.inpaint(picture, holes), 256, 256);
  assert.ok(green > 30, "without dilation it would be");
  await undilated.dispose();
});

test("a network of another size: the crop is resized, and the rest is not", async () => {
  const model = { input: "float32", mask: "hole", outputMax: 255, tileSize: 64, dilation: 2 };
  const options = { model: /** @type {any} */ (model), weights: lamaLike(64) };
  const small = await loadInpainter(options);
  const picture = paint(400, 300, (x, y) => [x / 2, y / 2, 99]);
  const holes = mask(400, 300, (x, y) => x > 100 && x < 260 && y > 80 && y < 240);
  const before = without(picture, holes);
  const filled = await small.inpaint(before, holes);
  assertOnlyHoles(filled, before, holes);
  const [, , blue = 0] = at(filled, 180, 160);
  assert.ok(Math.abs(blue - 99) <= 1, `${blue}`);
  await small.dispose();
});

test("pictures smaller than the network, and holes that leave little or nothing", async () => {
  const picture = paint(30, 20, () => BLUE);
  const none = mask(30, 20, () => false);
  assert.deepEqual((await average.inpaint(picture, none)).data, picture.data);
  const most = mask(30, 20, (x) => x > 8);
  const filled = await average.inpaint(without(picture, most), most);
  assertOnlyHoles(filled, without(picture, most), most);
  assertNear(at(filled, 25, 10), [...BLUE, 255], 1);
  const all = mask(30, 20, () => true);
  assertOnlyHoles(await average.inpaint(without(picture, all), all), without(picture, all), all);
});

test("many small holes are tiles, reported one by one, and can be stopped", async () => {
  const [width, height] = [1000, 800];
  const picture = paint(width, height, (x) => (x < 500 ? RED : BLUE));
  const holes = mask(width, height, (x, y) => x % 190 < 9 && y % 170 < 9);
  const before = without(picture, holes);
  /** @type {number[]} */
  const fractions = [];
  const onProgress = ({ fraction = 0 }) => void fractions.push(fraction);
  assertOnlyHoles(await average.inpaint(before, holes, { onProgress }), before, holes);
  assert.equal(fractions.at(-1), 1);
  assert.ok(fractions.length > 6 && fractions.length < 20, `${fractions.length} tiles`);
  assert.deepEqual(
    fractions,
    [...fractions].sort((a, b) => a - b),
  );

  const controller = new AbortController();
  const stopped = average.inpaint(before, holes, {
    signal: controller.signal,
    onProgress: ({ fraction }) => fraction > 0.3 && controller.abort(),
  });
  assert.equal((await rejection(stopped)).name, "AbortError");
  assertOnlyHoles(await average.inpaint(before, holes), before, holes);
});

test("wrong arguments", async () => {
  const wrong = /** @type {[any, RegExp][]} */ ([
    [{ model: "dalle" }, /model must be "migan" or "lama"/],
    [{ model: { input: "float64" } }, /model.input/],
    [
      { model: { input: "uint8", mask: "known", outputMax: 255, tileSize: 512, dilation: 3 } },
      /weights/,
    ],
    [{ weights: 3 }, /weights/],
    [{ url: "" }, /url/],
    [{ dilation: -1 }, /dilation/],
    [{ cache: "false" }, /cache must be true or false, got "false"/],
    [{ wasmPaths: 1 }, /wasmPaths must be a string or { mjs, wasm }, got 1/],
    [null, /options must be an object, got null/],
    [{ model: null }, /model must be .*, got null/],
    [{ model: { input: Object.create(null) } }, /model.input must be .*, got Object/],
  ]);
  for (const [options, message] of wrong) {
    const error = await rejection(loadInpainter(options));
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, message);
  }
  const picture = paint(8, 8, () => RED);
  const other = await rejection(
    average.inpaint(
      picture,
      mask(4, 4, () => true),
    ),
  );
  assert.equal(other.code, "size-mismatch");
  const sizes = { width: 4, height: 4, expectedWidth: 8, expectedHeight: 8 };
  assert.deepEqual(other.details, sizes);
  const whole = mask(8, 8, () => true);
  const none = /** @type {any} */ (null);
  for (const [inpainting, message] of /** @type {[Promise<unknown>, RegExp][]} */ ([
    [average.inpaint(none, whole), /mosaic must be an object, got null/],
    [average.inpaint(picture, none), /voidMask must be an object, got null/],
    [average.inpaint(picture, whole, none), /options must be an object, got null/],
  ])) {
    const refused = await rejection(inpainting);
    assert.equal(refused.code, "invalid-argument");
    assert.match(refused.message, message);
  }
  const short = { ...mask(8, 8, () => true), data: new Uint8Array(3) };
  const error = await rejection(average.inpaint(picture, short));
  assert.deepEqual([error.code, error.details.actual], ["size-mismatch", 3]);
});

test("a network that is not there, and one that is another", async () => {
  const error = await rejection(loadInpainter({ weights: "file:///no/such/network.onnx" }));
  assert.deepEqual([error.code, error.stage], ["model-load-failed", "model"]);
  assert.match(error.message, /no\/such\/network/);
  const { path, missing } = weights("fastdepth");
  if (missing) return;
  const depth = await loadInpainter({ weights: readFileSync(path) });
  const picture = paint(300, 300, () => RED);
  const holes = mask(300, 300, (x) => x > 280);
  assert.equal((await rejection(depth.inpaint(picture, holes))).code, "model-load-failed");
  await depth.dispose();
});

test("MI-GAN fills what it does not know, better than one colour would", async (t) => {
  const { path, missing } = weights("migan");
  if (missing) return t.skip(missing);
  const migan = await loadInpainter({ weights: readFileSync(path) });
  const photo = await decodeImage(readFileSync(join(sample, "reference.jpg")));
  const { width, height } = photo;
  for (const [name, holes, least] of /** @type {const} */ ([
    [
      "discs",
      mask(width, height, (x, y) => y < 320 && Math.hypot((x % 240) - 120, (y % 210) - 105) < 14),
      24,
    ],
    ["a strip", mask(width, height, (x, y) => x > 520 && x < 545 && y > 60 && y < 400), 19.5],
  ])) {
    const before = without(photo, holes);
    const start = process.cpuUsage();
    const filled = await migan.inpaint(before, holes);
    const seconds = process.cpuUsage(start).user / 1e6;
    assertOnlyHoles(filled, before, holes);
    const gray = paint(width, height, () => [128, 128, 128]);
    const found = psnr(filled, photo, holes);
    const smooth = psnr(await fill(before, holes), photo, holes);
    const flat = psnr(gray, photo, holes);
    t.diagnostic(
      `${name}: PSNR of the holes ${found.toFixed(2)} dB, smooth fill ${smooth.toFixed(2)} dB, gray ${flat.toFixed(2)} dB, ${seconds.toFixed(1)} s`,
    );
    assert.ok(found > least, `${name}: ${found}`);
    assert.ok(found > flat + 1, `${name}: ${found} against ${flat}`);
  }
  await migan.dispose();
});
