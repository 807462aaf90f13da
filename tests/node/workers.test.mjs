// Several workers share the work: the same result as of one, and the same ways to end it.
import assert from "node:assert/strict";
import { availableParallelism } from "node:os";
import { test } from "node:test";
import { align, detect, stitch, StitchError } from "depthstitch";
import { rejection, sample } from "./sample.mjs";
import { assertRejectsAtDeath, started } from "./threads.mjs";

/** @typedef {import("depthstitch").ImageOutput} ImageOutput */
/** @typedef {import("depthstitch").StitchOptions} StitchOptions */

const { target, reference, inputs } = await sample();
const skip = availableParallelism() < 2 && "one processor";

/** A copy of which the left half is transparent. @param {ImageOutput} image */
function half({ data, width, height }) {
  const copy = data.slice();
  for (let i = 3; i < copy.length; i += 4) if (((i >> 2) % width) * 2 < width) copy[i] = 0;
  return { data: copy, width, height };
}

/** @type {[string, ImageOutput, StitchOptions][]} */
const pairs = [
  ["two photos alone", target, {}],
  ["one is transparent in part", half(target), {}],
  ["with a depth map", target, { targetDepth: inputs.targetDepth }],
];
for (const [name, photo, options] of pairs) {
  test(`${name}: two workers make what one makes`, { skip }, async () => {
    const { times: alone, ...expected } = await stitch(photo, reference, {
      ...options,
      workers: 1,
    });
    const workers = await started(async () => {
      const { times, ...found } = await stitch(photo, reference, { ...options, workers: 2 });
      assert.deepEqual(found, expected);
      assert.deepEqual(Object.keys(times), Object.keys(alone));
      const aligned = await align(photo, reference, { ...options, workers: 2 });
      assert.deepEqual(aligned, await align(photo, reference, { ...options, workers: 1 }));
    });
    assert.equal(workers.length, 2);
  });
}

test("progress of two workers is that of one stage after another", async () => {
  /** @type {import("depthstitch").Progress[]} */
  const seen = [];
  await stitch(target, reference, {
    workers: 2,
    onProgress: (progress) => void seen.push(progress),
  });
  const stages = seen.map(({ stage }) => stage).filter((stage, i, all) => stage !== all[i - 1]);
  assert.deepEqual(stages.slice(0, 3), ["input", "detect", "match"]);
  assert.equal(stages.indexOf("input", 1), -1);
  const detection = seen.filter(({ stage }) => stage === "detect");
  detection.forEach(({ fraction }, i) => assert.ok(fraction >= (detection[i - 1]?.fraction ?? 0)));
  assert.equal(detection.at(-1)?.fraction, 1);
});

test("what is refused is refused in the same words", async () => {
  const nowhere = { ...reference, data: new Uint8ClampedArray(reference.data.length) };
  const short = { ...reference, data: reference.data.slice(4) };
  for (const [photo, options] of /** @type {const} */ ([
    [nowhere, {}],
    [short, {}],
    [reference, { maxBytes: 1000 }],
    [reference, { matchRatio: 2 }],
  ])) {
    const [one, two] = [
      await rejection(stitch(target, photo, { ...options, workers: 1 })),
      await rejection(stitch(target, photo, { ...options, workers: 2 })),
    ];
    assert.deepEqual({ ...two, message: two.message }, { ...one, message: one.message });
  }
});

test("one worker where two would take too much memory", { skip }, async () => {
  const { details } = await rejection(stitch(target, reference, { maxBytes: 1 }));
  assert.ok(details.bytes);
  const maxBytes = 1.9 * details.bytes;
  const few = await started(() => stitch(target, reference, { maxBytes, workers: 4 }));
  assert.equal(few.length, 1);
});

test("a worker is kept for the next call, unless its memory has grown large", async () => {
  const white = (/** @type {number} */ side) => ({
    data: new Uint8Array(4 * side * side).fill(255),
    width: side,
    height: side,
  });
  const blank = (/** @type {number} */ side) =>
    detect(white(side), { transfer: true, maxBytes: 2 ** 32 });
  const refused = (/** @type {number} */ side) =>
    rejection(stitch(white(side), white(side), { matches: new Float32Array(4), transfer: true }));
  assert.equal((await started(async () => void [await blank(100), await blank(100)])).length, 1);
  assert.equal((await started(async () => void [await blank(6000), await blank(100)])).length, 2);
  assert.equal((await started(async () => void [await refused(100), await blank(100)])).length, 1);
  assert.equal((await started(async () => void [await refused(3000), await blank(100)])).length, 2);
});

test("an array passed as both photos", async () => {
  const once = await stitch(target, target, { workers: 1, transfer: false });
  const copy = { ...target, data: target.data.slice() };
  const twice = await stitch(copy, copy, { workers: 2, transfer: true });
  assert.deepEqual(twice.mosaic, once.mosaic);
});

test("any of the workers may die: the call rejects, the next one works", { skip }, async () => {
  for (const which of /** @type {const} */ ([0, 1])) {
    await assertRejectsAtDeath(which, "detect", (onProgress) =>
      stitch(target, reference, { workers: 2, onProgress }),
    );
    assert.ok((await stitch(target, reference, { workers: 2 })).mosaic.width > 0);
  }
});

test("aborting before anything is detected starts no other worker", async () => {
  const controller = new AbortController();
  const { signal } = controller;
  const onProgress = () => controller.abort();
  const workers = await started(async () => {
    const error = await rejection(stitch(target, reference, { workers: 2, signal, onProgress }));
    assert.equal(error.name, "AbortError");
    await new Promise((resolve) => setTimeout(resolve, 50));
  });
  assert.equal(workers.length, 1);
});

test("aborting and throwing end the call while two workers work", async () => {
  const controller = new AbortController();
  /** @param {import("depthstitch").Progress} progress */
  const abort = ({ stage }) => void (stage === "detect" && controller.abort());
  const { signal } = controller;
  const error = await rejection(
    stitch(target, reference, { workers: 2, signal, onProgress: abort }),
  );
  assert.equal(error.name, "AbortError");
  const mine = new Error("mine");
  const onProgress = () => {
    throw mine;
  };
  await assert.rejects(stitch(target, reference, { workers: 2, onProgress }), mine);
  assert.ok((await stitch(target, reference, { workers: 2 })).mosaic.width > 0);
});

test("a worker goes on after an error of the core, and is stopped by any that onProgress throws", async () => {
  /** @type {ConstructorParameters<typeof StitchError>[0]} */
  const record = { code: "too-few-matches", stage: "estimate", message: "mine", details: {} };
  const mine = new StitchError(record);
  const onProgress = () => {
    throw mine;
  };
  const stopped = await started(async () => {
    const error = await rejection(stitch(target, reference, { ...inputs, onProgress }));
    assert.equal(error, mine);
    await stitch(target, reference, inputs);
  });
  assert.equal(stopped.length, 2);
  const kept = await started(async () => {
    const matches = new Float32Array(4);
    const error = await rejection(stitch(target, reference, { ...inputs, matches }));
    assert.equal(error.code, mine.code);
    await stitch(target, reference, inputs);
  });
  assert.equal(kept.length, 1);
});

test("workers must be 1, 2, 4 or auto", async () => {
  for (const workers of [0, 3, "two", null]) {
    const options = /** @type {StitchOptions} */ ({ workers });
    const error = await rejection(stitch(target, reference, options));
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, /^workers must be/);
  }
});
