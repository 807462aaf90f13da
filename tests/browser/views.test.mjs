// Views: every view of a result, panning, zooming, comparing, and keyboard control.
import assert from "node:assert/strict";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { decodeImage, encodeJpeg, encodePng } from "depthstitch/codecs";
import {
  cancelDuring,
  exampleFile,
  idle,
  openView as open,
  savedPicture,
  scratchFolder,
  shown,
  smallCase,
  smallFile,
  smallPhotos,
  startSite,
  statusSays,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());
const { written } = scratchFolder();

test("every view draws something of its own and has a caption", async () => {
  // A depth map that is right shows what was hidden, so that there are voids to see.
  const { page, complaints, close } = await site.open({ files: smallCase });
  const tabs = await page.locator('[role="tab"]:visible').all();
  const ids = await Promise.all(tabs.map((tab) => tab.getAttribute("id")));
  for (const id of [
    "mosaic",
    "compare",
    "blink",
    "matches",
    "depth",
    "warp",
    "gain",
    "seam",
    "voids",
  ]) {
    assert.ok(ids.includes(`tab-${id}`), `there is a view ${id}`);
  }
  const sums = new Set();
  const captions = new Set();
  for (const id of ids) {
    await open(page, String(id).slice(4));
    const { drawn, coloured, sum } = await page.evaluate(shown);
    assert.ok(drawn > 0.1 && coloured > 0.01, `${id}: ${drawn} drawn, ${coloured} coloured`);
    sums.add(sum);
    captions.add(await page.locator("#view-caption").textContent());
    assert.equal(await page.locator(`#${id}`).getAttribute("aria-selected"), "true");
  }
  assert.equal(sums.size, ids.length, "no two views look the same");
  assert.equal(captions.size, ids.length);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("the gain of a photo that was taken darker is shown, in colours and in numbers", async () => {
  const photo = await decodeImage(await readFile(smallFile("target.jpg")));
  // 0.7 times the light, by sRGB's transfer function.
  const level = (/** @type {number} */ v) => {
    const light = 0.7 * (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    return light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
  };
  const darker = photo.data.map((v, i) => (i % 4 === 3 ? v : 255 * level(v / 255)));
  const folder = await mkdtemp(join(tmpdir(), "depthstitch-"));
  const target = join(folder, "target.png");
  await writeFile(target, await encodePng({ ...photo, data: darker }));
  const { page, complaints, close } = await site.open({
    files: [target, smallFile("reference.jpg")],
  });
  await open(page, "gain");
  const caption = await page.locator("#view-caption").textContent();
  const gains = [...(caption ?? "").matchAll(/\d\.\d\d/g)].map(Number);
  assert.equal(gains.length, 3);
  for (const gain of gains) assert.ok(Math.abs(0.7 * gain - 1) < 0.05, `${caption}`);
  const legend = await page.locator("#view-controls .scale").textContent();
  const [least = 0, most = 0] = [...(legend ?? "").matchAll(/\d\.\d\d/g)].map(Number);
  assert.ok(most > 1.35 && most < 1.8 && Math.abs(least * most - 1) < 0.02, `${legend}`);
  await page.evaluate(shown);
  const { amber, violet } = await page.evaluate(() => {
    const canvas = document.querySelector("#picture");
    if (!(canvas instanceof HTMLCanvasElement)) throw new Error("no canvas");
    const { width, height } = canvas;
    const data = canvas.getContext("2d")?.getImageData(0, 0, width, height).data ?? [];
    let [amber, violet] = [0, 0];
    for (let i = 0; i < data.length; i += 4) {
      const warmth = (data[i] ?? 0) - (data[i + 2] ?? 0);
      if (warmth > 40) amber++;
      if (warmth < -40) violet++;
    }
    return { amber, violet };
  });
  assert.ok(amber > 20_000 && violet < amber / 100, `${amber} brighter, ${violet} darker`);
  assert.deepEqual(await complaints(), []);
  await rm(folder, { recursive: true });
  await close();
});

test("zooms and pans by buttons, keys, wheel and pointer, and keeps the place from view to view", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  /** The level in per cent, once what was asked for is drawn. */
  const level = async () => {
    await page.evaluate(shown);
    return parseFloat((await page.locator("#zoom-level").textContent()) ?? "");
  };
  const all = await level();
  await page.locator("#zoom-in").click();
  const whole = await page.evaluate(shown);
  assert.ok((await level()) > 1.4 * all);
  await page.locator("#frame").focus();
  await page.keyboard.press("ArrowRight");
  const panned = await page.evaluate(shown);
  assert.notEqual(panned.sum, whole.sum, "an arrow key moves the picture");
  await page.keyboard.press("+");
  const closer = await level();
  assert.ok(closer > 1.4 * 1.5 * all);

  await open(page, "warp");
  assert.equal(await level(), closer, "the next view looks at the same place");
  await page.locator("#frame").hover();
  const before = await page.evaluate(shown);
  await page.mouse.wheel(0, 200);
  assert.equal(await level(), closer, "a plain wheel scrolls the page");
  await page.evaluate(() => window.scrollTo(0, 0));
  await page.locator("#frame").hover();
  await page.mouse.down();
  await page.mouse.move(640, 300, { steps: 3 });
  await page.mouse.up();
  assert.notEqual((await page.evaluate(shown)).sum, before.sum, "dragging moves the picture");
  await page.keyboard.down("Control");
  await page.mouse.wheel(0, -200);
  await page.keyboard.up("Control");
  assert.ok((await level()) > closer, "with Ctrl it zooms");
  await page.locator("#frame").focus();
  await page.keyboard.press("0");
  assert.equal(await level(), all);
  await close();
});

test("what will be saved is drawn on the mosaic", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await open(page, "mosaic");
  const cropped = await page.evaluate(shown);
  await page.selectOption("#save-crop", "whole");
  const whole = await page.evaluate(shown);
  assert.notEqual(whole.sum, cropped.sum, "a frame around the largest rectangle");
  await page.selectOption("#save-crop", "inner");
  assert.equal((await page.evaluate(shown)).sum, cropped.sum);
  await close();
});

test("tabs are walked by arrow keys", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await page.locator("#tab-mosaic").focus();
  await page.keyboard.press("End");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "tab-voids");
  await page.keyboard.press("ArrowRight");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "tab-mosaic");
  await page.keyboard.press("ArrowLeft");
  assert.equal(await page.locator("#tab-voids").getAttribute("aria-selected"), "true");
  assert.equal(
    await page.locator('[role="tab"][tabindex="0"]').count(),
    1,
    "one stop in the tab order",
  );
  await close();
});

