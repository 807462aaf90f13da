// What a user stumbled over once: nothing is lost, nothing is said where it cannot be seen or when it is no longer true.
import assert from "node:assert/strict";
import { after, test } from "node:test";
import { encodePng } from "depthstitch/codecs";
import {
  assertSame,
  drop,
  exampleFile,
  finished,
  idle,
  openPanel,
  savedPicture,
  scratchFolder,
  smallCase,
  smallFile,
  smallPhotos,
  startSite,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

const { written } = scratchFolder();

/** Whether an element is within the window. @param {Page} page @param {string} selector */
const inView = (page, selector) =>
  page.locator(selector).evaluate((element) => {
    const { top, bottom, height } = element.getBoundingClientRect();
    return height > 0 && top >= 0 && bottom <= innerHeight;
  });

test("the warnings badge and the skip link leave the settings alone", async () => {
  const { page, complaints, close } = await site.open({
    files: smallPhotos,
    hash: "#threshold=2.5&page.photoLimit=1536",
  });
  const settings = async () => [
    await page.inputValue("#option-threshold"),
    await page.inputValue("#photo-limit"),
    new URL(page.url()).hash,
  ];
  const before = await settings();
  assert.deepEqual(before.slice(0, 2), ["2.5", "1536"]);
  await page.locator("#warnings-link").click();
  assert.equal(await page.evaluate(() => document.activeElement?.id), "warnings-title");
  assert.ok(await inView(page, "#warnings-title"));
  await page.waitForTimeout(400);
  assert.deepEqual(await settings(), before);
  await page.locator(".skip-link").focus();
  await page.keyboard.press("Enter");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "results");
  await page.waitForTimeout(400);
  assert.deepEqual(await settings(), before);
  // A fragment that somebody wrote by hand is no settings either.
  await page.evaluate(() => void (location.hash = "#figures"));
  await page.waitForTimeout(400);
  assert.deepEqual((await settings()).slice(0, 2), ["2.5", "1536"]);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("what is wrong with a dropped text file is said in view, at the start and later", async () => {
  const { page, close } = await site.open();
  const notes = written("notes.txt", "no table");
  await drop(page, ".masthead", [notes]);
  await page.locator("#message", { hasText: "notes.txt cannot be used" }).waitFor();
  assert.ok(await inView(page, "#message"));
  await page.setInputFiles("#many-files", smallPhotos);
  await finished(page);
  assert.equal(await page.locator("#message").textContent(), "");
  await drop(page, ".masthead", [notes]);
  await page.locator("#message", { hasText: /notes\.txt cannot be used.*header/ }).waitFor();
  assert.ok(await inView(page, "#message"));
  await close();
});

test("what was ignored among dropped files is still said when the photos are stitched", async () => {
  const { page, close } = await site.open();
  const song = written("song.mp3", "la");
  await drop(page, ".masthead", [...smallPhotos, song]);
  await finished(page);
  assert.match((await page.locator("#message").textContent()) ?? "", /Ignored: song\.mp3/);
  await page.locator("#swap").click();
  await idle(page);
  await close();
});

test("an error of what was pressed far below comes into view", async () => {
  const { page, close } = await site.open({
    files: smallPhotos,
    viewport: { width: 390, height: 700 },
    hasTouch: true,
    isMobile: true,
  });
  await page.route("https://huggingface.co/**", (route) => route.abort());
  await openPanel(page, "depth");
  await page.check('input[name="depth-source"][value="model"]');
  await page.locator("#depth-estimate").click();
  await page.locator("#message", { hasText: /network could not be used/ }).waitFor();
  assert.ok(await inView(page, "#message"));
  await close();
});

test("an error of a network goes when the network is given up", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await page.route("https://huggingface.co/**", (route) => route.abort());
  await openPanel(page, "depth");
  await page.check('input[name="depth-source"][value="model"]');
  await page.locator("#depth-estimate").click();
  await page.locator("#message", { hasText: /network could not be used/ }).waitFor();
  await page.check('input[name="depth-source"][value="photos"]');
  assert.equal(await page.locator("#message").textContent(), "");
  await close();
});

test("a view that is being computed does not show the one before", async () => {
  // Large enough that the comparison, which takes a stitch of its own, is not there at once.
  const files = ["target.jpg", "reference.jpg"].map(exampleFile);
  const { page, close } = await site.open({ files });
  await page.locator("#view-caption", { hasText: "mosaic" }).waitFor();
  const drawn = await page.evaluate(async () => {
    const caption = document.querySelector("#view-caption");
    const canvas = document.querySelector("#picture");
    const tab = document.querySelector("#tab-compare");
    if (!caption || !(canvas instanceof HTMLCanvasElement) || !(tab instanceof HTMLElement)) {
      throw new Error("the page is incomplete");
    }
    /** @type {Promise<void>} */
    const computing = new Promise((resolve) => {
      const observer = new MutationObserver(() => {
        if (caption.textContent === "Computing…") resolve(observer.disconnect());
      });
      observer.observe(caption, { childList: true });
    });
    tab.click();
    await computing;
    for (let i = 0; i < 2; i++) await new Promise(requestAnimationFrame);
    const context = canvas.getContext("2d");
    return context?.getImageData(0, 0, canvas.width, canvas.height).data.some(Boolean);
  });
  assert.equal(drawn, false, "the mosaic is no comparison");
  await page.locator("#view-caption", { hasText: "the other method" }).waitFor();
  await close();
});

test("starting over, the example and another photo in a card can be undone", async () => {
  const { page, complaints, close } = await site.open({ files: smallCase });
  const first = await savedPicture(page);
  const undo = page.getByRole("button", { name: "Undo" });
  const back = () =>
    page.locator("#result-source", { hasText: /^target\.jpg onto reference\.jpg$/ }).waitFor();

  await page.locator("#clear-inputs").click();
  await page.locator("#undo-text", { hasText: "were removed" }).waitFor();
  assert.equal(await page.getAttribute("body", "data-phase"), "start");
  await undo.click();
  await back();
  assert.match((await page.locator("#depth-summary").textContent()) ?? "", /files/);
  assertSame(await savedPicture(page), first);

  await page.locator("#load-sample").click();
  await page.locator("#result-source", { hasText: "of the example" }).waitFor();
  await undo.click();
  await back();
  assertSame(await savedPicture(page), first);

  await page.setInputFiles("#target-file", smallFile("reference.jpg"));
  await page.locator("#undo-text", { hasText: "target.jpg was replaced." }).waitFor();
  await undo.click();
  await back();
  await finished(page);
  assertSame(await savedPicture(page), first);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("what takes no photo's place offers no way back, and settings chosen since are kept", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await drop(page, ".masthead", [smallFile("matches.csv")]);
  await page
    .locator('[data-slot="matches"] .file', { hasText: "matches.csv" })
    .waitFor({ state: "attached" });
  await page.waitForTimeout(200);
  assert.equal(await page.locator("#undo-text").textContent(), "");

  await page.locator("#clear-inputs").click();
  await page.evaluate(() => void (location.hash = "#seed=7"));
  await page.locator("#options-summary", { hasText: "1 changed" }).waitFor({ state: "attached" });
  await page.getByRole("button", { name: "Undo" }).click();
  await idle(page);
  await finished(page);
  assert.equal(await page.inputValue("#option-seed"), "7");
  await close();
});

test("a long photo that is reduced to a strip is said to be, and where to change it", async () => {
  const { page, close } = await site.open();
  const data = new Uint8ClampedArray(4 * 9000 * 900).fill(200);
  const long = written("long.png", await encodePng({ data, width: 9000, height: 900 }));
  await page.setInputFiles("#target-file", long);
  await page
    .locator('[data-slot="target"] [data-part="note"]', {
      hasText: /Used at 2048.×.205 only.*under Options/,
    })
    .waitFor();
  await page.setInputFiles("#add-files", smallPhotos);
  await page.locator(".tile .note", { hasText: /Used at 2048.×.205 only/ }).waitFor();
  await close();
});
