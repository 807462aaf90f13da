// The evaluation of sets of photos: cameras, where pixels land, seams, a photo that is left out; and the sheet.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdir, mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { stitchMany } from "depthstitch";
import { decodeImage } from "../../dist/codecs.js";
import { visibleSteps } from "../../dist/eval/appearance.js";
import { cameraErrors } from "../../dist/eval/many/cameras.js";
import { landingErrors } from "../../dist/eval/many/landing.js";
import { dispensable } from "../../dist/eval/many/left-out.js";
import { median, percentile } from "../../dist/eval/statistics.js";
import { rejection } from "./sample.mjs";
import { SET, sampleSet } from "./sample-set.mjs";

const MAIN = fileURLToPath(new URL("../../dist/eval/main.js", import.meta.url));

/** @type {string} */
let folder;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-eval-many-"));
});
after(() => rm(folder, { recursive: true, force: true }));

/** @param {string[]} args */
const run = (...args) => spawnSync(process.execPath, [MAIN, ...args], { encoding: "utf8" });

test("a rendered set: cameras, landing, seams and what is left out are measured, and drawn", async () => {
  const [json, sheet] = [join(folder, "rows.json"), join(folder, "sheet.png")];
  const { status, stdout, stderr } = run(
    ...["--many", SET, "--leave-out", "--json", json, "--sheet", sheet],
  );
  assert.equal(status, 0, stderr);
  /** @type {import("../../dist/eval/evaluate.js").Row[]} */
  const [row] = JSON.parse(await readFile(json, "utf8"));
  assert.ok(row);
  assert.deepEqual([row.mode, row.photos_used, row.photos_missing], ["many", 4, 0]);
  // About twice what is measured.
  assert.ok((row.rotation_error ?? NaN) < 0.02, `rotation ${row.rotation_error}`);
  assert.ok((row.direction_error ?? NaN) < 0.3, `direction ${row.direction_error}`);
  assert.ok((row.focal_error ?? NaN) < 0.1, `focal ${row.focal_error}`);
  assert.ok((row.landing_shared?.[0] ?? NaN) < 0.6, `landing ${row.landing_shared}`);
  assert.ok((row.landing_alone?.[0] ?? NaN) < 2.5, `landing ${row.landing_alone}`);
  assert.ok((row.all_steps ?? NaN) < 0.07, `steps ${row.all_steps}`);
  assert.ok((row.all_steps ?? NaN) < (row.all_steps_elsewhere ?? NaN), "the seams avoid edges");
  assert.ok((row.all_broken ?? NaN) < 0.02, `broken ${row.all_broken}`);
  // Part of the photo is outside of all others.
  assert.ok((row.left_out_shown ?? NaN) > 0.5 && (row.left_out_shown ?? NaN) < 0.8);
  assert.ok((row.left_out_shift?.[0] ?? NaN) < 0.4, `left out ${row.left_out_shift}`);
  assert.ok((row.left_out_ssim ?? NaN) > 0.75, `left out ${row.left_out_ssim}`);
  assert.match(stdout, /^case .* used .* steps .* left_ssim .* ms$/m);
  assert.match(stdout, /cameras plane/);
  const drawn = await decodeImage(await readFile(sheet));
  assert.ok(drawn.width > 1280 && drawn.height > 440);
});

test("known cameras and depth are taken as they are", async () => {
  const { cameras, depths, known } = await sampleSet();
  const result = await stitchMany(known, { worker: false, outputDepth: true });
  assert.deepEqual(
    result.photos.map(({ camera }) => camera),
    known.map(({ camera }) => camera),
  );
  assert.deepEqual(result.warnings, []);
  // The files have whole millimetres.
  const { inside, outside } = landingErrors(result, cameras, depths);
  assert.ok((inside?.[0] ?? NaN) < 0.05 && (outside?.[0] ?? NaN) < 0.05, `${inside}, ${outside}`);

  const [first, ...others] = known;
  assert.ok(first);
  const short = { ...first.camera, rotation: new Float64Array(8) };
  for (const [bad, code] of /** @type {const} */ ([
    [{ ...first, camera: null }, "invalid-argument"],
    [{ ...first, focalLength: null }, "invalid-argument"],
    [{ ...first, camera: short }, "size-mismatch"],
    [{ ...first, camera: /** @type {any} */ ({}) }, "invalid-argument"],
    [{ ...first, depth: /** @type {any} */ ({ kind: "far" }) }, "invalid-argument"],
  ])) {
    const error = await rejection(stitchMany([bad, ...others], { worker: false }));
    assert.equal(error.code, code, error.message);
  }
});

