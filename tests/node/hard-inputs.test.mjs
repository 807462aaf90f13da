// Invalid inputs of every kind, on the calling thread and in a worker: a StitchError with the right code and the wrong number
// in its details, and the next call works.
import assert from "node:assert/strict";
import { test } from "node:test";
import { blend, estimate, fill, measure, stitch, warp } from "depthstitch";
import { rejection, sample } from "./sample.mjs";

const { target, reference, inputs } = await sample();
const { width, height } = reference;
const { times: _, ...expected } = await stitch(target, reference, { ...inputs, worker: false });
const size = { width, height };
const huge = { width: 100_000, height: 100_000 };
const flat = () => ({ h: Float64Array.of(1, 0, 0, 0, 1, 0, 0, 0, 1), e: new Float64Array(3) });

/** The depth of the target with some of it replaced. @param {object} change */
const depth = (change) => ({ ...inputs, targetDepth: { ...inputs.targetDepth, ...change } });

/** @param {number} count @param {(i: number) => number} value */
const matches = (count, value) => ({
  ...inputs,
  matches: Float32Array.from({ length: 4 * count }, (_, i) => value(i)),
});

/**
 * What is wrong, the call, its error's code and the numbers to find in its details.
 *
 * @type {[name: string, call: (how: { worker: boolean }) => Promise<unknown>, code: string, details?: object][]}
 */
