// Turning photos by 90°, with all that belongs to them.
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
  idle,
  savedPicture,
  smallCase,
  smallFile,
  smallPhotos,
  startSite,
  statusSays,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

/** Presses the button of a photo and waits for the new result. @param {Page} page @param {string} slot */
async function turn(page, slot) {
  await page.locator(`[data-slot="${slot}"] .turn`).click();
  await idle(page);
  await finished(page);
}

/**
 * An image of `channels` values a pixel, turned by 90° clockwise.
 *
 * @template {Uint8Array | Uint8ClampedArray | Uint16Array} A
 * @param {{ data: A, width: number, height: number }} image
 */
function turned({ data, width, height }) {
  const channels = data.length / (width * height);
  const out = /** @type {A} */ (data.slice());
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const from = channels * (y * width + x);
      out.set(data.subarray(from, from + channels), channels * (x * height + height - 1 - y));
    }
  }
  return { data: out, width: height, height: width };
}

test("a turned photo is stitched as it is then, with its depth map and matches", async () => {
  const { page, complaints, close } = await site.open({ files: smallCase });
  await turn(page, "target");
  await turn(page, "reference");
  await turn(page, "reference");

  const target = await decodedByBrowser(page, smallFile("target.jpg"));
  const reference = await decodedByBrowser(page, smallFile("reference.jpg"));
  const { depth } = JSON.parse(await readFile(smallFile("case.json"), "utf8"));
  const map = async (/** @type {string} */ name) => decodeDepth(await readFile(smallFile(name)));
  const meaning = { kind: depth.kind, invalid: depth.invalid };
  const lines = (await readFile(smallFile("matches.csv"), "utf8")).trim().split("\n").slice(1);
  const { width, height } = target;
  const matches = lines.flatMap((line) => {
    const [xt = 0, yt = 0, xr = 0, yr = 0] = line.split(",").map((at) => Math.fround(Number(at)));
    // Once, and twice.
    return [height - 1 - yt, xt, width - 1 - xr, height - 1 - yr];
  });
  const expected = await stitch(turned(target), turned(turned(reference)), {
    matches: new Float32Array(matches),
    targetDepth: { ...turned(await map("target_depth.png")), ...meaning },
    referenceDepth: { ...turned(turned(await map("reference_depth.png"))), ...meaning },
  });
  assertSame(asOnCanvas(await savedPicture(page)), asOnCanvas(expected.mosaic));
  assert.equal(
    await page.locator('[data-slot="target"] [data-part="size"]').textContent(),
    `${height}\u00a0×\u00a0${width}`,
  );

  // At another size it is still turned.
  await page.evaluate(() => void (location.hash = "#page.photoLimit=160"));
  await page
    .locator('[data-slot="target"] [data-part="size"]', { hasText: /downscaled to 107.×.160/ })
    .waitFor();
  assert.deepEqual(await complaints(), []);
  await close();
});

test("after four turns the picture is what it was", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const before = await savedPicture(page);
  for (let i = 0; i < 4; i++) await turn(page, "reference");
  assertSame(await savedPicture(page), before);
  await close();
});

test("one of three photos is turned in its place", async () => {
  const files = [...smallPhotos, exampleFile("target.jpg")];
  const { page, complaints, close } = await site.open({ files });
  const size = page.locator('.tile[data-number="1"] .size');
  // Turning itself leaves the status as it was.
  const running = statusSays(page, /…$/);
  await page.locator('.tile[data-number="1"] .turn').click();
  await running;
  await finished(page);
  assert.match((await size.textContent()) ?? "", /^160.×.240$/);
  assert.match((await page.locator("#result-source").textContent()) ?? "", /^3 of 3 photos/);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("photos are not swapped while one of them is turned", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await page.evaluate(() => {
    for (const selector of ['[data-slot="target"] .turn', "#swap"]) {
      const button = document.querySelector(selector);
      if (button instanceof HTMLElement) button.click();
    }
  });
  await idle(page);
  await finished(page);
  const names = await page.locator(".card.photo .file").allTextContents();
  assert.deepEqual(names, ["target.jpg", "reference.jpg"]);
  await page.locator('#swap[aria-disabled="false"]').click();
  await page.locator("#result-source", { hasText: "reference.jpg onto target.jpg" }).waitFor();
  await close();
});