test("sets that cannot be read are rows that say so", async () => {
  const sets = {
    torn: "{",
    nameless: "{}",
    "one-depth": `{ "photos": ["a.jpg", "b.jpg"], "depth": { "files": ["a.png"] } }`,
    "no-kind": `{ "photos": ["a.jpg"], "depth": { "files": ["a.png"], "kind": "far" } }`,
    endless: `{ "photos": ["a.jpg"], "truth": { "cameras": [{ "K": [1e999], "R": [], "t": [] }] } }`,
    turned: `{ "photos": ["a.jpg"], "truth": { "cameras": [{ "K": [1], "R": [], "t": [] }] } }`,
  };
  for (const [name, text] of Object.entries(sets)) {
    await mkdir(join(folder, "bad", name), { recursive: true });
    await writeFile(join(folder, "bad", name, "case.json"), text);
  }
  const { status, stdout } = run("--many", join(folder, "bad"));
  assert.equal(status, 1);
  for (const name of Object.keys(sets))
    assert.match(stdout, new RegExp(`^${name} .* FAILED invalid-case$`, "m"));
  assert.equal(run("--many", join(folder, "bad"), "--check").status, 1);
  assert.equal(run("--many", join(folder, "none")).status, 2);
});

const IDENTITY = [1, 0, 0, 0, 1, 0, 0, 0, 1];
/** About the upright axis. @param {number} degrees */
const yaw = (degrees) => {
  const [c, s] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  return [c, 0, s, 0, 1, 0, -s, 0, c];
};
const K = [100, 0, 50, 0, 100, 40, 0, 0, 1];

/** A report of a camera. @type {(R: number[], t: number[], focalLength: number) => import("depthstitch").PhotoReport} */
const report = (R, t, focalLength) => ({
  used: true,
  code: "used",
  camera: { rotation: Float64Array.from(R), translation: Float64Array.from(t) },
  focalLength,
  error: 0,
  gains: [1, 1, 1],
  extent: null,
});

test("camera errors: nothing for another world and unit, and by as much as they are off", () => {
  const truth = [
    { K, R: IDENTITY, t: [0, 0, 0] },
    { K, R: yaw(10), t: [1, 0, 0] },
  ];
  // The same cameras in a world that is turned by 90° and half as large.
  const turned = [report(yaw(90), [0, 0, 0], 100), report(yaw(100), [0.5, 0, 0], 100)];
  const none = cameraErrors(turned, truth);
  assert.ok(none && none.rotation < 1e-5 && none.direction < 1e-5 && none.focal === 0);
  const off = cameraErrors(
    [report(IDENTITY, [0, 0, 0], 103), report(yaw(12), [1, 0, 0.1], 103)],
    truth,
  );
  assert.ok(off && Math.abs(off.rotation - 2) < 1e-6, `${off?.rotation}`);
  assert.ok(Math.abs(off.direction - (Math.atan(0.1) * 180) / Math.PI) < 1e-6, `${off.direction}`);
  assert.ok(Math.abs(off.focal - 3) < 1e-9);
  assert.equal(cameraErrors([report(IDENTITY, [0, 0, 0], 100)], truth), null);
});

test("landing errors: apart for what another photo sees, and by what the map is off", () => {
  // Depth 2 m all over, the second camera 0.4 m to the right: it sees everything 20 px farther left.
  const cameras = [
    { K, R: IDENTITY, t: [0, 0, 0] },
    { K, R: IDENTITY, t: [-0.4, 0, 0] },
  ];
  const depth = /** @type {import("depthstitch").DepthInput} */ ({
    data: new Float32Array(8000).fill(2),
    width: 100,
    height: 80,
    kind: "metric",
  });
  // 3 px more than that where nobody else looks: the outer 20 columns.
  const data = new Float32Array(8000).map((_, i) => (i % 100 < 20 ? 0.5 + 3 / 40 : 0.5));
  const inverseDepth = { data, width: 100, height: 80, kind: /** @type {const} */ ("inverse") };
  const forward = { h: Float64Array.from(IDENTITY), e: Float64Array.of(-40, 0, 0) };
  const photos = [
    { ...report(IDENTITY, [0, 0, 0], 100), forward, inverseDepth },
    report(IDENTITY, [-0.4, 0, 0], 100),
  ];
  const found = landingErrors({ photos, reference: 1, distortion: 0 }, cameras, [depth, depth]);
  assert.ok((found.inside?.[0] ?? NaN) < 1e-4, `${found.inside}`);
  assert.ok(Math.abs((found.outside?.[0] ?? NaN) - 3) < 1e-4, `${found.outside}`);
});

