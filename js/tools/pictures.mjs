// Makes the images of README.md and of the page's start: renders the sample, stitches it by the command line, with depth maps and by
// a homography alone, and downscales the results.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { build } from "./build.mjs";
import { renderSample } from "./sample.mjs";
import { isMain, root, run } from "./shared.mjs";

/** @typedef {import("../../dist/index.js").ImageInput} ImageInput */

/** Colour of transparent areas. */
const BACKGROUND = 255;
const QUALITY = 82;
const MAX_BYTES = 120 * 1024;
/** What the start of the page shows of both mosaics, in pixels of the reference, and how: it is part of the first load. */
const DETAIL = { x: 0, y: 225, width: 576, height: 288, shown: 400, quality: 30 };

const sample = join(root, "www", "public", "sample");
const work = join(root, "target", "pictures");
const out = join(root, "www", "pictures");

export async function makePictures() {
  build();
  renderSample();
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

  const { decodeImage, encodeJpeg } = await import("../../dist/codecs.js");
  for (const [name, file, width] of /** @type {[string, string, number][]} */ ([
    ["target", photos[0], 480],
    ["reference", photos[1], 480],
    ["homography", baseline, 720],
    ["warped", warped, 720],
    ["mosaic", mosaic, 720],
  ])) {
    const small = shrink(await decodeImage(readFileSync(file)), width);
    const jpeg = await encodeJpeg(small, QUALITY);
    if (jpeg.length > MAX_BYTES) throw new Error(`${name}.jpg has ${jpeg.length} bytes`);
    writeFileSync(join(out, `${name}.jpg`), jpeg);
    console.log(`www/pictures/${name}.jpg: ${small.width}×${small.height}, ${jpeg.length} bytes`);
  }
  for (const [name, file] of /** @type {["before" | "after", string][]} */ ([
    ["before", baseline],
    ["after", mosaic],
  ])) {
    const { offset } = JSON.parse(readFileSync(reports[name], "utf8")).canvas;
    const part = cut(await decodeImage(readFileSync(file)), offset, DETAIL);
    const jpeg = await encodeJpeg(shrink(part, DETAIL.shown), DETAIL.quality);
    writeFileSync(join(out, `${name}.jpg`), jpeg);
    console.log(`www/pictures/${name}.jpg: ${jpeg.length} bytes`);
  }
}

/**
 * A rectangle of an image, from a corner of it.
 *
 * @param {ImageInput} image
 * @param {{ x: number, y: number }} corner
 * @param {{ x: number, y: number, width: number, height: number }} part
 */
function cut(image, corner, { x, y, width, height }) {
  const data = new Uint8ClampedArray(4 * width * height);
  for (let row = 0; row < height; row++) {
    const from = 4 * ((corner.y + y + row) * image.width + corner.x + x);
    data.set(image.data.subarray(from, from + 4 * width), 4 * row * width);
  }
  return { data, width, height };
}

/** Runs the command line. @param {string[]} args */
function stitch(args) {
  run(process.execPath, [join(root, "dist", "cli", "main.js"), ...args]);
}

/**
 * Downscales an image to `width` pixels by area averaging, over the background colour.
 *
 * @param {ImageInput} image
 * @param {number} width
 */
function shrink(image, width) {
  const scale = image.width / width;
  const height = Math.round(image.height / scale);
  const data = new Uint8ClampedArray(4 * width * height).fill(255);
  for (let y = 0; y < height; y++) {
    const rows = span(y * scale, Math.min((y + 1) * scale, image.height));
    for (let x = 0; x < width; x++) {
      const sums = [0, 0, 0];
      let area = 0;
      for (const column of span(x * scale, Math.min((x + 1) * scale, image.width))) {
        for (const row of rows) {
          const at = 4 * (row.index * image.width + column.index);
          const weight = row.part * column.part;
          const alpha = (image.data[at + 3] ?? 0) / 255;
          area += weight;
          sums.forEach((sum, c) => {
            const colour = (image.data[at + c] ?? 0) * alpha + BACKGROUND * (1 - alpha);
            sums[c] = sum + weight * colour;
          });
        }
      }
      const at = 4 * (y * width + x);
      sums.forEach((sum, c) => void (data[at + c] = sum / area));
    }
  }
  return { data, width, height };
}

/**
 * The pixels between two positions, and the covered fraction of each.
 *
 * @param {number} from
 * @param {number} to
 */
function span(from, to) {
  const first = Math.floor(from);
  return Array.from({ length: Math.ceil(to) - first }, (_, i) => ({
    index: first + i,
    part: Math.min(to, first + i + 1) - Math.max(from, first + i),
  }));
}

if (isMain(import.meta.url)) await makePictures();