const rows = [
  // Photos.
  ["a photo without width", photo({ width: undefined }), "invalid-argument"],
  ["a photo without data", photo({ data: undefined }), "invalid-argument"],
  ["a photo as floats", photo({ data: new Float32Array(4) }), "invalid-argument"],
  ["a photo as a buffer", photo({ data: new ArrayBuffer(4) }), "invalid-argument"],
  ["a height in words", photo({ height: "160" }), "invalid-argument"],
  ["a height of NaN", photo({ height: NaN }), "invalid-argument", { value: NaN }],
  ["a negative height", photo({ height: -160 }), "invalid-argument", { value: -160 }],
  ["a fractional height", photo({ height: 159.5 }), "invalid-argument", { value: 159.5 }],
  ["no pixels", photo({ data: new Uint8Array(0), ...{ width: 0, height: 0 } }), "invalid-argument"],
  [
    "an RGB photo",
    photo({ data: new Uint8Array(3 * width * height) }),
    "size-mismatch",
    lengths(3),
  ],
  [
    "a photo too long",
    photo({ data: new Uint8Array(5 * width * height) }),
    "size-mismatch",
    lengths(5),
  ],
  ["a huge photo", photo(huge), "too-large", huge],
  [
    "a huge reference",
    (how) => go(target, { ...reference, ...huge }, inputs, how),
    "too-large",
    huge,
  ],
  [
    "sides whose product overflows 64 bits",
    photo({ width: 2 ** 32 - 1, height: 2 ** 32 - 1 }),
    "too-large",
    { width: 2 ** 32 - 1 },
  ],
  // Depth.
  ["a depth map without kind", withInputs(depth({ kind: undefined })), "invalid-argument"],
  ["a depth map without width", withInputs(depth({ width: undefined })), "invalid-argument"],
  ["depth in doubles", withInputs(depth({ data: new Float64Array(4) })), "invalid-argument"],
  ["a hole in words", withInputs(depth({ invalid: "0" })), "invalid-argument"],
  [
    "a depth map of width NaN",
    withInputs(depth({ width: NaN })),
    "invalid-argument",
    { value: NaN },
  ],
  [
    "a depth map of half a row",
    withInputs(depth({ height: 0.5 })),
    "invalid-argument",
    { value: 0.5 },
  ],
  ["a huge depth map", withInputs(depth(huge)), "size-mismatch", { expected: 1e10 }],
  [
    "a depth map without values",
    withInputs(depth({ data: new Uint8Array(0) })),
    "size-mismatch",
    { actual: 0 },
  ],
  [
    "a depth map in wrong units of length",
    withInputs(depth({ data: new Uint16Array(7) })),
    "size-mismatch",
    { expected: width * height, actual: 7 },
  ],
  // Matches.
  [
    "matches as doubles",
    withInputs({ ...inputs, matches: new Float64Array(400) }),
    "invalid-argument",
  ],
  [
    "half a match",
    withInputs({ ...inputs, matches: new Float32Array(402) }),
    "size-mismatch",
    { actual: 402 },
  ],
  [
    "all matches NaN",
    withInputs(matches(50, () => NaN)),
    "too-few-matches",
    { matches: 50, usable: 0 },
  ],
  [
    "all matches infinite",
    withInputs(matches(50, () => Infinity)),
    "too-few-matches",
    { usable: 0 },
  ],
  [
    "all matches out of frame",
    withInputs(matches(50, (i) => -9 - i)),
    "too-few-matches",
    { usable: 0 },
  ],
  [
    "one match, often",
    withInputs(matches(50, () => 20)),
    "too-few-matches",
    { matches: 50, usable: 1 },
  ],
  // Options.
  [
    "a grid of -1 columns",
    withInputs({ ...inputs, gridColumns: -1 }),
    "invalid-argument",
    { value: -1 },
  ],
  [
    "a grid of 1e9 rows",
    withInputs({ ...inputs, gridRows: 1e9 }),
    "invalid-argument",
    { value: 1e9 },
  ],
  ["1.5 trials", withInputs({ ...inputs, maxTrials: 1.5 }), "invalid-argument", { value: 1.5 }],
  [
    "a seed of 2³²",
    withInputs({ ...inputs, seed: 2 ** 32 }),
    "invalid-argument",
    { value: 2 ** 32 },
  ],
  ["a threshold in words", withInputs({ ...inputs, threshold: "wide" }), "invalid-argument"],
  [
    "a distance of NaN",
    withInputs({ ...inputs, voidDistance: NaN }),
    "invalid-argument",
    { value: NaN },
  ],
  [
    "an infinite limit",
    withInputs({ ...inputs, canvasLimit: Infinity }),
    "invalid-argument",
    { value: Infinity },
  ],
  [
    "a negative stretch",
    withInputs({ ...inputs, stretchLimit: -2 }),
    "invalid-argument",
    { value: -2 },
  ],
  ["an unknown warp", withInputs({ ...inputs, warpMode: "sideways" }), "invalid-argument"],
  ["an unknown fill", withInputs({ ...inputs, fill: "lama" }), "invalid-argument"],
  [
    "a budget of 2⁴⁰ bytes",
    withInputs({ ...inputs, maxBytes: 2 ** 40 }),
    "invalid-argument",
    { value: 2 ** 40 },
  ],
  ["an option of the command line", withInputs({ ...inputs, "max-bytes": 1 }), "invalid-argument"],
  [
    "options that are none",
    (how) => go(target, reference, how.worker ? "fast" : 3, {}),
    "invalid-argument",
  ],
  // Stages called alone.
  [
    "estimate: no sizes",
    (how) => estimate(any({ matches: inputs.matches }), how),
    "invalid-argument",
  ],
  [
    "estimate: a size of NaN",
    (how) => estimate({ ...inputs, targetSize: { width: NaN, height }, referenceSize: size }, how),
    "invalid-argument",
    { value: NaN },
  ],
  ["estimate: no inputs", (how) => estimate(any(undefined), how), "invalid-argument"],
  ["warp: a model without e", warped({ h: flat().h }), "invalid-argument"],
  [
    "warp: a model of NaN",
    warped({ ...flat(), h: new Float64Array(9).fill(NaN) }),
    "invalid-argument",
  ],
  [
    "warp: a model as lists",
    warped({ h: [1, 0, 0, 0, 1, 0, 0, 0, 1], e: [0, 0, 0] }),
    "invalid-argument",
  ],
  [
    "warp: an epipole of 4 numbers",
    warped({ ...flat(), e: new Float64Array(4) }),
    "size-mismatch",
    { actual: 4 },
  ],
  [
    "warp: parallax without depth",
    warped({ ...flat(), e: Float64Array.of(9, 0, 0) }),
    "invalid-argument",
  ],
  [
    "warp: everything behind the camera",
    warped({ ...flat(), h: new Float64Array(9) }),
    "no-overlap",
  ],
  [
    "blend: an offset of -1",
    blended({ offset: { x: -1, y: 0 } }),
    "invalid-argument",
    { value: -1 },
  ],
  [
    "blend: an offset of half a pixel",
    blended({ offset: { x: 0, y: 0.5 } }),
    "invalid-argument",
    { value: 0.5 },
  ],
  [
    "blend: an offset off the canvas",
    blended({ offset: { x: 2 ** 32 - 1, y: 0 } }),
    "size-mismatch",
  ],
  [
    "blend: a canvas too small",
    blended({ offset: { x: expected.warped.width, y: 0 } }),
    "size-mismatch",
  ],
  [
    "blend: another footprint",
    blended({ footprint: { data: new Uint8Array(6), width: 3, height: 2 } }),
    "size-mismatch",
  ],
  ["blend: no footprint", blended({ footprint: undefined }), "invalid-argument"],
  [
    "measure: a canvas too small",
    (how) => measure({ ...expected, offset: { x: 1e6, y: 1e6 } }, reference, how),
    "size-mismatch",
  ],
  [
    "measure: nothing drawn",
    (how) => measure({ ...expected, warped: blank() }, reference, how),
    "no-overlap",
    { pixels: 0 },
  ],
  [
    "fill: a mask of another size",
    (how) => fill(reference, expected.voidMask, how),
    "size-mismatch",
  ],
  [
    "fill: a mask on its side",
    (how) =>
      fill(reference, { data: new Uint8Array(width * height), width: height, height: width }, how),
    "size-mismatch",
  ],
  [
    "fill: a radius of 0",
    (how) => fill(expected.mosaic, expected.voidMask, { ...how, fillRadius: 0 }),
    "invalid-argument",
    { value: 0 },
  ],
];

