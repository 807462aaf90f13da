// Invalid inputs are reported by a StitchError that names them.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  align,
  blend,
  detect,
  estimate,
  fill,
  measure,
  stitch,
  StitchError,
  stitchMany,
  warp,
} from "depthstitch";
import { rejection, sample } from "./sample.mjs";

const { target, reference, inputs } = await sample();
const { width, height } = reference;

/** @param {object} wrong */
const withWrong = (wrong) =>
  rejection(stitch(target, reference, /** @type {any} */ ({ ...inputs, ...wrong })));

/** @param {unknown} image */
const withTarget = (image) =>
  rejection(stitch(/** @type {any} */ (image), reference, { ...inputs }));

test("a StitchError is an Error with code, stage and details", async () => {
  const error = await withWrong({ matches: new Float32Array(12) });
  assert.ok(error instanceof Error && error instanceof StitchError);
  assert.equal(error.name, "StitchError");
  assert.equal(error.code, "too-few-matches");
  assert.equal(error.stage, "estimate");
  assert.equal(error.details.matches, 3);
  assert.match(error.message, /3/);
});

test("wrong types", async () => {
  const wrong = [
    [{ matches: [1, 2, 3, 4] }, /matches must be a Float32Array, got Array/],
    [{ targetDepth: { ...inputs.targetDepth, kind: "disparity" } }, /kind/],
    [{ targetDepth: { ...inputs.targetDepth, data: [1] } }, /targetDepth.data/],
    [{ seed: "1" }, /seed/],
    [{ seed: {} }, /seed/],
    [{ seed: () => 1 }, /seed/],
    [{ signal: {} }, /signal/],
    [{ onProgress: 1 }, /onProgress/],
    [{ worker: "no" }, /worker/],
    [{ robustFit: "best" }, /robustFit/],
    [{ treshold: 3 }, /treshold/],
  ];
  for (const [options, message] of wrong) {
    const error = await withWrong(/** @type {object} */ (options));
    assert.equal(error.code, "invalid-argument", JSON.stringify(options));
    assert.match(error.message, /** @type {RegExp} */ (message));
  }
  for (const image of [
    null,
    undefined,
    3,
    "photo.jpg",
    [],
    { data: [1, 2], width: 1, height: 1 },
  ]) {
    const error = await withTarget(image);
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, /^target/);
  }
});

test("what another call takes is no option", async () => {
  const model = { h: new Float64Array(9), e: new Float64Array(3) };
  const geometry = { forward: model, reverse: model };
  const mask = { data: new Uint8Array(width * height), width, height };
  const offset = { x: 0, y: 0 };
  const warped = { warped: reference, footprint: mask, offset, clipped: false };
  const { matches, targetDepth } = inputs;
  /** @type {[string, (options: any) => Promise<unknown>, object[]][]} */
  const calls = [
    ["stitch", (o) => stitch(target, reference, o), [{ reference: 1 }, { distortion: 0 }]],
    ["align", (o) => align(target, reference, o), [{ reliable: mask }]],
    [
      "stitchMany",
      (o) => stitchMany([target, reference], o),
      [{ outputs: ["mosaic"] }, { matches }, { targetDepth }],
    ],
    ["detect", (o) => detect(target, o), [{ matches: null }]],
    ["warp", (o) => warp(target, reference, geometry, o), [{ matches }, { outputDepth: true }]],
    ["blend", (o) => blend(warped, reference, o), [{ targetDepth }, { gains: [1, 1, 1] }]],
    ["fill", (o) => fill(reference, mask, o), [{ reliable: mask }]],
    ["measure", (o) => measure(warped, reference, o), [{ reliable: mask }, { seed: 1 }]],
  ];
  for (const [name, call, wrong] of calls) {
    for (const options of wrong) {
      const error = await rejection(call(options));
      assert.equal(error.code, "invalid-argument", name);
      assert.equal(error.message, `there is no option ${Object.keys(options)[0]}`, name);
    }
  }
  // What is undefined is not there.
  assert.ok(await measure(warped, reference, /** @type {any} */ ({ seed: undefined })));
});

test("null stands for no depth maps and no matches", async () => {
  const none = { targetDepth: null, referenceDepth: null, matches: null };
  const [withNull, without] = [
    await stitch(target, reference, none),
    await stitch(target, reference),
  ];
  assert.deepEqual(withNull.mosaic, without.mosaic);
  const { referenceDepth, ...one } = inputs;
  assert.ok(referenceDepth);
  const [given, absent] = [
    await stitch(target, reference, { ...one, referenceDepth: null }),
    await stitch(target, reference, one),
  ];
  assert.deepEqual(given.mosaic, absent.mosaic);
  assert.notDeepEqual(given.mosaic, without.mosaic);
});

test("numbers out of range", async () => {
  for (const side of [NaN, -1, 0, 1.5, Infinity, 2 ** 32]) {
    const error = await withTarget({ ...target, width: side });
    assert.equal(error.code, "invalid-argument", `width ${side}`);
    assert.ok(Object.is(error.details.value, side), `width ${side}`);
  }
  for (const options of [
    { seed: -1 },
    { seed: NaN },
    { confidence: 2 },
    { threshold: 0 },
    { fillRadius: 1e9 },
    { fillMaxWidth: 101 },
  ]) {
    const error = await withWrong(options);
    assert.equal(error.code, "invalid-argument");
    for (const [name, value] of Object.entries(options)) {
      assert.match(error.message, new RegExp(name));
      assert.ok(Object.is(error.details.value, value));
    }
  }
});

