// Three photos and more: a strip of thumbnails, one mosaic, and what became of each photo.
import assert from "node:assert/strict";
import { copyFileSync, mkdirSync, writeFileSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { after, test } from "node:test";
import { crop, stitchMany } from "depthstitch";
import { decodeImage, encodePng } from "depthstitch/codecs";
import { OPTION_LIST } from "depthstitch/options";
import {
  asOnCanvas,
  assertSame,
  cancelDuring,
  drop,
  exampleFile,
  finished,
  idle,
  openPanel,
  openView,
  recorded,
  saved,
  savedPicture,
  scratchFolder,
  shown,
  smallCase,
  smallFile,
  smallPhotos,
  startSite,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

const { scratch, written } = scratchFolder();

// Overlapping parts of one picture, so that little is to be computed, as PNG, which every decoder reads alike.
const whole = await decodeImage(await readFile(exampleFile("reference.jpg")));
const parts = [0, 130, 260, 390].map((x) => crop(whole, { x, y: 100, width: 360, height: 300 }));
/** Something else: a pattern of rings. */
const other = {
  data: Uint8ClampedArray.from({ length: 4 * 360 * 300 }, (_, i) => {
    const [x, y] = [(i >> 2) % 360, Math.floor((i >> 2) / 360)];
    return i % 4 === 3 ? 255 : 128 + 120 * Math.sin(((x - 90) ** 2 + (y - 150) ** 2) / 900);
  }),
  width: 360,
  height: 300,
};
const files = await Promise.all(
  parts.map(async (part, i) => written(`IMG_${i + 1}.png`, await encodePng(part))),
);
const three = files.slice(0, 3);
const unrelated = written("rings.png", await encodePng(other));

/** The tiles of the strip, as text. @param {Page} page */
const tiles = (page) => page.locator(".tile").allInnerTexts();

/** The note beside a photo. @param {Page} page @param {string} name */
const note = (page, name) => page.locator(".tile", { hasText: name }).locator(".note");

const text = async (/** @type {Page} */ page, /** @type {string} */ selector) =>
  (await page.locator(selector).textContent()) ?? "";

test("three photos become one mosaic, of the bytes that Node makes", async () => {
  const { page, complaints, close } = await site.open();
  await drop(page, ".masthead", three);
  await finished(page);
  const expected = await stitchMany(parts.slice(0, 3));
  assertSame(asOnCanvas(await savedPicture(page)), asOnCanvas(expected.mosaic));

  assert.equal(await text(page, "#result-source"), "3 of 3 photos, seen from IMG_2.png");
  assert.equal((await tiles(page)).length, 3);
  assert.match(await page.locator(".tile.reference").innerText(), /IMG_2\.png\s+Reference/);
  assert.match(await text(page, "#view-caption"), /mosaic of 3 photos, seen from IMG_2\.png/);
  assert.deepEqual(await page.locator('[role="tab"]:visible').allInnerTexts(), [
    "Mosaic",
    "Graph",
    "Seam",
    "Filled gaps",
  ]);
  for (const only of ["#depth-panel", "#methods-panel", "#download-warped", "#figures", "#swap"]) {
    assert.ok(!(await page.locator(only).isVisible()), `${only} is of two photos`);
  }

  await page.selectOption("#save-crop", "inner");
  await page.selectOption("#save-format", "jpeg");
  const jpeg = await saved(page, "#download-mosaic");
  assert.equal(jpeg.name, "IMG_1_to_IMG_3-stitched.jpg");
  const { inner } = expected.crop;
  const { width, height } = await decodeImage(jpeg.bytes);
  assert.deepEqual([width, height], [inner?.width, inner?.height]);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("the graph of pairs is a drawing and a table, and the report has it all", async () => {
  const { page, complaints, close } = await site.open({ files: [...three, unrelated] });
  await page.locator("#pairs-panel > summary").click();
  const rows = await page.locator("#pairs tbody tr").allInnerTexts();
  assert.equal(rows.length, 6);
  assert.match(rows[0] ?? "", /IMG_\d\.png – \d · IMG_\d\.png\s+\d+\s+\d+\s+yes/);
  assert.match(rows.find((row) => row.includes("rings.png")) ?? "", /\sno$/);

  /** @type {Set<string>} */
  const captions = new Set();
  const pictures = new Set();
  for (const tab of ["mosaic", "graph", "seam", "voids"]) {
    await openView(page, tab);
    captions.add(await text(page, "#view-caption"));
    pictures.add((await page.evaluate(shown)).sum);
  }
  assert.equal(captions.size, 4);
  assert.equal(pictures.size, 4, "no two views look the same");
  await page.locator("#tab-seam").click();
  await page.locator(".swatches.names li").nth(2).waitFor();
  assert.equal(await page.locator(".swatches.names li").count(), 3, "the used photos alone");

  const report = JSON.parse((await saved(page, "#download-report")).bytes.toString());
  assert.deepEqual(
    report.photos.map((/** @type {{ file: string, code: string }} */ { file, code }) => [
      file,
      code,
    ]),
    [
      ["IMG_1.png", "used"],
      ["IMG_2.png", "used"],
      ["IMG_3.png", "used"],
      ["rings.png", "no-matches"],
    ],
  );
  assert.equal(report.pairs.length, 6);
  assert.equal(report.reference, "IMG_2.png");
  assert.ok(report.times.detect > 0);
  assert.match(report.projection, /^(plane|cylinder|sphere)$/);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("a photo that was left out says why beside its thumbnail", async () => {
  const { page, close } = await site.open({ files: [...three, unrelated] });
  const [picture, words] = await Promise.all(
    [".thumb", ".note"].map((part) =>
      page.locator(".tile", { hasText: "rings.png" }).locator(part).boundingBox(),
    ),
  );
  assert.ok(picture && words && picture.width > 60 && words.x >= picture.x + picture.width);
  assert.equal(
    await note(page, "rings.png").textContent(),
    "Left out. No common points with the other photos were found.",
  );
  assert.equal(await text(page, "#result-source"), "3 of 4 photos, seen from IMG_2.png");
  assert.match(await text(page, "#many-figures"), /Photos3 of 4in the picture/);

  // Nor can the others be shown from it.
  await page.selectOption("#set-reference", { label: "4 · rings.png" });
  await page.locator("#message.error", { hasText: /reference photo.*Choose another/ }).waitFor();
  await page.selectOption("#set-reference", { label: "Automatic" });
  await page.locator("#message", { hasText: /^$/ }).waitFor({ state: "attached" });
  await close();
});

test("the reference can be chosen, and comes back to automatic", async () => {
  const { page, close } = await site.open({ files: three });
  const first = await savedPicture(page);
  await page.selectOption("#set-reference", { label: "1 · IMG_1.png" });
  await page.locator("#result-source", { hasText: "seen from IMG_1.png" }).waitFor();
  const expected = await stitchMany(parts.slice(0, 3), { reference: 0 });
  assertSame(asOnCanvas(await savedPicture(page)), asOnCanvas(expected.mosaic));
  await page.selectOption("#set-reference", { label: "Automatic" });
  await page.locator("#result-source", { hasText: "seen from IMG_2.png" }).waitFor();
  assert.match(await text(page, "#status"), /reused/);
  assertSame(await savedPicture(page), first);
  await close();
});

test("photos are removed by button and Delete key, with a way back, down to two", async () => {
  const { page, complaints, close } = await site.open({ files });
  const first = await savedPicture(page);
  await page.getByRole("button", { name: "Remove photo 2, IMG_2.png" }).focus();
  await page.keyboard.press("Delete");
  await page.locator("#undo-text", { hasText: "Removed IMG_2.png." }).waitFor();
  assert.equal((await tiles(page)).length, 3);
  assert.equal(
    await page.evaluate(() => document.activeElement?.getAttribute("aria-label")),
    "Remove photo 2, IMG_3.png",
    "the focus stays in its place",
  );
  await page.locator("#result-source", { hasText: "of 3 photos" }).waitFor();
  await page.getByRole("button", { name: "Undo" }).click();
  await idle(page);
  assert.equal((await tiles(page)).length, 4);
  assert.match((await tiles(page))[1] ?? "", /IMG_2/, "in its old place");
  assertSame(await savedPicture(page), first);

  for (const name of ["Remove photo 1, IMG_1.png", "Remove photo 1, IMG_2.png"]) {
    await page.getByRole("button", { name }).click();
  }
  await page.locator("#result-source", { hasText: /^IMG_3\.png onto IMG_4\.png$/ }).waitFor();
  assert.ok(await page.locator('[data-slot="target"]').isVisible(), "two photos as ever");
  assert.ok(!(await page.locator("#strip").isVisible()));
  assert.equal(await page.evaluate(() => document.activeElement?.id), "add-files");
  await page.getByRole("button", { name: "Undo" }).click();
  await page.locator("#result-source", { hasText: "of 3 photos" }).waitFor();
  assert.deepEqual(await complaints(), []);
  await close();
});

test("a set that was removed while it was read is read on when it comes back", async () => {
  const { page, close } = await site.open();
  await drop(page, ".masthead", three);
  await page.locator(".tile").first().waitFor();
  await page.click("#clear-inputs");
  await page.getByRole("button", { name: "Undo" }).click();
  await finished(page);
  assert.equal(await text(page, "#result-source"), "3 of 3 photos, seen from IMG_2.png");
  await close();
});

test("a third photo joins two, and depth maps and matches come back when it goes", async () => {
  const { page, complaints, close } = await site.open({ files: smallCase });
  const first = await savedPicture(page);
  await page.setInputFiles("#add-files", files.slice(0, 1));
  await page.locator("#result-source", { hasText: "of 3 photos" }).waitFor();
  assert.match((await tiles(page)).join(), /target\.jpg.*reference\.jpg.*IMG_1\.png/s);
  await page.getByRole("button", { name: "Remove photo 3" }).click();
  await page.locator("#result-source", { hasText: /^target\.jpg onto reference\.jpg$/ }).waitFor();
  await finished(page);
  assert.equal(await text(page, '[data-slot="matches"] .file'), "matches.csv");
  assert.match(await text(page, "#depth-summary"), /files/);
  assertSame(await savedPicture(page), first);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("a folder of a set is its photos: its case file is none of two, and its depth maps are told", async () => {
  const { page, close } = await site.open();
  const folder = join(scratch, "set");
  mkdirSync(folder);
  for (const file of three) copyFileSync(file, join(folder, basename(file)));
  copyFileSync(smallFile("target_depth.png"), join(folder, "IMG_1_depth.png"));
  writeFileSync(
    join(folder, "case.json"),
    JSON.stringify({ photos: three.map((file) => basename(file)) }),
  );
  await drop(page, ".masthead", [folder]);
  await finished(page);
  assert.match(await text(page, "#message"), /two photos only\. Ignored: IMG_1_depth\.png/);
  assert.equal((await tiles(page)).length, 3);
  await close();
});

test("two photos dropped on two take their place, unless all are to be kept", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const first = await savedPicture(page);
  await drop(page, ".masthead", files.slice(0, 2));
  await page.locator("#result-source", { hasText: /^IMG_1\.png onto IMG_2\.png$/ }).waitFor();
  await page.getByRole("button", { name: "Undo" }).click();
  await page.locator("#result-source", { hasText: /^target\.jpg onto reference\.jpg$/ }).waitFor();
  assertSame(await savedPicture(page), first);

  await drop(page, ".masthead", files.slice(0, 2));
  await page.getByRole("button", { name: "Keep all" }).click();
  await page.locator("#result-source", { hasText: "of 4 photos" }).waitFor();
  assert.equal((await tiles(page)).length, 4);
  await close();
});

test("the same picture twice and what is no picture are told apart, and nothing is lost", async () => {
  const { page, close } = await site.open();
  const [one = ""] = files;
  const again = written("the_same.png", await readFile(one));
  const broken = written("broken.jpg", "no picture");
  await page.setInputFiles("#many-files", [...three, again, broken]);
  await finished(page);
  assert.equal(
    await note(page, "the_same.png").textContent(),
    "Not used: it is the same picture as IMG_1.png.",
  );
  assert.match((await note(page, "broken.jpg").textContent()) ?? "", /not an image.*damaged/);
  assert.equal(await text(page, "#set-count"), "3 of 5 can be used");
  assert.equal(await text(page, "#result-source"), "3 of 3 photos, seen from IMG_2.png");
  // Without the first, its copy takes its place.
  await page.getByRole("button", { name: /Remove photo \d, IMG_1\.png/ }).click();
  await note(page, "the_same.png").filter({ hasText: /^$/ }).waitFor({ state: "attached" });
  await close();
});

test("of more than thirty photos the first thirty are used, and the others wait", async () => {
  const { page, close } = await site.open();
  const many = await Promise.all(
    Array.from({ length: 32 }, async (_, i) => {
      // All are flat, so that nothing is found in them; no two are the same.
      const data = new Uint8ClampedArray(4 * 8 * 8).map((_, k) => (k % 4 === 3 ? 255 : 4 * i + 1));
      const name = `flat_${String(i + 1).padStart(2, "0")}.png`;
      return written(name, await encodePng({ data, width: 8, height: 8 }));
    }),
  );
  await page.setInputFiles("#many-files", many);
  await page.locator("#message", { hasText: /./ }).waitFor();
  assert.equal(await text(page, "#set-count"), "30 of 32 can be used, each at 1280\u00a0px");
  for (const name of ["flat_31.png", "flat_32.png"]) {
    assert.equal(
      await note(page, name).textContent(),
      "Not used: at most 30 photos can be stitched. Remove another one to use it.",
    );
  }
  await page.getByRole("button", { name: "Remove photo 1, flat_01.png" }).click();
  await page.locator("#set-count", { hasText: "30 of 31" }).waitFor();
  assert.equal(await note(page, "flat_31.png").textContent(), "");
  await close();
});

test("many photos are reduced further, and come back to their size when they are few again", async () => {
  const { page, close } = await site.open();
  const many = await Promise.all(
    Array.from({ length: 11 }, async (_, i) => {
      const data = new Uint8ClampedArray(4 * 1800 * 30).map((_, k) =>
        k % 4 === 3 ? 255 : 20 * i + 1,
      );
      const name = `wide_${String(i + 1).padStart(2, "0")}.png`;
      return written(name, await encodePng({ data, width: 1800, height: 30 }));
    }),
  );
  await page.setInputFiles("#many-files", many);
  await page.locator("#set-count", { hasText: "11, each at 1536" }).waitFor();
  const used = page.locator(".tile .size").first();
  assert.match((await used.getAttribute("title")) ?? "", /downscaled to 1536/);
  await page.getByRole("button", { name: "Remove photo 11" }).click();
  await page.locator("#set-count", { hasText: /^10$/ }).waitFor();
  await page.waitForFunction(
    () => document.querySelector(".tile .size")?.getAttribute("title") === "1800\u00a0×\u00a030",
  );
  await close();
});

test("photos without common points are said to have none", async () => {
  const { page, close } = await site.open();
  const flat = await Promise.all(
    [40, 90, 140].map(async (level) => {
      const data = new Uint8ClampedArray(4 * 64 * 64).map((_, i) => (i % 4 === 3 ? 255 : level));
      return written(`plain_${level}.png`, await encodePng({ data, width: 64, height: 64 }));
    }),
  );
  await page.setInputFiles("#many-files", flat);
  await page.locator("#message.error", { hasText: "No common points were found" }).waitFor();
  assert.equal((await tiles(page)).length, 3, "they stay");
  await close();
});

test("progress names the photo; cancelling keeps the result", async () => {
  const { page, close } = await site.open();
  const said = await recorded(page, "#fraction");
  await page.setInputFiles("#many-files", three);
  await finished(page);
  const heard = (await said()).join();
  for (const words of ["photo 1 of 3", "photo 3 of 3", "pair 1 of 3", "pair 3 of 3"]) {
    assert.ok(heard.includes(words), words);
  }
  const first = await savedPicture(page);
  await page.evaluate(cancelDuring, { word: "Detecting", key: "Escape" });
  await page.selectOption("#set-reference", { index: 1 });
  await page.locator("#status", { hasText: "Cancelled" }).waitFor();
  assertSame(await savedPicture(page), first);
  await close();
});

test("options of the table that belong beside the photos are there, and all are in the form", async () => {
  const { page, close } = await site.open({ files: three });
  await openPanel(page, "options");
  for (const [name] of OPTION_LIST) {
    assert.equal(await page.locator(`#option-${name}`).count(), 1, name);
  }
  const known = OPTION_LIST.some(([name]) => String(name) === "projection");
  assert.equal(await page.locator("#set-option-projection").count(), known ? 1 : 0);
  await close();
});
