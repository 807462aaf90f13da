// What the benchmarks measure, of small photos: that they run, and that their numbers are of what they say.
import assert from "node:assert/strict";
import { fileURLToPath } from "node:url";
import { test } from "node:test";
import { measureMany, timeMany } from "../../dist/bench/many.js";
import { measureScale } from "../../dist/bench/scaling.js";
import { METHODS, timeStages, timeWhole } from "../../dist/bench/stages.js";
import { loadCase } from "../../dist/cases/case.js";
import { SET } from "./sample-set.mjs";

const PAIR = fileURLToPath(new URL("../../target/sample-small/", import.meta.url));

/** The stages of each method. */
const expected = {
  paper: "estimate warp measure blend fill",
  depth: "detect match estimate refine warp measure blend fill",
  photos: "detect match depth refine warp measure blend fill",
};

for (const method of METHODS) {
  test(`${method}: every stage is timed, and memory is close to what is predicted`, async () => {
    const { stitch = NaN, ...stages } = await timeStages(await loadCase(PAIR), method, 1, 0);
    assert.equal(Object.keys(stages).join(" "), expected[method]);
    const sum = Object.values(stages).reduce((sum, ms) => sum + ms, 0);
    assert.ok(sum > 0 && sum <= stitch, `${sum} of ${stitch} ms`);
    assert.ok((await timeWhole(await loadCase(PAIR), method, 2, 1, 0)) > 0);

    const { ms, megapixels, memory, predicted } = await measureScale(PAIR, method, 1);
    assert.ok(ms > 0);
    assert.equal(megapixels, 0.0384);
    assert.ok(predicted / memory > 0.5 && predicted / memory < 2, `${predicted} of ${memory}`);
  });
}

test("many photos: as many as are asked for", async () => {
  const { photos, used, megapixels, ms, processor, times, memory, predicted } = await measureMany(
    SET,
    3,
  );
  assert.deepEqual([photos, used, megapixels], [3, 3, 0.2304]);
  assert.ok(ms > 0 && processor > 0 && (times.detect ?? NaN) > 0);
  assert.deepEqual(
    predicted,
    [...predicted].sort((a, b) => a - b),
  );
  const last = predicted.at(-1) ?? NaN;
  assert.ok(last / memory > 0.5 && last / memory < 2, `${last} of ${memory}`);
  assert.ok((await timeMany(SET, 3, 2)) > 0);
});