test("landing errors: a lens that is taken to distort and does not puts pixels beside their place", () => {
  const [k, width, height, frame] = [0.3, 100, 80, { width: 90, height: 72 }];
  const camera = { K, R: IDENTITY, t: [0, 0, 0] };
  const depth = /** @type {import("depthstitch").DepthInput} */ ({
    data: new Float32Array(width * height).fill(2),
    width,
    height,
    kind: "metric",
  });
  const undistorted = { data: new Uint8ClampedArray(4 * 90 * 72), ...frame };
  const forward = { h: Float64Array.from(IDENTITY), e: new Float64Array(3) };
  const photo = { ...report(IDENTITY, [0, 0, 0], 100), forward, undistorted };
  const result = { photos: [photo, photo], reference: 1, distortion: k };
  const { inside, outside } = landingErrors(result, [camera, camera], [depth, depth]);
  // Towards the middle, by as much as the distortion that is taken away.
  const moved = [];
  for (let y = 0; y < height; y += 4) {
    for (let x = 0; x < width; x += 4) {
      const radius = Math.hypot(x - 49.5, y - 39.5);
      moved.push(radius - radius / (1 + (k * radius ** 2) / (width ** 2 + height ** 2)));
    }
  }
  assert.ok(Math.abs((inside?.[0] ?? NaN) - median(moved)) < 1e-9, `${inside}`);
  assert.ok(Math.abs((inside?.[1] ?? NaN) - percentile(moved, 90)) < 1e-9, `${inside}`);
  assert.equal(outside, null);
});

test("the photo to leave out is one without which the others hang together", () => {
  /** @type {(a: number, b: number, inliers: number) => import("depthstitch").PhotoPair} */
  const pair = (a, b, inliers) => ({ photos: [a, b], matches: inliers, inliers, linked: true });
  const four = [0, 1, 2, 3].map(() => report(IDENTITY, [0, 0, 0], 1));
  /** @param {import("depthstitch").PhotoPair[]} pairs */
  const chosen = (pairs) =>
    dispensable(
      /** @type {import("depthstitch").StitchManyResult} */ ({ photos: four, pairs, reference: 1 }),
    );
  // A chain around the reference: only its ends can go, and the one with more matches does.
  assert.equal(chosen([pair(0, 1, 50), pair(1, 2, 90), pair(2, 3, 60)]), 3);
  assert.equal(chosen([pair(0, 1, 50), pair(1, 2, 90), pair(2, 3, 60), pair(1, 3, 40)]), 2);
});

test("steps show along every seam, whichever photos meet there", async () => {
  const [width, height] = [120, 60];
  const columns = (/** @type {number[]} */ values) =>
    new Uint8Array(width * height).map((_, i) => values[Math.floor((i % width) / 40)] ?? 0);
  const labels = { data: columns([4, 9, 2]), width, height };
  /** @param {number[]} gray */
  const steps = async (gray) => {
    const levels = columns(gray);
    const data = new Uint8ClampedArray(4 * width * height).map((_, i) =>
      i % 4 === 3 ? 255 : (levels[i >> 2] ?? 0),
    );
    return (await visibleSteps({ mosaic: { data, width, height }, labels })).seam;
  };
  assert.equal(await steps([90, 90, 90]), 0);
  assert.equal(await steps([90, 130, 130]), 0.5);
  assert.equal(await steps([90, 130, 90]), 1);
});

test("a set is read with its cameras and depth", async () => {
  const { photos, cameras, depths } = await sampleSet();
  assert.deepEqual([photos.length, cameras?.length, depths?.length], [4, 4, 4]);
  assert.deepEqual([depths?.[0]?.width, depths?.[0]?.kind], [photos[0]?.width, "metric"]);
});
