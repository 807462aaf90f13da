// `stitchMany` and the command line with three photos: windows of one rendered photo, as of a wall.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { crop, stitchMany } from "depthstitch";
import { decodeImage, encodePng } from "depthstitch/codecs";
import { rejection, sample } from "./sample.mjs";

const MAIN = fileURLToPath(new URL("../../dist/cli/main.js", import.meta.url));

/** Three overlapping parts of one picture, the middle one second, and noise. */
async function photos() {
  const { target } = await sample();
  const width = Math.round(0.6 * target.width);
  const shift = Math.floor((target.width - width) / 2);
  const part = (/** @type {number} */ x) => crop(target, { x, y: 0, width, height: target.height });
  const noise = new Uint8ClampedArray(4 * width * target.height);
  let state = 1;
  for (let i = 0; i < noise.length; i++) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    noise[i] = state >>> 24;
  }
  const strange = { data: noise, width, height: target.height };
  return { whole: target, shift, all: [part(0), part(shift), strange, part(2 * shift)] };
}

/** @type {string} */
let folder;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-many-"));
});
after(() => rm(folder, { recursive: true, force: true }));

test("parts of a picture become that picture, and what does not belong is left out", async () => {
  const { whole, shift, all } = await photos();
  /** @type {Set<string>} */
  const stages = new Set();
  const [seen, pairs] = [new Set(), new Set()];
  const result = await stitchMany(all, {
    worker: false,
    onProgress: ({ stage, fraction, photo, pair }) => {
      assert.ok(fraction >= 0 && fraction <= 1);
      stages.add(stage);
      if (stage === "detect") seen.add(photo);
      if (stage === "match" && pair) pairs.add(pair.join());
    },
  });
  assert.deepEqual(
    result.photos.map(({ code }) => code),
    ["used", "used", "no-matches", "used"],
  );
  assert.equal(result.photos[2]?.extent, null);
  assert.equal(result.reference, 1);
  assert.equal(result.projection, "plane");
  assert.ok(Math.abs(result.mosaic.width - whole.width) <= 2, `${result.mosaic.width}`);
  assert.ok(Math.abs(result.mosaic.height - whole.height) <= 2, `${result.mosaic.height}`);
  assert.ok(Math.abs(result.offset.x - shift) <= 1, `${result.offset.x}`);
  for (const label of [1, 2, 4]) assert.ok(result.labels.data.includes(label), `${label}`);
  assert.ok(!result.labels.data.includes(3));
  assert.equal(result.pairs.length, 6);
  assert.deepEqual([...seen], [0, 1, 2, 3]);
  assert.deepEqual([...pairs].slice(0, 6), ["0,1", "0,2", "0,3", "1,2", "1,3", "2,3"]);
  for (const stage of ["detect", "match", "estimate", "warp", "blend"])
    assert.ok(stages.has(stage));
  assert.ok(Object.values(result.times).every((ms) => ms >= 0));
});

test("workers give the same bytes; the photos stay the caller's", async () => {
  const { all } = await photos();
  const { times: stages, ...here } = await stitchMany(all, { worker: false });
  for (const workers of /** @type {const} */ ([1, 2, 4])) {
    const seen = new Set();
    /** @param {import("depthstitch").Progress} progress */
    const onProgress = ({ stage, photo }) => void (stage === "detect" && seen.add(photo));
    const { times, ...there } = await stitchMany(all, { workers, onProgress });
    assert.deepEqual(there, here);
    assert.deepEqual(Object.keys(times), Object.keys(stages));
    assert.deepEqual([...seen].sort(), [0, 1, 2, 3]);
  }
  assert.ok(all.every(({ data }) => data.length > 0));
});

test("a photo that is refused is named however many workers there are", async () => {
  const { all } = await photos();
  const empty = all.map((photo, i) =>
    i === 2 ? { ...photo, data: new Uint8ClampedArray(photo.data.length) } : photo,
  );
  const [one, two] = [
    await rejection(stitchMany(empty, { workers: 1 })),
    await rejection(stitchMany(empty, { workers: 2 })),
  ];
  assert.match(one.message, /photos\[2\]/);
  assert.equal(two.message, one.message);
});

