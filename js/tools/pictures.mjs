// Makes the images of README.md and of the page's start: renders the sample, stitches it by the command line, with depth maps and by
// a homography alone, and downscales the results.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import sharp from "sharp";
import { build } from "./build.mjs";
import { renderSample } from "./sample.mjs";
import { isMain, root, run } from "./shared.mjs";

/** Colour of transparent areas. */
const BACKGROUND = "white";
const QUALITY = 82;
const MAX_BYTES = 120 * 1024;
/** What the start of the page shows of both mosaics, in pixels of the reference, and how: it is part of the first load. */
const DETAIL = { x: 0, y: 225, width: 576, height: 288, shown: 400, quality: 40 };

const sample = join(root, "www", "public", "sample");
const work = join(root, "target", "pictures");
const out = join(root, "www", "pictures");

export async function makePictures() {
  await build();
  await renderSample();
  mkdirSync(work, { recursive: true });
  mkdirSync(out, { recursive: true });

  const made = (/** @type {string} */ name) => join(work, name);
  const mosaic = made("mosaic.png");
  const warped = made("warped.png");
  const baseline = made("homography.png");
  const reports = { before: made("before.json"), after: made("after.json") };
  stitch(["--case", sample, "--warped", warped, "-o", mosaic, "--report", reports.after]);
  const photos = ["target.jpg", "reference.jpg"].map((name) => join(sample, name));
  const homography = ["--without-depth", "homography", "--blending", "average"];
  const matches = ["--matches", join(sample, "matches.csv")];
  stitch([...photos, ...matches, ...homography, "-o", baseline, "--report", reports.before]);

  for (const [name, file, width] of /** @type {[string, string, number][]} */ ([
    ["target", photos[0], 480],
    ["reference", photos[1], 480],
    ["homography", baseline, 720],
    ["warped", warped, 720],
    ["mosaic", mosaic, 720],
  ])) {
    await write(`${name}.jpg`, opaque(file).resize(width).jpeg({ quality: QUALITY }));
  }
  for (const [name, file] of /** @type {["before" | "after", string][]} */ ([
    ["before", baseline],
    ["after", mosaic],
  ])) {
    const { offset } = JSON.parse(readFileSync(reports[name], "utf8")).canvas;
    const { x, y, width, height, shown, quality } = DETAIL;
    const part = opaque(file).extract({ left: offset.x + x, top: offset.y + y, width, height });
    await write(`${name}.avif`, part.resize(shown).avif({ quality, effort: 9 }));
  }
}

/** A picture over the background colour. @param {string} file */
function opaque(file) {
  return sharp(file).flatten({ background: BACKGROUND });
}

/** @param {string} name @param {import("sharp").Sharp} picture */
async function write(name, picture) {
  const file = await picture.toBuffer();
  if (file.length > MAX_BYTES) throw new Error(`${name} has ${file.length} bytes`);
  writeFileSync(join(out, name), file);
  console.log(`www/pictures/${name}: ${file.length} bytes`);
}

/** Runs the command line. @param {string[]} args */
function stitch(args) {
  run(process.execPath, [join(root, "dist", "cli", "main.js"), ...args]);
}

if (isMain(import.meta.url)) await makePictures();
