// The command line with three photos or more of which depth or cameras are known.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { SET } from "./sample-set.mjs";

const MAIN = fileURLToPath(new URL("../../dist/cli/main.js", import.meta.url));

/** @type {string} */
let folder;
/** @type {{ photos: string[], depth: { files: string[], scale: number }, truth: { cameras: { K: number[], R: number[], t: number[] }[] } }} */
let set;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-given-"));
  set = JSON.parse(await readFile(join(SET, "case.json"), "utf8"));
});
after(() => rm(folder, { recursive: true, force: true }));

/** @param {string[]} args */
const run = (...args) =>
  spawnSync(process.execPath, [MAIN, ...args, "-o", join(folder, "m.png")], { encoding: "utf8" });
const photos = () => set.photos.map((file) => join(SET, file));
const format = () => [
  ...["--depth-kind", "metric", "--depth-scale", String(set.depth.scale), "--invalid", "0"],
];
/** @param {(string | undefined)[]} files */
const depth = (files) => files.flatMap((file) => ["--depth", file ? join(SET, file) : "none"]);
/** Writes a file with cameras. @param {unknown} value */
const cameras = async (value) => {
  const path = join(folder, "cameras.json");
  await writeFile(path, JSON.stringify(value));
  return path;
};

test("cameras and depth that are given are taken, and cameras are read from a report", async () => {
  const truth = set.truth.cameras.map(({ K, R, t }, i) => ({
    file: set.photos[i],
    focalLength: K[0],
    camera: { rotation: R, translation: t },
  }));
  const report = join(folder, "r.json");
  const path = await cameras({ photos: truth });
  const given = ["--cameras", path, ...depth(set.depth.files), ...format()];
  const first = run(...photos(), ...given, "--report", report);
  assert.equal(first.status, 0, first.stderr);
  assert.equal(first.stderr, "");
  const json = JSON.parse(await readFile(report, "utf8"));
  assert.equal(json.geometry, "cameras");
  for (const [i, { camera, focalLength, error }] of json.photos.entries()) {
    assert.deepEqual(
      { camera, focalLength },
      { camera: truth[i]?.camera, focalLength: truth[i]?.focalLength },
    );
    assert.ok(error < 1, `photo ${i}: ${error}`);
  }
  // The report again, and a photo without a map.
  const mosaic = await readFile(join(folder, "m.png"));
  const again = run(...photos(), "--cameras", report, ...depth(set.depth.files), ...format());
  assert.equal(again.status, 0, again.stderr);
  assert.deepEqual(await readFile(join(folder, "m.png")), mosaic);
  const without = run(...photos(), ...depth([undefined, ...set.depth.files.slice(1)]), ...format());
  assert.equal(without.status, 0, without.stderr);
  assert.notDeepEqual(await readFile(join(folder, "m.png")), mosaic);
});

test("what does not fit the photos is refused in one line", async () => {
  const files = photos();
  const some = set.photos.map((file) => ({ file, focalLength: 300, camera: null }));
  const whole = { rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1], translation: [0, 0, 0] };
  /** @type {[string[], number, RegExp][]} */
  const refused = [
    [[...files, ...depth(set.depth.files.slice(1))], 2, /usage: --depth must be given once for/],
    [[...files, "--depth-scale", "2"], 2, /usage: --depth-scale needs --depth/],
    [[...files, "--target-depth", "x.png"], 2, /usage: --target-depth is for two photos/],
    [[...files.slice(0, 2), ...depth(["x.png"])], 2, /usage: --depth needs three photos/],
    [[...files.slice(0, 2), "--cameras", "x.json"], 2, /usage: --cameras needs three photos/],
    [[...files, "--cameras", join(folder, "no.json")], 1, /not-found: .*no\.json/],
    [
      [
        ...files,
        "--cameras",
        await cameras({ photos: some }),
        "--report",
        join(folder, "cameras.json"),
      ],
      2,
      /usage: cannot write to .*: it is an input/,
    ],
  ];
  for (const [args, status, line] of refused) {
    const done = run(...args);
    assert.equal(done.status, status, done.stderr);
    assert.match(done.stderr, line);
    assert.equal(done.stderr.trim().split("\n").length, 1);
  }
  /** @type {[unknown, RegExp][]} */
  const damaged = [
    [{ photos: some }, /"photos\[0\]" has no camera/],
    [{ photos: some.slice(1) }, /must be a list of 4/],
    [{ photos: [...some].reverse() }, /"photos\[0\]" is of .*, the photo at this place is/],
    [{ photos: some.map((photo) => ({ ...photo, camera: {} })) }, /"rotation" must be 9 numbers/],
    [
      { photos: some.map(({ file }) => ({ file, camera: whole })) },
      /"focalLength" must be a number/,
    ],
    [[], /must be a list of 4/],
  ];
  for (const [value, line] of damaged) {
    const done = run(...files, "--cameras", await cameras(value));
    assert.equal(done.status, 1, done.stderr);
    assert.match(done.stderr, /^depthstitch: invalid-case: .*cameras\.json: /);
    assert.match(done.stderr, line);
  }
  // Focal lengths are in pixels.
  const sized = set.photos.map((file) => ({ file, focalLength: 300, camera: whole, width: 320 }));
  for (const [side, value] of /** @type {const} */ ([
    ["width", 640],
    ["height", "240"],
  ])) {
    const path = await cameras({
      photos: sized.map((photo, i) => (i === 2 ? { ...photo, [side]: value } : photo)),
    });
    const done = run(...files, "--cameras", path);
    assert.equal(done.status, 1, done.stderr);
    assert.match(
      done.stderr,
      new RegExp(`"photos\\[2\\]": "${side}" is ${JSON.stringify(value)}, that of .* is \\d+\n$`),
    );
  }
  // JSON has no infinity, but what is read as one.
  const endless = await cameras({ photos: some, distortion: 12345 });
  await writeFile(endless, (await readFile(endless, "utf8")).replace("12345", "1e999"));
  assert.match(run(...files, "--cameras", endless).stderr, /"distortion" must be a number/);
});