test("bad input is refused by number and name", async () => {
  const { all } = await photos();
  const [photo] = all;
  assert.ok(photo);
  for (const count of [0, 1, 31]) {
    const error = await rejection(stitchMany(Array(count).fill(photo)));
    assert.equal(error.code, "invalid-argument");
    assert.equal(error.details.value, count);
  }
  const skewed = {
    rotation: new Float64Array([1, 1, 0, 0, 1, 0, 0, 0, 1]),
    translation: new Float64Array(3),
  };
  const short = await rejection(stitchMany([photo, { ...photo, data: new Uint8Array(4) }]));
  assert.equal(short.code, "size-mismatch");
  assert.match(short.message, /^photos\[1\]: photo has 4 values/);
  assert.equal(short.details.photo, 1);
  /** @type {[unknown, object, RegExp][]} */
  const cases = [
    ["photos", {}, /photos must be an array/],
    [[, photo], {}, /photos\[0\] must be an object, got undefined/],
    [[photo, null], {}, /photos\[1\] must be an object/],
    [[photo, { ...photo, focalLength: "long" }], {}, /photos\[1\]\.focalLength must be a number/],
    [[photo, { ...photo, focalLength: -1 }], {}, /^photos\[1\]: focalLength .*-1$/],
    [[photo, { ...photo, width: NaN }], {}, /^photos\[1\]: .*width/],
    [[photo, { ...photo, focalLength: 300, camera: skewed }], {}, /^photos\[1\]: rotation/],
    [all, { reference: 4 }, /reference/],
    [all, { reference: 0.5 }, /reference/],
    [all, { seamless: true }, /seamless/],
  ];
  for (const [given, options, message] of cases) {
    const error = await rejection(stitchMany(/** @type {any} */ (given), options));
    assert.equal(error.code, "invalid-argument", error.message);
    assert.match(error.message, message);
  }
  assert.equal((await rejection(stitchMany(all, { maxBytes: 1e5 }))).code, "too-large");
  assert.equal((await rejection(stitchMany(all, { reference: 2 }))).code, "no-consensus");
});

test("a call can be aborted", async () => {
  const { all } = await photos();
  const controller = new AbortController();
  const error = await rejection(
    stitchMany(all, { signal: controller.signal, onProgress: () => controller.abort() }),
  );
  assert.equal(error.code, "aborted");
});

test("the command line stitches any number of photos and lists them in the report", async () => {
  const { all } = await photos();
  const files = await Promise.all(
    all.map(async (photo, i) => {
      const file = join(folder, `${i}.png`);
      await writeFile(file, await encodePng(photo));
      return file;
    }),
  );
  const [mosaic, report] = ["m.png", "r.json"].map((name) => join(folder, name));
  assert.ok(mosaic && report);
  const outputs = ["-o", mosaic, "--report", report];
  const run = (/** @type {string[]} */ ...args) =>
    spawnSync(process.execPath, [MAIN, ...args], { encoding: "utf8" });
  const { status, stdout, stderr } = run(...files, ...outputs);
  assert.equal(status, 0, stderr);
  assert.match(stdout, /: \d+×\d+, 3 of 4 photos\n$/);
  assert.match(stderr, /^depthstitch: warning: no-matches: .*2\.png was left out/);
  const json = JSON.parse(await readFile(report, "utf8"));
  const listed = json.photos.map(
    (/** @type {{ file: string, used: boolean, code: string }} */ { file, used, code }) => ({
      file,
      used,
      code,
    }),
  );
  const codes = ["used", "used", "no-matches", "used"];
  assert.deepEqual(
    listed,
    codes.map((code, i) => ({ file: files[i], used: code === "used", code })),
  );
  assert.equal(json.reference, files[1]);
  const { width, height } = await decodeImage(await readFile(mosaic));
  assert.deepEqual({ width, height, offset: json.canvas.offset }, json.canvas);

  const chosen = run(...files, "--reference", files[3] ?? "", ...outputs, "-q");
  assert.equal(chosen.status, 0, chosen.stderr);
  assert.equal(JSON.parse(await readFile(report, "utf8")).reference, files[3]);
  for (const extra of [
    ["--warped", "w.png"],
    ["--matches", "m.csv"],
    ["--reference", "x.png"],
  ]) {
    const refused = run(...files, ...extra);
    assert.equal(refused.status, 2);
    assert.match(refused.stderr, new RegExp(`usage: ${extra[0]}`));
  }
});
