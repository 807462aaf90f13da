// What stitch gives, and that its stages called one by one give the same.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import {
  align,
  blend,
  crop,
  defaultOptions,
  estimate,
  fill,
  measure,
  stitch,
  version,
  warp,
} from "depthstitch";
import { sample } from "./sample.mjs";

test("stitch returns everything that is promised, in sizes that fit", async () => {
  const { target, reference, inputs } = await sample();
  const result = await stitch(target, reference, inputs);
  const { width, height } = result.warped;
  const pixels = width * height;
  assert.ok(width >= reference.width && height >= reference.height);
  assert.ok(result.warped.data instanceof Uint8ClampedArray);
  assert.equal(result.warped.data.length, 4 * pixels);
  const { inner, bounds } = result.crop;
  assert.ok(inner && bounds && inner.width <= bounds.width && bounds.width <= width);
  assert.ok(result.seam.data.every((value) => value <= 3));
  assert.ok(result.gains.every((gain) => gain > 0.5 && gain < 2));
  for (const mask of [result.footprint, result.voidMask]) {
    assert.ok(mask.data instanceof Uint8Array);
    assert.deepEqual([mask.width, mask.height, mask.data.length], [width, height, pixels]);
    assert.ok(mask.data.every((value) => value === 0 || value === 255));
  }
  assert.deepEqual([result.mosaic.width, result.mosaic.height], [width, height]);
  assert.ok(result.offset.x >= 0 && result.offset.x + reference.width <= width);
  assert.ok(result.offset.y >= 0 && result.offset.y + reference.height <= height);
  assert.deepEqual([result.forward.h.length, result.forward.e.length], [9, 3]);
  assert.deepEqual([result.reverse.h.length, result.reverse.e.length], [9, 3]);
  assert.equal(result.inliers.length, inputs.matches.length / 4);
  assert.equal(
    result.inliers.reduce((sum, inlier) => sum + inlier, 0),
    result.report.inliers,
  );
  assert.match(result.report.model, /^(depth|calibrated)$/);
  assert.deepEqual(Object.keys(result.times).sort(), [
    "blend",
    "estimate",
    "fill",
    "input",
    "measure",
    "refine",
    "warp",
  ]);
  assert.ok(Object.values(result.times).every((ms) => ms >= 0));
});

test("the photos agree where the sample's geometry says they should", async () => {
  const { target, reference, inputs } = await sample();
  const { quality, mosaic, offset } = await stitch(target, reference, inputs);
  assert.ok(quality.coverage > 0.4 && quality.coverage <= 1, `coverage ${quality.coverage}`);
  assert.ok(quality.ssimMask > 0.7, `SSIM ${quality.ssimMask}`);
  const { matches } = inputs;
  const flat = await stitch(target, reference, { matches, withoutDepth: "homography" });
  assert.equal(flat.report.model, "homography");
  const own = await stitch(target, reference, { matches, refinement: "none", outputDepth: true });
  assert.equal(own.report.model, "two-view");
  assert.ok(own.quality.ssimMask > flat.quality.ssimMask + 0.05, `${own.quality.ssimMask}`);
  assert.equal(own.targetDepth?.data.length, target.width * target.height);
  assert.ok(
    quality.ssimMask > flat.quality.ssimMask + 0.1,
    `SSIM ${flat.quality.ssimMask} without depth`,
  );
  // The reference is never moved: it is opaque in the mosaic, all of it.
  for (const [x, y] of [
    [0, 0],
    [reference.width - 1, reference.height - 1],
  ]) {
    const pixel = (offset.y + Number(y)) * mosaic.width + offset.x + Number(x);
    assert.equal(mosaic.data[4 * pixel + 3], 255);
  }
});

test("the same input gives the same bytes, in a worker and without", async () => {
  const { target, reference, inputs } = await sample();
  const { times: _, ...first } = await stitch(target, reference, inputs);
  const { times: __, ...second } = await stitch(target, reference, inputs);
  const { times: ___, ...here } = await stitch(target, reference, { ...inputs, worker: false });
  assert.deepEqual(second, first);
  assert.deepEqual(here, first);
});

/** @type {("given" | "found")[]} */
const depths = ["given", "found"];
for (const depth of depths)
  test(`the halves give the bytes of stitch, depth being ${depth}`, async () => {
    const { target, reference, inputs } = await sample();
    const options = depth === "given" ? inputs : { matches: inputs.matches };
    const whole = await stitch(target, reference, { ...options, fill: "none" });
    const { targetDepth, referenceDepth, voidDistance, reliable, ...geometry } = await align(
      target,
      reference,
      options,
    );
    const maps = { targetDepth, referenceDepth };
    const warped = await warp(target, reference, geometry, { ...maps, voidDistance });
    const { mosaic, seam, gains } = await blend(warped, reference, { reliable });
    assert.deepEqual(geometry.forward, whole.forward);
    assert.deepEqual(warped.warped, whole.warped);
    assert.deepEqual(mosaic, whole.mosaic);
    assert.deepEqual(seam, whole.seam);
    assert.deepEqual(gains, whole.gains);
    const rect = whole.crop.inner;
    assert.ok(rect);
    const kept = crop(mosaic, rect);
    assert.deepEqual([kept.width, kept.height], [rect.width, rect.height]);
    assert.ok(kept.data.every((value, i) => i % 4 < 3 || value === 255));
    assert.throws(() => crop(mosaic, { ...rect, width: mosaic.width + 1 }), {
      code: "invalid-argument",
    });
  });

