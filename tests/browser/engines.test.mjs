// The core path of the page in three engines: the example, two dropped photos, cancelling, every view, saving to the
// same bytes, files that end too soon, and all of it offline.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, test } from "node:test";
import { stitch } from "depthstitch";
import { decodeImage, encodeJpeg, encodePng } from "depthstitch/codecs";
import { engines, inTab, savedIn, until } from "./engines.mjs";
import {
  asOnCanvas,
  assertSame,
  cancelDuring,
  exampleFile,
  same,
  shown,
  smallPhotos,
  startSite,
} from "./page.mjs";

/** @typedef {import("./engines.mjs").Tab} Tab */

const site = await startSite();
after(() => site.close());

// Decoders of JPEG differ in their last bit, so the photos are PNGs.
const photos = await Promise.all(
  smallPhotos.map(async (path) => decodeImage(await readFile(path))),
);
const [target, reference] = photos;
assert.ok(target && reference);
const expected = await stitch(target, reference);
const files = await Promise.all(
  photos.map(async (photo, i) => ({
    name: `photo-${i + 1}.png`,
    base64: Buffer.from(await encodePng(photo)).toString("base64"),
  })),
);
const tinyWebp = Buffer.from("UklGRiIAAABXRUJQVlA4IBYAAAAwAQCdASoBAAEADsD+JaQAA3AAAAAA", "base64");
/** Without their second half. */
const halves = [
  { name: "half.jpg", bytes: await encodeJpeg(target) },
  { name: "half.png", bytes: await encodePng(target) },
  { name: "half.webp", bytes: tinyWebp },
].map(({ name, bytes }) => ({
  name,
  base64: Buffer.from(bytes.subarray(0, bytes.length / 2)).toString("base64"),
}));

for (const [name, open] of Object.entries(engines)) {
  test(name, async (t) => {
    const tab = await open();
    if (!tab) {
      t.skip(`${name} is not installed`);
      return;
    }
    const { url, stopServer } = await site.serveAgain();
    t.after(() => Promise.all([tab.close(), stopServer()]));
    await tab.go(url);
    await ready(tab);

    await t.test("stitches the example", async () => {
      const start = Date.now();
      await inTab(tab, press, "#start-sample");
      await done(tab);
      t.diagnostic(`${name}: the example took ${((Date.now() - start) / 1000).toFixed(1)} s`);
      const { width, height } = await savedMosaic(tab);
      const { width: least } = await decodeImage(await readFile(exampleFile("reference.jpg")));
      assert.ok(width > 1.1 * least && height > 100, `${width} × ${height}`);
    });

    await t.test("cancels a run with dropped photos, and runs again to Node's bytes", async () => {
      await inTab(tab, press, "#clear-inputs");
      await inTab(tab, cancelDuring, "Fitting");
      await inTab(tab, drop, files);
      await until(tab, says, "#status", "Cancelled");
      await until(tab, canRun);
      await inTab(tab, press, "#run");
      await done(tab);
      assertSame(asOnCanvas(await savedMosaic(tab)), asOnCanvas(expected.mosaic));
    });

    await t.test("shows every view", async () => {
      const ids = await inTab(tab, viewIds);
      assert.ok(ids.length >= 8, ids.join(" "));
      const sums = new Set();
      for (const id of ids) {
        await inTab(tab, press, `#${id}`);
        await until(tab, says, "#view-caption", ".");
        const { drawn, sum } = await inTab(tab, shown);
        assert.ok(drawn > 0.1, `${id}: ${drawn} drawn`);
        sums.add(sum);
      }
      assert.equal(sums.size, ids.length, "no two views look the same");
    });

    await t.test("refuses files that end before their picture does", async () => {
      for (const { name, base64 } of halves) {
        await inTab(tab, press, "#clear-inputs");
        await inTab(tab, drop, [{ name, base64 }]);
        await until(tab, says, "#target-note", `${name} is damaged: it ends`);
      }
    });

    await t.test("works offline", async (t) => {
      if (!(await inTab(tab, () => "serviceWorker" in navigator))) {
        t.skip(`${name} has no service workers here`);
        return;
      }
      await until(tab, says, "#offline", "Works offline");
      await stopServer();
      await tab.go(url);
      await ready(tab);
      await inTab(tab, drop, files);
      await done(tab);
      assert.ok(same(asOnCanvas(await savedMosaic(tab)), asOnCanvas(expected.mosaic)));
    });

    assert.deepEqual(await tab.evaluate("complaints"), []);
  });
}

/** Waits until the page has started, and collects what goes wrong in it from now on. @param {Tab} tab */
async function ready(tab) {
  await until(tab, says, "#version", "depthstitch");
  await inTab(tab, () => {
    /** @type {string[]} */
    const complaints = [];
    Object.assign(globalThis, { complaints });
    addEventListener("error", ({ message }) => void complaints.push(message));
    addEventListener("unhandledrejection", ({ reason }) => void complaints.push(String(reason)));
    document.addEventListener("securitypolicyviolation", (event) => {
      complaints.push(`${event.violatedDirective}: ${event.blockedURI}`);
    });
  });
}

/** Waits until a run has succeeded and nothing runs. @param {Tab} tab */
async function done(tab) {
  await until(tab, says, "#status", "Done");
  await until(tab, canRun);
}

/** The whole mosaic as the page saves it. @param {Tab} tab */
async function savedMosaic(tab) {
  await inTab(tab, () => {
    for (const [id, value] of [
      ["save-format", "png"],
      ["save-crop", "whole"],
    ]) {
      const select = document.querySelector(`#${id}`);
      if (!(select instanceof HTMLSelectElement)) throw new Error(`no ${id}`);
      select.value = value ?? "";
      select.dispatchEvent(new Event("change", { bubbles: true }));
    }
  });
  const { name, bytes } = await savedIn(tab, () => inTab(tab, press, "#download-mosaic"));
  assert.match(name, /-stitched\.png$/);
  return decodeImage(bytes);
}

// What follows runs in the page.

/** @param {string} selector */
function press(selector) {
  const element = document.querySelector(selector);
  if (!(element instanceof HTMLElement)) throw new Error(`no ${selector}`);
  element.click();
}

/** Whether an element's text contains some words. @param {string} selector @param {string} words */
function says(selector, words) {
  return document.querySelector(selector)?.textContent?.includes(words) ?? false;
}

function canRun() {
  return document.querySelector('#run[aria-disabled="false"]') !== null;
}

/** Drops files on the page, as the browser reports a drop. @param {{ name: string, base64: string }[]} files */
function drop(files) {
  const dataTransfer = new DataTransfer();
  for (const { name, base64 } of files) {
    const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
    dataTransfer.items.add(new File([bytes], name, { type: "image/png" }));
  }
  const options = { dataTransfer, bubbles: true, cancelable: true };
  for (const type of ["dragenter", "dragover", "drop"]) {
    document.body.dispatchEvent(new DragEvent(type, options));
  }
}

function viewIds() {
  const tabs = [...document.querySelectorAll('[role="tab"]')];
  return tabs.filter((tab) => tab.checkVisibility()).map(({ id }) => id);
}
