// How far the evaluation says that a map is from the true one.
import assert from "node:assert/strict";
import { test } from "node:test";
import { truthError } from "../../dist/eval/truth.js";

/** The error of a map that takes the depth of the case. @type {(
 *   fitted: import("depthstitch").Model,
 *   truth: import("../../dist/cases/case.js").Truth,
 *   depth: import("depthstitch").DepthInput,
 *   size: import("depthstitch").Size,
 * ) => import("../../dist/eval/truth.js").TruthError} */
const mapError = (fitted, truth, depth, size) => truthError(fitted, depth, truth, depth, size);

const IDENTITY = new Float64Array([1, 0, 0, 0, 1, 0, 0, 0, 1]);

/** A truth that shifts by `shift` per unit of depth, along x. @param {number} shift */
const truth = (shift) => ({
  h: [...IDENTITY],
  e: [shift, 0, 0],
  ownDepth: false,
  inverseDepth: undefined,
});

/** @param {number} width @param {number} height @param {(x: number, y: number) => number} value */
function depthMap(width, height, value) {
  const data = new Float32Array(width * height).map((_, i) =>
    value(i % width, Math.floor(i / width)),
  );
  return { data, width, height, kind: /** @type {"inverse" | "metric"} */ ("inverse") };
}

test("truth error: distance between both maps, inside and outside the reference", () => {
  // 40×40 target, depth 2, true shift +10 per unit: (x, y) → (x + 20, y), so that columns up to 16 (5 of 10 grid
  // columns) stay within the 40 columns of the reference. The fitted shift is 0.5 per unit longer: off by 1 px.
  const depth = depthMap(40, 40, () => 2);
  const fitted = { h: IDENTITY, e: new Float64Array([10.5, 0, 0]) };
  const size = { width: 40, height: 40 };
  assert.deepEqual(mapError(fitted, truth(10), depth, size), { inside: [1, 1], outside: [1, 1] });

  // Metric depth ½ is the same inverse depth; the sign of a model means nothing.
  const metric = { ...depthMap(40, 40, () => 0.5), kind: /** @type {const} */ ("metric") };
  const negated = { ...truth(10), h: [...IDENTITY].map((v) => -v), e: [-10, 0, 0] };
  assert.deepEqual(mapError(fitted, negated, metric, size), { inside: [1, 1], outside: [1, 1] });
});

test("truth error: median and 90th percentile where the error varies", () => {
  // No true motion; the fitted map shifts by d, and d is the column: grid columns 0, 4, …, 36 shift by 1, 5, …, 37.
  const depth = depthMap(40, 40, (x) => x + 1);
  const fitted = { h: IDENTITY, e: new Float64Array([1, 0, 0]) };
  const { inside, outside } = mapError(fitted, truth(0), depth, { width: 40, height: 40 });
  // Ten errors of each of 1, 5, …, 37: np.median 19, np.percentile 90 at rank 89.1, between 33 and 37.
  assert.ok(inside);
  assert.equal(inside[0], 19);
  assert.ok(Math.abs(inside[1] - (33 + 0.1 * 4)) < 1e-9, String(inside[1]));
  assert.equal(outside, null);
});

test("truth error: few points, holes, far points and other true depth", () => {
  const fitted = { h: IDENTITY, e: new Float64Array([0, 0, 0]) };
  const size = { width: 1000, height: 1000 };
  // A 20×16 target has 5×4 = 20 grid points: too few; one more row is enough.
  const inside = (/** @type {number} */ height) => {
    const depth = depthMap(20, height, () => 1);
    return mapError(fitted, truth(0), depth, size).inside;
  };
  assert.equal(inside(16), null);
  assert.deepEqual(inside(17), [0, 0]);
  // Holes and depth that is not positive are left out.
  const holes = depthMap(40, 40, (x) => (x < 20 ? NaN : x < 36 ? 1 : 0));
  assert.equal(mapError(fitted, truth(0), holes, size).inside?.length, 2);
  const mostlyHoles = depthMap(40, 40, (x) => (x < 32 ? NaN : 0));
  assert.equal(mapError(fitted, truth(0), mostlyHoles, size).inside, null);
  // Farther than 3000 px: neither inside nor outside.
  const far = mapError(
    fitted,
    truth(3100),
    depthMap(40, 40, () => 1),
    size,
  );
  assert.deepEqual(far, { inside: null, outside: null });
  // The true map takes the true depth, here 3 where the fitted one has 1.
  const inverseDepth = { data: new Float32Array(1600).fill(3), shape: [40, 40] };
  const other = { ...truth(1), inverseDepth };
  const shifted = { h: IDENTITY, e: new Float64Array([1, 4, 0]) };
  const expected = Math.hypot(1 - 3, 4);
  assert.deepEqual(
    mapError(
      shifted,
      other,
      depthMap(40, 40, () => 1),
      size,
    ).inside,
    [expected, expected],
  );
  // The fitted map takes the depth it was warped with, here 2.
  const used = depthMap(40, 40, () => 2);
  const given = depthMap(40, 40, () => 1);
  const along = { h: IDENTITY, e: new Float64Array([1, 0, 0]) };
  assert.deepEqual(truthError(along, used, truth(1), given, size).inside, [1, 1]);
});
