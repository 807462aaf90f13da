// What the browser tests share: the page, built from the present dist/ and served on localhost, in a fresh Chromium.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after } from "node:test";
import { fileURLToPath } from "node:url";
import { decodeImage } from "depthstitch/codecs";
import { build, preview } from "vite";
import { launch } from "../../js/tools/chromium.mjs";
import { renderSample } from "../../js/tools/sample.mjs";
import { root } from "../../js/tools/shared.mjs";

/** @typedef {import("playwright-core").Page} Page */
/** @typedef {import("playwright-core").BrowserContextOptions} ContextOptions */

const www = fileURLToPath(new URL("../../www/", import.meta.url));

/** A file of the example that the page brings along. @param {string} name */
export const exampleFile = (name) => join(www, "public", "sample", name);

/** A file of the same scene, small enough to be stitched many times. @param {string} name */
export const smallFile = (name) => join(root, "target", "sample-small", name);

/** The two photos alone. */
export const smallPhotos = ["target.jpg", "reference.jpg"].map(smallFile);

/** A folder that is gone after the tests, and what makes a file in it. */
export function scratchFolder() {
  const scratch = mkdtempSync(join(tmpdir(), "depthstitch-test-"));
  after(() => rmSync(scratch, { recursive: true }));
  /** A new file. @param {string} name @param {string | Uint8Array} content */
  const written = (name, content) => {
    const path = join(scratch, name);
    writeFileSync(path, content);
    return path;
  };
  return { scratch, written };
}

/** All files of the small case: photos, depth maps, matches, and what the depth maps mean. */
export const smallCase = [
  ...smallPhotos,
  ...["target_depth.png", "reference_depth.png", "matches.csv", "case.json"].map(smallFile),
];

/** Builds and serves the page and starts a browser. */
export async function startSite() {
  await renderSample();
  await renderSample(join("target", "sample-small"), 240, 160);
  const outDir = mkdtempSync(join(tmpdir(), "depthstitch-www-"));
  const config = /** @type {const} */ ({
    root: www,
    configFile: join(www, "vite.config.ts"),
    logLevel: "error",
    build: { outDir, emptyOutDir: true },
  });
  await build(config);
  const { url, stopServer } = await serve(config);
  const browser = await launch();

  return {
    url,
    outDir,
    stopServer,
    /** Serves the page once more, under another address. */
    serveAgain: () => serve(config),
    /**
     * A page that is ready, with these files loaded and stitched if there are any. `complaints` collects what must stay
     * empty: console errors, uncaught exceptions, violations of the content security policy, and requests to another
     * host or without success.
     *
     * @param {ContextOptions & { files?: readonly string[], hash?: string }} [options]
     */
    async open({ files = [], hash = "", ...options } = {}) {
      const context = await browser.newContext({
        viewport: { width: 1280, height: 900 },
        // A request that a service worker answers cannot be watched.
        serviceWorkers: "block",
        ...options,
      });
      const page = await context.newPage();
      const complaints = watch(page, url);
      await page.addInitScript(collectInPage);
      await page.goto(url + hash);
      await page.locator("#version", { hasText: "depthstitch" }).waitFor();
      if (files.length > 0) {
        await page.setInputFiles("#many-files", [...files]);
        await finished(page);
      }
      return { page, complaints: () => inPage(page, complaints), close: () => context.close() };
    },
    async close() {
      await browser.close();
      await stopServer();
      rmSync(outDir, { recursive: true });
    },
  };
}

/** Serves the built page on a port of its own. @param {import("vite").InlineConfig} config */
async function serve(config) {
  const server = await preview({ ...config, preview: { host: "127.0.0.1", port: 0 } });
  const url = server.resolvedUrls?.local[0];
  if (!url) throw new Error("the preview server has no address");
  const stopServer = () =>
    new Promise((resolve) => {
      server.httpServer.close(resolve);
      if ("closeAllConnections" in server.httpServer) server.httpServer.closeAllConnections();
    });
  return { url, stopServer };
}

/** Waits until a run has succeeded. @param {Page} page */
export async function finished(page) {
  await page.locator("#status", { hasText: /^Done/ }).waitFor();
}

/**
 * Resolves as soon as the status matches. For what soon passes, and so watched in the page: a locator may look only
 * every half second. To be called before what makes the status say so.
 *
 * @param {Page} page
 * @param {RegExp} words
 */
