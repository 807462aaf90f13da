// `stitchMany` by several workers, of photos with parallax: every kind of task is shared.
import assert from "node:assert/strict";
import { availableParallelism } from "node:os";
import { test } from "node:test";
import { stitchMany } from "depthstitch";
import { rejection } from "./sample.mjs";
import { sampleSet } from "./sample-set.mjs";
import { assertRejectsAtDeath, started } from "./threads.mjs";

/** @typedef {import("depthstitch").Progress} Progress */

const skip = availableParallelism() < 2 && "one processor";

const { photos } = await sampleSet();

test("two and four workers make what one makes", { skip }, async () => {
  const { times: alone, ...expected } = await stitchMany(photos, { workers: 1 });
  assert.equal(expected.geometry, "cameras");
  for (const workers of /** @type {const} */ ([2, 4])) {
    const threads = await started(async () => {
      const { times, ...found } = await stitchMany(photos, { workers });
      assert.deepEqual(found, expected);
      assert.deepEqual(Object.keys(times), Object.keys(alone));
    });
    // One whose memory has grown large ends when its tasks are done.
    assert.ok(threads.length >= workers, `${threads.length} of ${workers}`);
  }
});

test("with cameras and depth, too, which may be given away", { skip }, async () => {
  const stitched = async (/** @type {import("depthstitch").StitchManyOptions} */ options) => {
    const { known } = await sampleSet();
    const { times: _, ...result } = await stitchMany(known, options);
    const left = known.flatMap(({ data, depth }) => [data.length, depth?.data.length ?? 0]);
    return { result, given: Math.max(...left) === 0 };
  };
  const expected = await stitched({ workers: 1 });
  assert.equal(expected.given, false);
  for (const options of /** @type {const} */ ([
    { worker: false },
    { workers: 2 },
    { workers: 4 },
    { workers: 1, transfer: true },
    { workers: 4, transfer: true },
  ])) {
    const { result, given } = await stitched(options);
    assert.deepEqual(result, expected.result, JSON.stringify(options));
    assert.equal(given, "transfer" in options, JSON.stringify(options));
  }
});

test("progress of a stage grows, and names every photo and pair", async () => {
  /** @type {Map<string, Progress[]>} */
  const stages = new Map();
  await stitchMany(photos, {
    workers: 2,
    onProgress: (progress) =>
      void stages.set(progress.stage, [...(stages.get(progress.stage) ?? []), progress]),
  });
  for (const [stage, reports] of stages) {
    const fractions = reports.map(({ fraction }) => fraction);
    assert.deepEqual(
      fractions,
      [...fractions].sort((a, b) => a - b),
      stage,
    );
  }
  const named = (/** @type {string} */ stage) =>
    new Set(stages.get(stage)?.map(({ photo, pair }) => `${photo ?? pair}`));
  photos.forEach((_, i) => assert.ok(named("detect").has(`${i}`)));
  photos.forEach((_, b) => {
    for (let a = 0; a < b; a++) assert.ok(named("match").has(`${a},${b}`));
  });
  assert.ok(named("depth").has("0,1"));
});

for (const [during, task] of /** @type {const} */ ([
  ["detect", "detect"],
  ["match", "matchPhotos"],
  ["depth", "matchStereo"],
])) {
  test(`aborting while they share the stage ${during} ends the call`, { skip }, async () => {
    const controller = new AbortController();
    const { signal } = controller;
    /** @param {Progress} progress */
    const onProgress = ({ stage }) => void (stage === during && controller.abort());
    const error = await rejection(stitchMany(photos, { workers: 2, signal, onProgress }));
    assert.equal(error.name, "AbortError");
  });

  test(
    `either may die during ${during}: the call rejects, the next one works`,
    { skip },
    async () => {
      for (const which of /** @type {const} */ ([0, 1])) {
        await assertRejectsAtDeath(which, task, (onProgress) =>
          stitchMany(photos, { workers: 2, onProgress }),
        );
      }
      assert.ok((await stitchMany(photos, { workers: 2 })).mosaic.width > 0);
    },
  );
}