test("holds the result against a homography, with a line that moves", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await open(page, "compare");
  const slider = page.getByRole("slider");
  await slider.fill("0");
  const after = await page.evaluate(shown);
  await slider.fill("1000");
  const before = await page.evaluate(shown);
  assert.notEqual(before.sum, after.sum);
  await slider.fill("500");
  const middle = await page.evaluate(shown);
  const box = await page.locator("#frame").boundingBox();
  assert.ok(box);
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 4, box.y + box.height / 2, { steps: 3 });
  await page.mouse.up();
  assert.ok(Math.abs(Number(await slider.inputValue()) - 250) < 20, "dragging the line moves it");
  const percent = Math.round(Number(await slider.inputValue()) / 10);
  assert.equal(parseInt((await slider.getAttribute("aria-valuetext")) ?? ""), percent);
  assert.notEqual((await page.evaluate(shown)).sum, middle.sum);
  await close();
});

/** The sum of what is shown as soon as it is not that any more: a picture is drawn a moment after the work is done. */
async function changedFrom(/** @type {number} */ before, /** @type {Page} */ page) {
  let { sum } = await page.evaluate(shown);
  for (let i = 0; i < 100 && sum === before; i++) {
    await page.waitForTimeout(100);
    ({ sum } = await page.evaluate(shown));
  }
  return sum;
}