export function statusSays(page, words) {
  return page.evaluate(
    (source) =>
      new Promise((/** @type {(value: void) => void} */ resolve, reject) => {
        const status = document.querySelector("#status");
        const look = () => {
          if (!new RegExp(source).test(status?.textContent ?? "")) return;
          observer.disconnect();
          resolve();
        };
        const observer = new MutationObserver(look);
        if (status)
          observer.observe(status, { childList: true, characterData: true, subtree: true });
        look();
        setTimeout(() => reject(new Error(`the status never said ${source}`)), 30_000);
      }),
    words.source,
  );
}

/**
 * Records what an element says from now on. Returns what gives it.
 *
 * @param {Page} page @param {string} selector
 */
export async function recorded(page, selector) {
  const words = await page.evaluateHandle((selector) => {
    const words = /** @type {string[]} */ ([]);
    const element = document.querySelector(selector);
    if (!element) throw new Error(`the page has no ${selector}`);
    const listen = () => void words.push(element.textContent ?? "");
    new MutationObserver(listen).observe(element, { childList: true });
    return words;
  }, selector);
  return () => words.jsonValue();
}

/**
 * In the page: has Cancel pressed, or a key, as soon as the status begins with this word, and says so.
 *
 * @param {string | { word: string, key: string }} when
 */
export function cancelDuring(when) {
  const { word, key } = typeof when === "string" ? { word: when, key: "" } : when;
  const status = document.querySelector("#status");
  const cancel = document.querySelector("#cancel");
  const observer = new MutationObserver(() => {
    if (!status?.textContent?.startsWith(word)) return;
    observer.disconnect();
    if (key) document.dispatchEvent(new KeyboardEvent("keydown", { key }));
    else if (cancel instanceof HTMLElement) cancel.click();
    document.body.dataset.cancelled = word;
  });
  if (status) observer.observe(status, { childList: true, characterData: true, subtree: true });
}

/** Starts a run and waits until it has succeeded. @param {Page} page */
export async function stitchAgain(page) {
  await page.locator("#run").click();
  await idle(page);
  await finished(page);
}

/** Waits until nothing runs. @param {Page} page */
export async function idle(page) {
  // The run may not have begun yet.
  await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 50)));
  await page.locator('#run[aria-disabled="false"]').waitFor();
}

/** Opens a view and waits until it is there. @param {Page} page @param {string} name */
export async function openView(page, name) {
  await page.locator(`#tab-${name}`).click();
  await page.locator("#view-caption", { hasText: /\w.*\./ }).waitFor();
}

/** Opens a part of the settings. @param {Page} page @param {"depth" | "fill" | "options"} name */
export async function openPanel(page, name) {
  await page.locator(`#${name}-panel > summary`).click();
}

/**
 * The picture as the page saves it, whole and as PNG.
 *
 * @param {Page} page
 * @param {"mosaic" | "warped"} [which]
 */
export async function savedPicture(page, which = "mosaic") {
  await page.selectOption("#save-format", "png");
  await page.selectOption("#save-crop", "whole");
  return decodeImage((await saved(page, `#download-${which}`)).bytes);
}

/** What a button saves. @param {Page} page @param {string} button */
export async function saved(page, button) {
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.locator(button).click(),
  ]);
  return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
}

/**
 * A file as the browser decodes it, at the size that its pixels are drawn to: JPEG decoders differ in their last bit.
 *
 * @param {Page} page
 * @param {string} path
 * @returns {Promise<Picture>}
 */
export async function decodedByBrowser(page, path) {
  const file = (await readFile(path)).toString("base64");
  const { width, height, base64 } = await page.evaluate(async (file) => {
    const bytes = Uint8Array.from(atob(file), (character) => character.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes]));
    const { width, height } = bitmap;
    const canvas = new OffscreenCanvas(width, height);
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context?.drawImage(bitmap, 0, 0);
    const image = context?.getImageData(0, 0, width, height);
    const url = await new Promise((/** @type {(url: string) => void} */ resolve) => {
      const reader = new FileReader();
      reader.onload = () => resolve(String(reader.result));
      reader.readAsDataURL(new Blob([image?.data ?? ""]));
    });
    return { width, height, base64: url.slice(url.indexOf(",") + 1) };
  }, file);
  return { data: new Uint8ClampedArray(Buffer.from(base64, "base64")), width, height };
}

