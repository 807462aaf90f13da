// Colour profiles and camera data, from file to file, and what camera data say of the lens.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import {
  convertColours,
  decodeImage,
  encodeJpeg,
  encodePng,
  readFocalLength,
  readMetadata,
} from "depthstitch/codecs";
import { matchColours } from "../../dist/cli/colours.js";
import { rejection, sample } from "./sample.mjs";

const MAIN = fileURLToPath(new URL("../../dist/cli/main.js", import.meta.url));

/** @type {string} */
let folder;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-colours-"));
});
after(() => rm(folder, { recursive: true, force: true }));

/**
 * An ICC profile of these primaries (XYZ of red, green and blue, D50), with a gamma of 2.2: header, tag table, tags.
 *
 * @param {number[][]} primaries
 */
function profile(primaries) {
  const white = [0.9642, 1, 0.8249];
  const xyz = (/** @type {number[]} */ [x = 0, y = 0, z = 0]) => {
    const tag = Buffer.alloc(20);
    tag.write("XYZ ", 0, "latin1");
    [x, y, z].forEach((v, i) => tag.writeInt32BE(Math.round(v * 65536), 8 + 4 * i));
    return tag;
  };
  const curve = Buffer.alloc(16);
  curve.write("curv", 0, "latin1");
  curve.writeUInt32BE(1, 8);
  curve.writeUInt16BE(Math.round(2.2 * 256), 12);
  /** @type {[string, Buffer][]} */
  const tags = [
    ["wtpt", xyz(white)],
    ...["rXYZ", "gXYZ", "bXYZ"].map(
      (name, i) => /** @type {[string, Buffer]} */ ([name, xyz(primaries[i] ?? [])]),
    ),
    ...["rTRC", "gTRC", "bTRC"].map((name) => /** @type {[string, Buffer]} */ ([name, curve])),
  ];
  const head = Buffer.alloc(128 + 4 + 12 * tags.length);
  const size = head.length + tags.reduce((sum, [, data]) => sum + data.length, 0);
  head.writeUInt32BE(size, 0);
  head.writeUInt32BE(0x02400000, 8);
  head.write("mntrRGB XYZ ", 12, "latin1");
  head.write("acsp", 36, "latin1");
  white.forEach((v, i) => head.writeInt32BE(Math.round(v * 65536), 68 + 4 * i));
  head.writeUInt32BE(tags.length, 128);
  let offset = head.length;
  tags.forEach(([name, data], i) => {
    head.write(name, 132 + 12 * i, "latin1");
    head.writeUInt32BE(offset, 136 + 12 * i);
    head.writeUInt32BE(data.length, 140 + 12 * i);
    offset += data.length;
  });
  return new Uint8Array(Buffer.concat([head, ...tags.map(([, data]) => data)]));
}

// Display P3 and Adobe RGB, but for the curve of the first.
const P3 = profile([
  [0.5151, 0.2412, -0.0011],
  [0.292, 0.6922, 0.0419],
  [0.1571, 0.0666, 0.7841],
]);
const ADOBE = profile([
  [0.6097, 0.3111, 0.0195],
  [0.2053, 0.6257, 0.0609],
  [0.1492, 0.0632, 0.7446],
]);

/** EXIF of one entry, the orientation, as a camera on its side writes it. */
const EXIF = Uint8Array.from(
  Buffer.from("49492a00080000000100120103000100000006000000" + "00000000", "hex"),
);

test("the encoders write a profile and camera data that the decoder finds", async () => {
  const { target } = await sample();
  const upright = EXIF.slice();
  upright[18] = 1;
  const metadata = { colourProfile: P3, exif: EXIF };
  for (const file of [await encodePng(target, metadata), await encodeJpeg(target, 90, metadata)]) {
    assert.deepEqual(await readMetadata(file), { colourProfile: P3, exif: upright });
    assert.equal((await decodeImage(file)).width, target.width);
  }
  const none = { colourProfile: null, exif: null };
  assert.deepEqual(await readMetadata(await encodePng(target)), none);
  for (const call of [
    () => encodePng(target, /** @type {any} */ (3)),
    () => encodePng(target, /** @type {any} */ ({ exif: "EXIF" })),
    () => convertColours(target, /** @type {any} */ ("p3"), null),
    () => readMetadata(/** @type {any} */ (1)),
  ]) {
    assert.equal((await rejection(call())).code, "invalid-argument");
  }
  const broken = await rejection(convertColours(target, Uint8Array.of(1, 2, 3), null));
  assert.equal(broken.code, "decode-failed");
});

/** @param {string[]} args */
function run(...args) {
  const { status, stderr } = spawnSync(process.execPath, [MAIN, ...args], { cwd: folder });
  assert.equal(status, 0, String(stderr));
  return String(stderr);
}

