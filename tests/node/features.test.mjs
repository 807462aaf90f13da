// Features and matches of our own: alone, inside stitch, and with something wrong.
import assert from "node:assert/strict";
import { test } from "node:test";
import { detect, match, matchImages, stitch } from "depthstitch";
import { rejection, sample } from "./sample.mjs";

const { target, reference, inputs } = await sample();
const { matches: _, ...depths } = inputs;

test("detect and match alone give what matchImages gives, in a worker or not", async () => {
  const [left, right] = [await detect(target), await detect(reference)];
  assert.equal(left.keypoints.length / 5, left.descriptors.length / 128);
  assert.ok(left.keypoints.length / 5 > 100, `${left.keypoints.length / 5} keypoints`);
  assert.deepEqual([left.width, left.height], [target.width, target.height]);
  for (let i = 0; i < left.keypoints.length; i += 5) {
    const [x = NaN, y = NaN, scale = NaN] = left.keypoints.subarray(i, i + 3);
    assert.ok(x >= -0.5 && x < target.width && y >= -0.5 && y < target.height && scale > 0);
  }
  const found = await match(left, right);
  assert.equal(found.matches.length / 4, found.pairs.length / 2);
  for (let i = 0; i < found.pairs.length / 2; i++) {
    const [a = -1, b = -1] = found.pairs.subarray(2 * i, 2 * i + 2);
    const ends = [
      ...left.keypoints.subarray(5 * a, 5 * a + 2),
      ...right.keypoints.subarray(5 * b, 5 * b + 2),
    ];
    assert.deepEqual([...found.matches.subarray(4 * i, 4 * i + 4)], ends);
  }
  assert.deepEqual(await matchImages(target, reference), {
    ...found,
    target: left,
    reference: right,
  });
  assert.deepEqual(await matchImages(target, reference, { worker: false }), {
    ...found,
    target: left,
    reference: right,
  });
});

test("stitch without matches finds its own and says which", async () => {
  const own = await stitch(target, reference, { ...depths, guidedMatching: false });
  const { matches } = await matchImages(target, reference);
  assert.deepEqual(own.matches, matches);
  assert.equal(own.inliers.length, matches.length / 4);
  assert.ok((own.times.detect ?? 0) > 0 && (own.times.match ?? -1) >= 0);
  const given = await stitch(target, reference, { ...depths, matches });
  assert.deepEqual(given.mosaic, own.mosaic);
  assert.deepEqual(given.matches, matches);
  assert.equal(given.times.detect, undefined);
});

test("the geometry of own matches is that of the given ones", async () => {
  const own = await stitch(target, reference, depths);
  const given = await stitch(target, reference, inputs);
  assert.ok(own.quality.ssimMask > given.quality.ssimMask - 0.02);
  assert.ok(own.quality.coverage > given.quality.coverage - 0.02);
});

test("options reach the detector and the matcher", async () => {
  const all = await detect(target);
  const few = await detect(target, { maxKeypoints: 50 });
  assert.ok(few.descriptors.length <= 128 * 50);
  const coarse = await detect(target, { upsample: false, adaptiveContrast: false });
  assert.ok(coarse.descriptors.length < all.descriptors.length);
  const right = await detect(reference);
  const strict = await match(all, right, { matchRatio: 0.5 });
  assert.ok(strict.matches.length < (await match(all, right)).matches.length);
});

test("a photo without texture has no features, and no stitching without matches", async () => {
  const bare = { data: new Uint8ClampedArray(4 * 64 * 48).fill(128), width: 64, height: 48 };
  assert.equal((await detect(bare)).descriptors.length, 0);
  const error = await rejection(stitch(bare, bare));
  assert.equal(error.code, "too-few-matches");
  assert.deepEqual([error.details.matches, error.details.usable], [0, 0]);
});

test("what is wrong is named", async () => {
  const features = await detect(target);
  /** @type {any} */
  const any = null;
  for (const [call, code] of /** @type {const} */ ([
    [() => detect(any), "invalid-argument"],
    [() => detect(target, { maxKeypoints: 0 }), "invalid-argument"],
    [() => detect(target, { edgeThreshold: 0.5 }), "invalid-argument"],
    [() => detect({ ...target, width: 1 }), "size-mismatch"],
    [() => detect({ ...target, width: 1e5, height: 1e5 }), "too-large"],
    [() => match(features, any), "invalid-argument"],
    [() => match(features, features, { matchRatio: 0 }), "invalid-argument"],
    [() => match({ ...features, keypoints: new Float32Array(5) }, features), "size-mismatch"],
    [() => match({ ...features, descriptors: new Uint8Array(129) }, features), "size-mismatch"],
  ])) {
    const error = await rejection(call());
    assert.equal(error.code, code, error.message);
  }
});

test("cancel stops detecting and matching", async () => {
  for (const stage of ["detect", "match"]) {
    const controller = new AbortController();
    const error = await rejection(
      matchImages(target, reference, {
        signal: controller.signal,
        onProgress: (progress) => progress.stage === stage && controller.abort(),
      }),
    );
    assert.equal(error.code, "aborted");
    assert.equal(error.name, "AbortError");
  }
});