/** @param {Page} page @param {string} url */
function watch(page, url) {
  /** @type {string[]} */
  const complaints = [];
  page.on("console", (message) => {
    const { type, text } = { type: message.type(), text: message.text() };
    if (text === "Service Worker registration blocked by Playwright") return;
    if (type === "error" || type === "warning") complaints.push(text);
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => {
    const outside = !request.url().startsWith(url) && !request.url().startsWith("blob:");
    if (outside) complaints.push(`request to ${request.url()}`);
  });
  page.on("response", (response) => {
    if (!response.ok()) complaints.push(`${response.status()} for ${response.url()}`);
  });
  return complaints;
}

/** Runs in the page before its own scripts: violations and layout shifts happen early. */
function collectInPage() {
  const seen = { violations: /** @type {string[]} */ ([]), shift: 0 };
  Object.assign(globalThis, { seen });
  document.addEventListener("securitypolicyviolation", (event) => {
    seen.violations.push(`${event.violatedDirective}: ${event.blockedURI}`);
  });
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) {
      if ("value" in entry && "hadRecentInput" in entry && !entry.hadRecentInput)
        seen.shift += Number(entry.value);
    }
  }).observe({ type: "layout-shift", buffered: true });
}

/** @param {Page} page @returns {Promise<{ violations: string[], shift: number }>} */
export function seen(page) {
  return page.evaluate("seen");
}

/** @param {Page} page @param {string[]} complaints */
async function inPage(page, complaints) {
  return [...complaints, ...(await seen(page)).violations];
}

/**
 * Fails unless two pictures are the same; the arrays are too large for `assert` to print.
 *
 * @typedef {{ data: Uint8ClampedArray, width: number, height: number }} Picture
 * @param {Picture} actual
 * @param {Picture} expected
 * @param {string} [what]
 */
export function assertSame(actual, expected, what = "the picture") {
  assert.deepEqual(
    [actual.width, actual.height],
    [expected.width, expected.height],
    `size of ${what}`,
  );
  assert.ok(same(actual, expected), `${what} has other pixels`);
}

/** @param {Picture} a @param {Picture} b */
export function same(a, b) {
  return Buffer.from(a.data.buffer).equals(Buffer.from(b.data.buffer));
}

/** A picture as a canvas keeps it: no colour where it is transparent. @param {Picture} picture @returns {Picture} */
export function asOnCanvas({ data, width, height }) {
  return { data: data.map((value, i) => (data[i | 3] === 0 ? 0 : value)), width, height };
}

/**
 * Drops files or folders of this machine on the middle of an element, as a file manager would. `over` is called while
 * they are held there.
 *
 * @param {Page} page
 * @param {string} selector
 * @param {readonly string[]} paths
 * @param {() => Promise<void>} [over]
 */
export async function drop(page, selector, paths, over) {
  const box = await page.locator(selector).boundingBox();
  if (!box) throw new Error(`${selector} is not shown`);
  const devtools = await page.context().newCDPSession(page);
  for (const type of /** @type {const} */ (["dragEnter", "dragOver", "drop"])) {
    if (type === "drop") await over?.();
    await devtools.send("Input.dispatchDragEvent", {
      type,
      x: box.x + box.width / 2,
      y: box.y + box.height / 2,
      data: { items: [], files: [...paths], dragOperationsMask: 1 },
    });
  }
}

/**
 * What the viewer shows: the share of its pixels that are drawn at all, and of those in colour, and a sum that changes
 * with any of them. To be run in the page.
 */
export async function shown() {
  const canvas = document.querySelector("#picture");
  if (!(canvas instanceof HTMLCanvasElement)) throw new Error("no canvas");
  // Two frames: one in which a change is asked for, one in which it is drawn.
  for (let i = 0; i < 2; i++) await new Promise(requestAnimationFrame);
  const copy = new OffscreenCanvas(canvas.width, canvas.height);
  const context = copy.getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error("no context");
  context.drawImage(canvas, 0, 0);
  const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
  let [drawn, coloured, sum] = [0, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    const [red = 0, green = 0, blue = 0, alpha = 0] = data.subarray(i, i + 4);
    if (alpha === 0) continue;
    drawn++;
    if (Math.max(red, green, blue) - Math.min(red, green, blue) > 8) coloured++;
    sum = (sum * 31 + red * 7 + green * 3 + blue) % 1e9;
  }
  const pixels = data.length / 4;
  return { drawn: drawn / pixels, coloured: coloured / pixels, sum };
}
