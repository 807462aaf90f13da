// Stitching: two photos in, one mosaic out, identical to that of Node from the same pixels.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, test } from "node:test";
import { stitch } from "depthstitch";
import { decodeDepth } from "depthstitch/codecs";
import {
  asOnCanvas,
  assertSame,
  decodedByBrowser,
  exampleFile,
  finished,
  openPanel,
  openView,
  recorded,
  saved,
  savedPicture,
  smallCase,
  smallFile,
  smallPhotos,
  startSite,
  stitchAgain,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

/** The two photos of the small case as the browser sees them. @param {Page} page */
const decodedPhotos = async (page) =>
  /** @type {const} */ ([
    await decodedByBrowser(page, smallFile("target.jpg")),
    await decodedByBrowser(page, smallFile("reference.jpg")),
  ]);

/** Depth maps and matches of a case, for Node. @param {(name: string) => string} fileOf */
async function inputsOf(fileOf) {
  const { depth } = JSON.parse(await readFile(fileOf("case.json"), "utf8"));
  const map = async (/** @type {string} */ name) => ({
    ...(await decodeDepth(await readFile(fileOf(name)))),
    kind: depth.kind,
    invalid: depth.invalid,
  });
  const lines = (await readFile(fileOf("matches.csv"), "utf8")).trim().split("\n").slice(1);
  return {
    matches: new Float32Array(lines.flatMap((line) => line.split(",").map(Number))),
    targetDepth: await map("target_depth.png"),
    referenceDepth: await map("reference_depth.png"),
  };
}

test("two photos are enough: it runs by itself, to the bytes that Node makes", async () => {
  const { page, complaints, close } = await site.open({ files: smallPhotos });
  const expected = await stitch(...(await decodedPhotos(page)));
  for (const which of /** @type {const} */ (["mosaic", "warped"])) {
    assertSame(asOnCanvas(await savedPicture(page, which)), asOnCanvas(expected[which]), which);
  }
  const { report, quality } = expected;
  assert.equal(
    await page.locator('[data-figure="inliers"]').textContent(),
    `${report.inliers} / ${report.usable}`,
  );
  // A verdict in words; the measures behind it are in the report, never without coverage.
  assert.match((await page.locator('[data-figure="overlap"]').textContent()) ?? "", /^Agrees/);
  const share = `${(100 * quality.coverage).toFixed(0)}\u00a0%`;
  assert.equal(
    await page.locator('[data-under="overlap"]').textContent(),
    `compared on ${share} of it`,
  );
  assert.deepEqual(await page.locator("#quality-rows tr:first-child td").allTextContents(), [
    `${quality.psnrMask.toFixed(2)}\u00a0dB`,
    quality.ssimMask.toFixed(3),
    share,
  ]);
  assert.deepEqual(
    await page.locator("#warnings li").allTextContents(),
    report.warnings.map(({ message }) => message),
  );
  assert.deepEqual(await complaints(), []);
  await close();
});

test("the example is stitched with its depth maps, to the bytes that Node makes", async () => {
  const { page, complaints, close } = await site.open();
  await page.locator("#start-sample").click();
  await finished(page);
  const photos = /** @type {const} */ ([
    await decodedByBrowser(page, exampleFile("target.jpg")),
    await decodedByBrowser(page, exampleFile("reference.jpg")),
  ]);
  const expected = await stitch(...photos, await inputsOf(exampleFile));
  assertSame(asOnCanvas(await savedPicture(page)), asOnCanvas(expected.mosaic));
  assert.match((await page.locator("#depth-summary").textContent()) ?? "", /files/);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("swapping exchanges the photos with all that belongs to them", async () => {
  const { page, close } = await site.open({ files: smallCase });
  await page.locator("#swap").click();
  await page.locator("#result-source", { hasText: /^reference\.jpg onto target\.jpg$/ }).waitFor();
  await finished(page);
  const [target, reference] = await decodedPhotos(page);
  const { matches, targetDepth, referenceDepth } = await inputsOf(smallFile);
  const expected = await stitch(reference, target, {
    matches: matches.map((_, i) => matches[i % 4 < 2 ? i + 2 : i - 2] ?? 0),
    targetDepth: referenceDepth,
    referenceDepth: targetDepth,
  });
  assertSame(asOnCanvas(await savedPicture(page)), asOnCanvas(expected.mosaic));
  await close();
});

test("what was computed once is not computed again", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const first = await savedPicture(page);
  await openPanel(page, "options");
  await page.locator("#options summary", { hasText: "Compositing" }).click();
  await page.selectOption("#option-blending", "average");
  assert.match(
    (await page.locator("#result-source").textContent()) ?? "",
    /made with other settings/,
  );
  await stitchAgain(page);
  assert.doesNotMatch((await page.locator("#status").textContent()) ?? "", /reused/);
  const average = await savedPicture(page);
  assert.notDeepEqual(Buffer.from(average.data.buffer), Buffer.from(first.data.buffer));
  await page.selectOption("#option-blending", "multiband");
  await stitchAgain(page);
  assert.match((await page.locator("#status").textContent()) ?? "", /reused the earlier result/);
  assertSame(await savedPicture(page), first);
  await close();
});

test("a comparison that was computed is shown again without a word", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const compared = page.locator("#view-caption", { hasText: "the other method" });
  await page.locator("#tab-compare").click();
  await compared.waitFor();
  await openView(page, "mosaic");
  const said = await recorded(page, "#status");
  await page.locator("#tab-compare").click();
  await compared.waitFor();
  assert.deepEqual(await said(), []);
  await close();
});

test("the published method is one choice away, and so is the way back", async () => {
  const { page, close } = await site.open({ files: smallCase });
  const first = await savedPicture(page);
  await openPanel(page, "options");
  await page.selectOption("#option-mode", "paper");
  await stitchAgain(page);
  const expected = await stitch(...(await decodedPhotos(page)), {
    ...(await inputsOf(smallFile)),
    mode: "paper",
  });
  assertSame(asOnCanvas(await savedPicture(page)), asOnCanvas(expected.mosaic));
  await page.getByRole("button", { name: "Reset to defaults" }).click();
  await stitchAgain(page);
  assertSame(await savedPicture(page), first);
  await close();
});

test("photos above the limit are scaled down, and their matches with them", async () => {
  const { page, close } = await site.open({ files: smallCase, hash: "#page.photoLimit=120" });
  const card = page.locator('[data-slot="target"] [data-part="size"]');
  assert.match((await card.textContent()) ?? "", /240.×.160, downscaled to 120.×.80/);
  const report = JSON.parse((await saved(page, "#download-report")).bytes.toString());
  assert.deepEqual(report.sizes.target, {
    width: 120,
    height: 80,
    original: { width: 240, height: 160 },
  });
  assert.ok(report.report.inliers > 0.7 * report.report.usable, "the matches fit the small photos");

  await openPanel(page, "options");
  await page.selectOption("#photo-limit", "1024");
  await page
    .locator('[data-slot="target"] [data-part="size"]', { hasText: /^240.×.160$/ })
    .waitFor();
  await page.locator("#view-caption", { hasText: "pixels" }).waitFor();
  await finished(page);
  await close();
});

test("a size that is chosen while a photo is read holds for that too", async () => {
  const { page, close } = await site.open({ files: smallPhotos, hash: "#page.photoLimit=120" });
  await page.evaluate(() => {
    const limit = document.querySelector("#photo-limit");
    const card = document.querySelector('[data-slot="target"]');
    const observer = new MutationObserver(() => {
      observer.disconnect();
      if (!(limit instanceof HTMLSelectElement)) return;
      limit.value = "1024";
      limit.dispatchEvent(new Event("change"));
    });
    if (card) observer.observe(card, { attributeFilter: ["aria-busy"] });
  });
  await page.setInputFiles("#target-file", smallFile("reference.jpg"));
  for (const slot of ["target", "reference"]) {
    const card = page.locator(`[data-slot="${slot}"]`, { hasText: "reference.jpg" });
    await card.locator(".size", { hasText: /^240.×.160$/ }).waitFor();
  }
  await finished(page);
  await close();
});