test("stages called one by one give the bytes of stitch in the published mode", async () => {
  const { target, reference, inputs } = await sample();
  const mode = "paper";
  const whole = await stitch(target, reference, { ...inputs, mode });
  const { width, height } = target;
  const geometry = await estimate(
    {
      targetSize: { width, height },
      referenceSize: { width: reference.width, height: reference.height },
      ...inputs,
    },
    { mode },
  );
  const { targetDepth, referenceDepth } = inputs;
  const warped = await warp(target, reference, geometry, { targetDepth, referenceDepth, mode });
  const { mosaic, voidMask } = await blend(warped, reference, { mode });
  const filled = await fill(mosaic, voidMask, { mode });
  /** @type {number[]} */
  const fractions = [];
  const quality = await measure(warped, reference, {
    onProgress: ({ fraction }) => void fractions.push(fraction),
  });

  assert.deepEqual(fractions, [0, 1]);
  assert.deepEqual(geometry.forward, whole.forward);
  assert.deepEqual(geometry.reverse, whole.reverse);
  assert.deepEqual(geometry.inliers, whole.inliers);
  assert.deepEqual(warped.warped, whole.warped);
  assert.deepEqual(warped.footprint, whole.footprint);
  assert.deepEqual(warped.offset, whole.offset);
  assert.deepEqual(voidMask, whole.voidMask);
  assert.deepEqual(filled, whole.mosaic);
  assert.deepEqual(quality, whole.quality);
});

test("fill 'none' leaves the voids empty", async () => {
  const { target, reference, inputs } = await sample();
  const { mosaic, voidMask } = await stitch(target, reference, { ...inputs, fill: "none" });
  voidMask.data.forEach((value, pixel) => {
    if (value === 255) assert.equal(mosaic.data[4 * pixel + 3], 0);
  });
});

test("the default options spelled out change nothing", async () => {
  const { target, reference, inputs } = await sample();
  const options = await defaultOptions();
  const { times: _, ...plain } = await stitch(target, reference, inputs);
  const { times: __, ...spelled } = await stitch(target, reference, { ...inputs, ...options });
  assert.deepEqual(spelled, plain);
});

test("default options are a fresh object each time", async () => {
  const options = await defaultOptions();
  options.seed = 7;
  assert.notEqual((await defaultOptions()).seed, 7);
});

test("an option left undefined keeps its default", async () => {
  const { target, reference, inputs } = await sample();
  const { times: _, ...plain } = await stitch(target, reference, inputs);
  const { times: __, ...same } = await stitch(target, reference, { ...inputs, seed: undefined });
  assert.deepEqual(same, plain);
});

test("the core and the package have one version", async () => {
  const file = new URL("../../package.json", import.meta.url);
  assert.equal(await version(), JSON.parse(await readFile(file, "utf8")).version);
});

test("fillMaxWidth says which voids are too wide to be filled", async () => {
  const { target, reference, inputs } = await sample();
  const empty = async (/** @type {number} */ fillMaxWidth) => {
    const { mosaic, voidMask } = await stitch(target, reference, { ...inputs, fillMaxWidth });
    return voidMask.data.filter((value, i) => value === 255 && mosaic.data[4 * i + 3] === 0).length;
  };
  const [narrow, all] = [await empty(0.01), await empty(100)];
  assert.equal(all, 0);
  assert.ok(narrow > 0, "the widest stay empty");
});

test("two photos are shown on a cylinder if asked for, and compared there", async () => {
  const { target, reference, inputs } = await sample();
  const plane = await stitch(target, reference, inputs);
  assert.equal(plane.projection, "plane");
  assert.ok(!("projectedReference" in plane));
  const result = await stitch(target, reference, { ...inputs, projection: "cylinder" });
  assert.equal(result.projection, "cylinder");
  const shown = result.projectedReference;
  assert.ok(shown);
  assert.ok(result.offset.x + shown.width <= result.mosaic.width);
  assert.ok(result.offset.y + shown.height <= result.mosaic.height);
  assert.ok(shown.data.some((value, i) => i % 4 === 3 && value === 0));
  const quality = await measure(result, shown, { gains: result.gains });
  assert.deepEqual(quality, result.quality);
  assert.ok(quality.psnrMask > plane.quality.psnrMask - 1, `${quality.psnrMask} dB`);
  assert.ok(Math.abs(quality.coverage - plane.quality.coverage) < 0.1, `${quality.coverage}`);
});