test("the gain that is wrong is named", async () => {
  const footprint = { data: new Uint8Array(width * height), width, height };
  const warped = { warped: reference, footprint, offset: { x: 0, y: 0 }, clipped: false };
  for (const [gains, message, details] of /** @type {[any, RegExp, object][]} */ ([
    [1, /^gains must be three numbers, got 1$/, { value: 1 }],
    [[1, 1], /^gains must be three numbers, got 2$/, { expected: 3, actual: 2 }],
    [[1, 1, "1"], /^gains\[2\] must be a number, got "1"$/, {}],
    [new Array(3), /^gains\[0\] must be a number, got undefined$/, {}],
    [[1, 0, 1], /^gains\[1\] must be finite and above 0, got 0$/, { value: 0 }],
    [[1, 1, NaN], /^gains\[2\] must be finite and above 0, got NaN$/, { value: NaN }],
  ])) {
    const error = await rejection(measure(warped, reference, { gains }));
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, message);
    assert.deepEqual(error.details, details);
  }
});

test("buffers of the wrong length", async () => {
  const short = await withTarget({ ...target, data: target.data.slice(4) });
  assert.equal(short.code, "size-mismatch");
  assert.equal(short.details.expected, target.data.length);
  assert.equal(short.details.actual, target.data.length - 4);

  const { targetDepth } = inputs;
  const depth = await withWrong({
    targetDepth: { ...targetDepth, height: targetDepth.height + 1 },
  });
  assert.equal(depth.code, "size-mismatch");
  assert.equal(depth.details.actual, targetDepth.data.length);

  const odd = await withWrong({ matches: inputs.matches.slice(1) });
  assert.equal(odd.code, "size-mismatch");

  const mask = { data: new Uint8Array(3), width, height };
  assert.equal((await rejection(fill(reference, mask))).code, "size-mismatch");

  const model = { h: new Float64Array(8), e: new Float64Array(3) };
  const geometry = { forward: model, reverse: model };
  const { matches: _, ...depths } = inputs;
  assert.equal((await rejection(warp(target, reference, geometry, depths))).code, "size-mismatch");
});

test("matches that determine nothing", async () => {
  const none = await withWrong({ matches: new Float32Array(0) });
  assert.equal(none.code, "too-few-matches");

  const line = Float32Array.from({ length: 160 }, (_, i) => 5 + Math.floor(i / 4));
  const degenerate = await withWrong({ matches: line });
  assert.equal(degenerate.code, "degenerate-geometry");

  let state = 1;
  const random = () => (state = (state * 48271) % 2147483647) / 2147483647;
  const sides = [target.width, target.height, width, height];
  const noise = Float32Array.from(Array(100).fill(sides).flat(), (side) => random() * side - 0.5);
  const lost = await withWrong({ matches: noise });
  assert.equal(lost.code, "no-consensus");
  assert.ok((lost.details.inliers ?? NaN) < (lost.details.needed ?? NaN));
});

test("a job above the memory limit is refused with its size", async () => {
  const error = await withWrong({ maxBytes: 100_000 });
  assert.equal(error.code, "too-large");
  assert.equal(error.details.limit, 100_000);
  assert.ok((error.details.bytes ?? 0) > 100_000);
  const huge = { width: 100_000, height: 100_000 };
  const { matches } = inputs;
  const refused = await rejection(estimate({ targetSize: huge, referenceSize: huge, matches }));
  assert.equal(refused.code, "too-large");
});

test("without a worker errors are the same", async () => {
  for (const wrong of [{ matches: new Float32Array(12) }, { seed: -1 }, { maxBytes: 100_000 }]) {
    const there = await withWrong(wrong);
    const here = await withWrong({ ...wrong, worker: false });
    const parts = (/** @type {StitchError} */ { code, stage, details, message, name }) => ({
      ...{ code, stage, details, message, name },
    });
    assert.deepEqual(parts(here), parts(there));
  }
});

test("arguments that cannot be read", async () => {
  const data = target.data.slice();
  structuredClone(data, { transfer: [data.buffer] });
  const transferred = await withTarget({ ...target, data });
  assert.equal(transferred.code, "invalid-argument");
  assert.match(transferred.message, /^target.data has a buffer that was transferred/);
  const { proxy, revoke } = Proxy.revocable({}, {});
  revoke();
  const revoked = await withTarget(proxy);
  assert.equal(revoked.code, "invalid-argument");
  assert.ok(revoked.cause instanceof TypeError);
  const warped = { warped: target, footprint: { data: new Uint8Array(1), width: 1, height: 1 } };
  const nothing = await rejection(
    blend(/** @type {any} */ (warped), reference, /** @type {any} */ (null)),
  );
  assert.equal(nothing.code, "invalid-argument");
  assert.match(nothing.message, /options must be an object, got null/);
});
