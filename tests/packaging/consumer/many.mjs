// Stitches as ever, and by what is made for many photos, in any environment.
import { stitchMany } from "depthstitch";
import { decodeImage } from "depthstitch/codecs";
import { digest } from "./digest.mjs";

/** @param {(name: string) => Promise<ArrayBuffer>} read @returns {Promise<string>} */
export async function summary(read) {
  const both = await digest(read);
  const photos = [];
  for (const name of ["target.jpg", "reference.jpg"]) {
    photos.push(await decodeImage(await read(name)));
  }
  const { mosaic } = await stitchMany(photos, { workers: 2 });
  return `${both} ${mosaic.width}×${mosaic.height}`;
}
