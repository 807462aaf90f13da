// Colour profiles and camera data, from the dropped file to the saved one.
import assert from "node:assert/strict";
import { readFile, rm } from "node:fs/promises";
import { after, test } from "node:test";
import { stitch } from "depthstitch";
import { decodeImage, encodeJpeg, encodePng, readMetadata } from "depthstitch/codecs";
import {
  asOnCanvas,
  assertSame,
  saved,
  savedPicture,
  scratchFolder,
  smallPhotos,
  startSite,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());
const { written } = scratchFolder();

/** EXIF of one entry, the orientation. @param {number} orientation */
const exifOf = (orientation) =>
  Uint8Array.of(
    ...[0x49, 0x49, 0x2a, 0, 8, 0, 0, 0, 1, 0, 0x12, 1, 3, 0, 1, 0, 0, 0],
    ...[orientation, 0, 0, 0, 0, 0, 0, 0],
  );
const [target, reference] = await Promise.all(
  smallPhotos.map(async (path) => decodeImage(await readFile(path))),
);
assert.ok(target && reference);

/** The profile of Display P3 as the browser writes it. @param {Page} page */
async function displayP3(page) {
  /** @type {number[]} */
  const png = await page.evaluate(async () => {
    const canvas = new OffscreenCanvas(1, 1);
    canvas.getContext("2d", { colorSpace: "display-p3" });
    return [...new Uint8Array(await (await canvas.convertToBlob()).arrayBuffer())];
  });
  const { colourProfile } = await readMetadata(Uint8Array.from(png));
  assert.ok(colourProfile);
  return colourProfile;
}

test("Display P3 and camera data go from the dropped file to the saved one", async () => {
  const { page, complaints, close } = await site.open();
  const colourProfile = await displayP3(page);
  const metadata = { colourProfile, exif: exifOf(1) };
  await page.setInputFiles("#many-files", [
    written("a.png", await encodePng(target, metadata)),
    written("b.png", await encodePng(reference, metadata)),
  ]);
  await page.locator("#status", { hasText: /^Done/ }).waitFor();
  const { mosaic } = await stitch(target, reference);
  // The values are those of the file: nothing is converted on the way.
  assertSame(asOnCanvas(await savedPicture(page)), asOnCanvas(mosaic));
  for (const format of ["png", "jpeg"]) {
    await page.selectOption("#save-format", format);
    for (const button of ["#download-mosaic", "#download-warped"]) {
      assert.deepEqual(await readMetadata((await saved(page, button)).bytes), metadata, format);
    }
  }
  assert.deepEqual(await complaints(), []);
  await close();
});

test("a photo on its side is saved upright, with its camera data changed to that", async () => {
  const { page, close } = await site.open({
    files: [
      written("c.jpg", await encodeJpeg(target)),
      written("d.jpg", sideways(await encodeJpeg(reference))),
    ],
  });
  await page.selectOption("#save-crop", "whole");
  const { bytes } = await saved(page, "#download-mosaic");
  assert.deepEqual(await readMetadata(bytes), { colourProfile: null, exif: exifOf(1) });
  const { width, height } = await decodeImage(bytes);
  assert.ok(height > width, "the reference is on its side");
  await close();
});

/** A JPEG with an orientation, which encoders of upright images do not write. @param {Uint8Array} jpeg */
function sideways(jpeg) {
  const exif = exifOf(6);
  const segment = Buffer.from([
    0xff,
    0xe1,
    0,
    exif.length + 8,
    ...Buffer.from("Exif\0\0"),
    ...exif,
  ]);
  return Buffer.concat([jpeg.subarray(0, 2), segment, jpeg.subarray(2)]);
}

test("photos of two colour spaces are stitched in the larger one, two or three", async () => {
  const { page, close } = await site.open();
  const colourProfile = await displayP3(page);
  const wide = written("e.png", await encodePng(reference, { colourProfile }));
  const [plain = "", other = ""] = smallPhotos;
  await page.setInputFiles("#many-files", [plain, wide]);
  await page.locator("#status", { hasText: /^Done/ }).waitFor();
  await page.selectOption("#save-format", "png");
  const two = await saved(page, "#download-mosaic");
  assert.deepEqual(await readMetadata(two.bytes), { colourProfile, exif: null });

  await page.setInputFiles("#add-files", [other]);
  await page.locator('.tile[data-number="3"]').waitFor();
  await page.locator("#result-source", { hasText: "3 of 3 photos" }).waitFor();
  const three = await saved(page, "#download-mosaic");
  assert.deepEqual(await readMetadata(three.bytes), { colourProfile, exif: null });
  await close();
});

test("a photo that cannot be read again in the colours of the other one leaves its place", async () => {
  const { page, close } = await site.open();
  const colourProfile = await displayP3(page);
  const plain = written("gone.png", await encodePng(target));
  await page.setInputFiles("#target-file", plain);
  const card = page.locator('[data-slot="target"]');
  await card.locator(".file", { hasText: "gone.png" }).waitFor();
  await rm(plain);
  const wide = written("f.png", await encodePng(reference, { colourProfile }));
  await page.setInputFiles("#reference-file", wide);
  await card.locator(".note.bad", { hasText: "gone.png could not be read again" }).waitFor();
  await page.locator('[data-slot="reference"] .file', { hasText: "f.png" }).waitFor();
  assert.doesNotMatch((await page.locator("#status").textContent()) ?? "", /Loading/);
  // Another file is loaded as ever.
  await page.setInputFiles("#target-file", smallPhotos[0] ?? "");
  await page.locator("#status", { hasText: /^Done/ }).waitFor();
  await close();
});

test("a photo that is turned while the other one brings its colours is turned, in these", async () => {
  const { page, close } = await site.open();
  const colourProfile = await displayP3(page);
  const wide = written("g.png", await encodePng(reference, { colourProfile }));
  await page.setInputFiles("#target-file", smallPhotos[0] ?? "");
  const card = page.locator('[data-slot="target"]');
  await card.locator(".file", { hasText: "target.jpg" }).waitFor();
  await page.evaluate(() => {
    const turn = document.querySelector('[data-slot="target"] .turn');
    const other = document.querySelector('[data-slot="reference"]');
    const observer = new MutationObserver(() => {
      observer.disconnect();
      if (turn instanceof HTMLElement) turn.click();
    });
    if (other) observer.observe(other, { attributeFilter: ["aria-busy"] });
  });
  await page.setInputFiles("#reference-file", wide);
  await page.locator("#status", { hasText: /^Done/ }).waitFor();
  assert.match((await card.locator(".size").textContent()) ?? "", /^160.×.240$/);
  await page.selectOption("#save-format", "png");
  const { bytes } = await saved(page, "#download-mosaic");
  assert.deepEqual(await readMetadata(bytes), { colourProfile, exif: null });
  await close();
});