test("a method that was cancelled leaves the comparison as it was, and can be chosen again", async () => {
  const { page, complaints, close } = await site.open({ files: smallCase });
  const select = page.locator("#view-controls select");
  await page.evaluate(cancelDuring, "Warping");
  await open(page, "compare");
  await page.locator('body[data-cancelled="Warping"]').waitFor();
  assert.equal(await select.inputValue(), "", "there is none yet");
  const { sum: alone } = await page.evaluate(shown);
  await select.selectOption("homography");
  await idle(page);
  const homography = await changedFrom(alone, page);

  await page.locator("body").evaluate((body) => delete body.dataset.cancelled);
  await page.evaluate(cancelDuring, "Warping");
  await select.selectOption("forward");
  await page.locator('body[data-cancelled="Warping"]').waitFor();
  await idle(page);
  assert.equal(await select.inputValue(), "homography");
  assert.equal((await page.evaluate(shown)).sum, homography);
  await select.selectOption("forward");
  await idle(page);
  assert.equal(await select.inputValue(), "forward");
  assert.notEqual(await changedFrom(homography, page), homography);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("blinks between the photos, and stands still for who prefers that", async () => {
  const moving = await site.open({ files: smallPhotos });
  await open(moving.page, "blink");
  const first = await moving.page.evaluate(shown);
  assert.notEqual(await changedFrom(first.sum, moving.page), first.sum);
  await moving.close();

  const still = await site.open({ files: smallPhotos, reducedMotion: "reduce" });
  await open(still.page, "blink");
  const photo = await still.page.evaluate(shown);
  const which = still.page.locator("#view-controls output");
  assert.match((await which.textContent()) ?? "", /^Second photo/);
  await still.page.waitForTimeout(800);
  assert.equal((await still.page.evaluate(shown)).sum, photo.sum);
  await still.page.getByRole("button", { name: "Other photo" }).click();
  assert.match((await which.textContent()) ?? "", /^First photo/);
  assert.notEqual((await still.page.evaluate(shown)).sum, photo.sum);
  await still.close();
});

test("matches can be shown by kind, with lines and over the depth", async () => {
  const { page, close } = await site.open({ files: smallCase });
  await open(page, "matches");
  let { sum } = await page.evaluate(shown);
  const seen = new Set([sum]);
  for (const label of ["Lines", "Outliers", "Inliers", "Depth"]) {
    await page.locator("#view-controls").getByLabel(label).click();
    sum = await changedFrom(sum, page);
    assert.ok(!seen.has(sum), `${label} changes the picture`);
    seen.add(sum);
  }
  await close();
});

test("compares the methods with PSNR, SSIM and coverage, and any of them with the result", async () => {
  const { page, complaints, close } = await site.open({ files: smallCase });
  await page.locator("#methods-panel > summary").click();
  await page.locator("#methods-run").click();
  await page.waitForFunction(() =>
    [...document.querySelectorAll(".method .agreement")].every((node) => node.textContent !== "…"),
  );
  const words = await page.locator(".method .agreement").allTextContents();
  assert.equal(words.length, 8);
  for (const agreement of words) {
    assert.match(agreement, /^\d+\.\d\d.dB · SSIM 0\.\d{3} · covers \d+.%$/);
  }
  assert.ok(new Set(words).size >= 6, "they differ");
  await page.locator(".method", { hasText: "Forward warp" }).getByRole("button").click();
  assert.equal(await page.locator("#tab-compare").getAttribute("aria-selected"), "true");
  await page.locator("#view-controls select").waitFor();
  assert.equal(await page.locator("#view-controls select").inputValue(), "forward");
  assert.deepEqual(await complaints(), []);
  await close();
});

test("what few views show of two large photos is made when such a view is opened", async () => {
  // More than 32 MP in both photos.
  const files = await largeExample(6);
  const { page, complaints, close } = await site.open({ hash: "#page.photoLimit=0" });
  page.setDefaultTimeout(300_000);
  await page.setInputFiles("#many-files", files);
  await page.locator("#status", { hasText: /^Done/ }).waitFor();
  // It can be cancelled, ends when the photos are removed, and can be asked for again.
  await page.evaluate(cancelDuring, "Detecting");
  await page.locator("#tab-warp").click();
  await page.locator("#message", { hasText: "Cancelled" }).waitFor();
  assert.match((await page.locator("#view-caption").textContent()) ?? "", /was cancelled/);
  const detecting = statusSays(page, /^Detecting/);
  await page.locator("#tab-warp").click();
  await detecting;
  await page.locator("#clear-inputs").click();
  await page.locator('#cancel[aria-disabled="true"]').waitFor({ state: "attached" });
  await page.locator("#undo-actions button").click();
  const sums = new Set();
  for (const id of ["mosaic", "warp", "seam", "depth"]) {
    await open(page, id);
    const { drawn, coloured, sum } = await page.evaluate(shown);
    assert.ok(drawn > 0.1 && coloured > 0.01, `${id}: ${drawn} drawn, ${coloured} coloured`);
    sums.add(sum);
  }
  assert.equal(sums.size, 4, "no two views look the same");
  assert.deepEqual(await complaints(), []);
  await close();
});

/** The example's photos so many times as wide and high. @param {number} times @returns {Promise<string[]>} their files */
function largeExample(times) {
  const photos = ["target.jpg", "reference.jpg"].map(async (name) => {
    const photo = await decodeImage(await readFile(exampleFile(name)));
    return written(name, await encodeJpeg(enlarged(photo, times)));
  });
  return Promise.all(photos);
}

/** A picture with each pixel as a square of so many. @param {{ width: number, height: number, data: Uint8ClampedArray }} picture @param {number} times */
function enlarged({ width, height, data }, times) {
  const small = new Uint32Array(data.buffer, data.byteOffset, width * height);
  const large = new Uint32Array(small.length * times * times);
  for (let y = 0, at = 0; y < height * times; y++) {
    const row = Math.floor(y / times) * width;
    for (let x = 0; x < width; x++) {
      large.fill(small[row + x] ?? 0, at, at + times);
      at += times;
    }
  }
  const pixels = new Uint8ClampedArray(large.buffer);
  return { width: width * times, height: height * times, data: pixels };
}

test("a picture that is too large to be drawn whole shows its own pixels when zoomed in", async () => {
  const files = await largeExample(3);
  const { page, complaints, close } = await site.open({ files });
  const picture = await savedPicture(page);
  assert.ok(picture.width * picture.height > 5e6);
  await page.locator("#frame").focus();
  for (let i = 0; i < 7; i++) await page.keyboard.press("+");
  /** Pixels around the middle of the picture, and the colours in the middle of the squares that show them. */
  const pixels = () =>
    page.evaluate(
      ({ width, height, steps }) => {
        const canvas = document.querySelector("#picture");
        const frame = document.querySelector("#frame");
        if (!(canvas instanceof HTMLCanvasElement) || !frame) throw new Error("no canvas");
        const copy = new OffscreenCanvas(canvas.width, canvas.height);
        const context = copy.getContext("2d", { willReadFrequently: true });
        context?.drawImage(canvas, 0, 0);
        const shown = context?.getImageData(0, 0, canvas.width, canvas.height).data;
        const fit = Math.min((frame.clientWidth - 16) / width, (frame.clientHeight - 16) / height);
        const scale = Math.min(32, fit * 1.5 ** steps);
        const at = (/** @type {number} */ i, /** @type {number} */ side) =>
          Math.round(side / 2 + (i + 0.5) * scale - 0.5);
        return Array.from({ length: 6000 }, (_, i) => {
          const [x, y] = [(i % 100) - 50, Math.floor(i / 100) - 30];
          const even = (/** @type {number} */ side) => (side % 2 === 0 ? 0 : -0.5);
          const [left, top] = [
            at(x + even(width), canvas.width),
            at(y + even(height), canvas.height),
          ];
          const first = 4 * (top * canvas.width + left);
          return {
            x: Math.floor(width / 2) + x,
            y: Math.floor(height / 2) + y,
            shown: [...(shown?.subarray(first, first + 3) ?? [])],
          };
        });
      },
      { width: picture.width, height: picture.height, steps: 7 },
    );
  const wrong = async () =>
    (await pixels()).filter(({ x, y, shown }) => {
      const there = picture.data.subarray(4 * (y * picture.width + x));
      return shown.some((level, c) => Math.abs((level ?? 0) - (there[c] ?? 0)) > 2);
    }).length;
  const end = Date.now() + 10_000;
  while ((await wrong()) > 0 && Date.now() < end) await page.waitForTimeout(100);
  assert.equal(await wrong(), 0, `zoomed to ${await page.locator("#zoom-level").textContent()}`);
  assert.deepEqual(await complaints(), []);
  await close();
});