test("the command line keeps the profile that both photos have, and the reference's camera data", async () => {
  const { target, reference } = await sample();
  const write = async (
    /** @type {string} */ name,
    /** @type {object} */ of,
    /** @type {any} */ image,
  ) => writeFile(join(folder, name), await encodePng(image, of));
  await write("a.png", { colourProfile: P3 }, target);
  await write("b.png", { colourProfile: P3, exif: EXIF }, reference);
  await write("c.png", {}, target);
  await write("d.png", {}, reference);
  run("a.png", "b.png", "-o", "p3.jpg", "--warped", "w.png", "-q");
  run("a.png", "b.png", "-o", "p3.png", "-q");
  run("c.png", "d.png", "-o", "plain.png", "-q");
  const read = async (/** @type {string} */ name) => readFile(join(folder, name));
  const found = await readMetadata(await read("p3.jpg"));
  assert.deepEqual(found.colourProfile, P3);
  assert.equal(found.exif?.[18], 1);
  assert.deepEqual((await readMetadata(await read("w.png"))).colourProfile, P3);
  assert.deepEqual(await readMetadata(await read("plain.png")), {
    colourProfile: null,
    exif: null,
  });
  // The numbers are those of the files.
  assert.deepEqual(
    await decodeImage(await read("p3.png")),
    await decodeImage(await read("plain.png")),
  );

  // Of two profiles the reference's, and colours are what they were.
  await write("e.png", { colourProfile: ADOBE }, await convertColours(target, P3, ADOBE));
  run("e.png", "b.png", "-o", "mixed.png", "-q");
  assert.deepEqual((await readMetadata(await read("mixed.png"))).colourProfile, P3);
  const none = { colourProfile: null, exif: null };
  const photos = [
    { image: await convertColours(target, P3, ADOBE), metadata: { ...none, colourProfile: ADOBE } },
    { image: reference, metadata: { ...none, colourProfile: P3 } },
  ];
  const { images, warnings } = await matchColours(["e.png", "b.png"], photos, 1);
  assert.deepEqual(warnings, []);
  assert.equal(images[1], reference);
  const back = images[0]?.data ?? [];
  const off = target.data.map((v, i) => Math.abs(v - (back[i] ?? 0)));
  assert.ok(off.reduce((a, b) => a + b, 0) < off.length, "a level on average");
});

test("a damaged profile is said aloud, and its photo taken as it is", async () => {
  const { target, reference } = await sample();
  const damaged = P3.slice(0, 140);
  await writeFile(join(folder, "x.png"), await encodePng(target, { colourProfile: damaged }));
  await writeFile(join(folder, "y.png"), await encodePng(reference));
  assert.match(run("x.png", "y.png", "-o", "xy.png"), /warning: colour-profile: x\.png: /);
});

test("many photos are shown in the colours of the first, or of the reference that is given", async () => {
  const { target, reference } = await sample();
  const files = ["1.png", "2.png", "3.png"];
  const profiles = [P3, null, null];
  for (const [i, image] of [target, reference, target].entries()) {
    const metadata = { colourProfile: profiles[i] ?? null, exif: i === 1 ? EXIF : null };
    await writeFile(join(folder, files[i] ?? ""), await encodePng(image, metadata));
  }
  run(...files, "-o", "many.png", "-q");
  const read = async () => readMetadata(await readFile(join(folder, "many.png")));
  assert.deepEqual((await read()).colourProfile, P3);
  run(...files, "--reference", "2.png", "-o", "many.png", "-q");
  const found = await read();
  assert.equal(found.colourProfile, null);
  assert.equal(found.exif?.[18], 1);
});

/**
 * EXIF of one entry in a directory of its own: the 35 mm equivalent of the focal length.
 *
 * @param {number} equivalent
 */
function lens(equivalent) {
  const directories = ["01006987040001000000" + "1a000000" + "00000000", "010005a4030001000000"];
  const bytes = Buffer.from(
    ["49492a0008000000", ...directories, "0000000000000000"].join(""),
    "hex",
  );
  bytes.writeUInt16LE(equivalent, 36);
  return Uint8Array.from(bytes);
}

test("the command line uses the focal lengths in the camera data of three photos, unless one is given", async () => {
  const { target, reference } = await sample();
  const { width, height } = target;
  const expected = (30 / 43.27) * Math.hypot(width, height);
  const found = (await readFocalLength(lens(30), target)) ?? NaN;
  assert.ok(Math.abs(found - expected) < 1e-9 * expected, `${found}`);
  assert.equal(await readFocalLength(EXIF, target), null);
  const error = await rejection(readFocalLength(EXIF, /** @type {any} */ ({ width, height: -1 })));
  assert.equal(error.code, "invalid-argument");

  await writeFile(join(folder, "t.png"), await encodePng(target, { exif: lens(30) }));
  await writeFile(join(folder, "u.png"), await encodePng(target, { exif: lens(60) }));
  await writeFile(join(folder, "r.png"), await encodePng(reference));
  const stitched = async (/** @type {string[]} */ ...args) => {
    run(...args, "-o", "tr.png", "--report", "tr.json", "-q");
    return JSON.parse(await readFile(join(folder, "tr.json"), "utf8"));
  };
  assert.equal((await stitched("t.png", "r.png")).options.focalLength, 0);
  const given = ["--focal-length", "700"];
  assert.equal((await stitched("t.png", "r.png", ...given)).options.focalLength, 700);
  // The photos of this set leave it open, but for what is said.
  const near = async (/** @type {number} */ wanted, /** @type {string[]} */ ...args) => {
    const { focalLength } = (await stitched(...args)).photos[0];
    assert.ok(Math.abs(focalLength / wanted - 1) < 0.03, `${focalLength}, not ${wanted}`);
  };
  await near(found, "t.png", "r.png", "t.png");
  await near(2 * found, "u.png", "r.png", "u.png");
  await near(700, "u.png", "r.png", "u.png", ...given);
});
