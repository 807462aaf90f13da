// node stitch.mjs left.jpg right.jpg mosaic.png
import { readFile, writeFile } from "node:fs/promises";
import { crop, stitch } from "depthstitch";
import { decodeImage, encodePng } from "depthstitch/codecs";

const [left = "left.jpg", right = "right.jpg", output = "mosaic.png"] = process.argv.slice(2);

const target = await decodeImage(await readFile(left));
const reference = await decodeImage(await readFile(right));
const result = await stitch(target, reference);

for (const { message } of result.report.warnings) console.warn(message);
const { psnrMask, coverage } = result.quality;
console.log(
  `PSNR ${psnrMask.toFixed(1)} dB over ${(100 * coverage).toFixed(0)} % of the reference`,
);

// The largest rectangle without transparent pixels.
const { inner } = result.crop;
await writeFile(output, await encodePng(inner ? crop(result.mosaic, inner) : result.mosaic));
