// Makes the images of README.md: renders the sample, stitches it by the command line, with and without depth maps, and
// downscales the results.
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

const sample = join(root, "www", "public", "sample");
const work = join(root, "target", "pictures");
const out = join(root, "www", "pictures");

export async function makePictures() {
  build();
  renderSample();
  mkdirSync(work, { recursive: true });
  mkdirSync(out, { recursive: true });

  const made = (/** @type {string} */ name) => join(work, name);
  const [mosaic, warped, baseline] = ["mosaic.png", "warped.png", "homography.png"].map(made);
  stitch(["--case", sample, "--warped", `${warped}`, "-o", `${mosaic}`]);
  const photos = ["target.jpg", "reference.jpg"].map((name) => join(sample, name));
  stitch([...photos, "--matches", join(sample, "matches.csv"), "-o", `${baseline}`]);

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
