// `outputs`: which pictures and masks a result has.
import assert from "node:assert/strict";
import { test } from "node:test";
import { stitch } from "depthstitch";
import { rejection, sample } from "./sample.mjs";

/** All that there can be; the sample is shown on a cylinder, so that the reference is there as well. */
const ALL = /** @type {const} */ ([
  "mosaic",
  "voidMask",
  "seam",
  "warped",
  "footprint",
  "confidence",
  "projectedReference",
]);
/** @typedef {(typeof ALL)[number]} Output */

/** @param {readonly Output[]} [outputs] @param {import("depthstitch").StitchOptions} [options] */
async function run(outputs, options) {
  const { target, reference, inputs } = await sample();
  const given = { ...inputs, projection: /** @type {const} */ ("cylinder"), ...options };
  const result = await stitch(target, reference, { ...given, ...(outputs && { outputs }) });
  const { times: _, ...found } = result;
  return /** @type {Partial<typeof found>} */ (found);
}

/** Names of the pictures, masks and maps of a result. @param {object} result */
const pictures = (result) =>
  Object.entries(result).flatMap(([name, value]) =>
    value && ArrayBuffer.isView(value.data) ? [name] : [],
  );

test("what is asked for is there, nothing else, and all else is as ever", async () => {
  const whole = await run();
  assert.deepEqual(pictures(whole).sort(), [...ALL].sort());
  for (const worker of [true, false]) {
    for (const outputs of [ALL, ALL.slice(0, 1), ALL.slice(3, 6), [], ...ALL.map((o) => [o])]) {
      const result = await run(outputs, { worker });
      const absent = ALL.filter((name) => !outputs.includes(name));
      const expected = { ...whole };
      for (const name of absent) delete expected[name];
      assert.deepEqual(result, expected);
    }
  }
});

test("depth maps are asked for by outputDepth", async () => {
  const whole = await run(undefined, { outputDepth: true });
  const { targetDepth, referenceDepth } = await run([], { outputDepth: true });
  assert.deepEqual([targetDepth, referenceDepth], [whole.targetDepth, whole.referenceDepth]);
  assert.ok(targetDepth && referenceDepth);
});

test("other names, and what is no array, are refused", async () => {
  const { target, reference } = await sample();
  /** @type {[unknown, RegExp][]} */
  const wrong = [
    [["mosaic", "crop"], /outputs\[1\] must be one of "mosaic", .*, got "crop"/],
    [[, "mosaic"], /outputs\[0\] must be one of .*, got undefined/],
    [[7], /outputs\[0\] must be one of .*, got 7/],
    ["mosaic", /outputs must be an array, got "mosaic"/],
    [null, /outputs must be an array, got null/],
  ];
  for (const [outputs, message] of wrong) {
    const options = /** @type {import("depthstitch").StitchOptions} */ ({ outputs });
    const error = await rejection(stitch(target, reference, options));
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, message);
  }
});