for (const worker of [true, false]) {
  test(worker ? "in a worker" : "on the calling thread", async (t) => {
    for (const [name, call, code, details] of rows) {
      await t.test(name, async () => {
        const error = await rejection(call({ worker }));
        assert.equal(error.code, code, error.message);
        for (const [key, value] of Object.entries(details ?? {})) {
          assert.ok(
            Object.is(error.details[key], value),
            `${key} is ${error.details[key]}, not ${value}`,
          );
        }
        const { times: _, ...result } = await stitch(target, reference, { ...inputs, worker });
        assert.deepEqual(result, expected);
      });
    }
  });
}

/** Invalid matches among valid ones are dropped, and only they. */
test("wrong numbers among good matches change nothing", async () => {
  const wrong = [NaN, Infinity, -Infinity, 3e38, -1, 1e6];
  const mixed = Array.from({ length: inputs.matches.length / 4 }, (_, i) => {
    const good = [...inputs.matches.subarray(4 * i, 4 * i + 4)];
    const broken = good.map((value, k) => (k === i % 4 ? (wrong[i % wrong.length] ?? NaN) : value));
    return [...broken, ...good];
  });
  const found = await stitch(target, reference, {
    ...inputs,
    matches: Float32Array.from(mixed.flat()),
  });
  assert.deepEqual(found.mosaic, expected.mosaic);
  assert.deepEqual(
    found.inliers.filter((_, i) => i % 2 === 1),
    expected.inliers,
  );
  assert.ok(found.inliers.every((inlier, i) => i % 2 === 1 || inlier === 0));
});

test("uninformative depth maps are ignored with a warning", async () => {
  const pixels = width * height;
  const constant = { data: new Float32Array(pixels).fill(2), ...size, kind: "metric" };
  const holes = { data: new Uint8Array(pixels), ...size, kind: "inverse", invalid: 0 };
  for (const [targetDepth, referenceDepth, withoutDepth, code, model] of /** @type {const} */ ([
    [constant, constant, "two-view", "depth-inconsistent", "two-view"],
    [holes, holes, "two-view", "depth-unusable", "two-view"],
    [holes, inputs.referenceDepth, "two-view", "depth-unusable", "two-view"],
    [holes, holes, "homography", "depth-unusable", "homography"],
    [inputs.targetDepth, undefined, "homography", "no-depth", "homography"],
    [undefined, inputs.referenceDepth, "homography", "no-depth", "homography"],
  ])) {
    const depths = { targetDepth, referenceDepth, outputDepth: true };
    // Refinement may end in a homography that looks more natural.
    const options = any({ ...inputs, ...depths, withoutDepth, refinement: "none" });
    const found = await stitch(target, reference, options);
    assert.equal(found.report.model, model, code);
    assert.equal(found.targetDepth !== undefined, model === "two-view");
    assert.equal(found.referenceDepth !== undefined, model === "two-view");
    assert.ok(
      found.report.warnings.some((warning) => warning.code === code),
      code,
    );
  }
});

/** @param {unknown} value @returns {any} */
function any(value) {
  return value;
}

/** @param {unknown} first @param {unknown} second @param {unknown} options @param {object} how */
function go(first, second, options, how) {
  const all = typeof options === "object" ? { ...options, ...how } : options;
  return stitch(any(first), any(second), any(all));
}

/** Stitches a target with some of it replaced. @param {object} change @returns {(how: object) => Promise<unknown>} */
function photo(change) {
  return (how) => go({ ...target, ...change }, reference, inputs, how);
}

/** @param {object} wrong @returns {(how: object) => Promise<unknown>} */
function withInputs(wrong) {
  return (how) => go(target, reference, wrong, how);
}

/** Warps by a wrong forward model. @param {object} forward @returns {(how: object) => Promise<unknown>} */
function warped(forward) {
  return (how) => warp(target, reference, any({ forward, reverse: flat() }), how);
}

/** Blends what is partly wrong. @param {object} change @returns {(how: object) => Promise<unknown>} */
function blended(change) {
  return (how) => blend(any({ ...expected, ...change }), reference, how);
}

/** A canvas with nothing on it. */
function blank() {
  const { data, ...size } = expected.warped;
  return { data: new Uint8ClampedArray(data.length), ...size };
}

/** Lengths of the buffer of a photo with so many channels. @param {number} channels */
function lengths(channels) {
  return { expected: 4 * width * height, actual: channels * width * height };
}
