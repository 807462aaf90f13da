// What the browser tests share: the page, built from the present dist/ and served on localhost, in a fresh Chromium.
import assert from "node:assert/strict";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { build, preview } from "vite";
import { launch } from "../../js/tools/chromium.mjs";

/** @typedef {import("playwright-core").Page} Page */
/** @typedef {import("playwright-core").BrowserContextOptions} ContextOptions */

const www = fileURLToPath(new URL("../../www/", import.meta.url));

/** A file of the sample case. @param {string} name */
export const sampleFile = (name) => join(www, "public", "sample", name);

/** Builds and serves the page and starts a browser. */
export async function startSite() {
  if (!existsSync(sampleFile("case.json"))) {
    throw new Error("www/public/sample is missing: node js/tools/sample.mjs renders it");
  }
  const outDir = mkdtempSync(join(tmpdir(), "depthstitch-www-"));
  const config = /** @type {const} */ ({
    root: www,
    configFile: join(www, "vite.config.ts"),
    logLevel: "error",
    build: { outDir, emptyOutDir: true },
  });
  await build(config);
  const server = await preview({ ...config, preview: { host: "127.0.0.1", port: 0 } });
  const url = server.resolvedUrls?.local[0];
  if (!url) throw new Error("the preview server has no address");
  const browser = await launch();

  return {
    url,
    /**
     * A page that has finished its first run. `complaints` collects what must stay empty: console errors, uncaught
     * exceptions, violations of the content security policy, and requests to another host or without success.
     *
     * @param {ContextOptions} [options]
     */
    async open(options) {
      const context = await browser.newContext({
        viewport: { width: 1280, height: 900 },
        ...options,
      });
      const page = await context.newPage();
      const complaints = watch(page, url);
      await page.addInitScript(collectInPage);
      await page.goto(url);
      await finished(page);
      return { page, complaints: () => inPage(page, complaints), close: () => context.close() };
    },
    async close() {
      await browser.close();
      await new Promise((resolve) => server.httpServer.close(resolve));
      rmSync(outDir, { recursive: true });
    },
  };
}

/** Waits until a run has succeeded. @param {Page} page */
export async function finished(page) {
  await page.locator("#status", { hasText: /^Done in/ }).waitFor();
}

/** Starts a run and waits until it has succeeded. @param {Page} page */
export async function stitchAgain(page) {
  await page.locator("#run").click();
  // The status may still be that of the run before, so look for the end of this one.
  await page.locator('#run[aria-disabled="false"]').waitFor();
  await finished(page);
}

/** @param {Page} page @param {string} url */
function watch(page, url) {
  /** @type {string[]} */
  const complaints = [];
  page.on("console", (message) => {
    if (message.type() === "error" || message.type() === "warning") complaints.push(message.text());
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

/** The pixels of a canvas. @param {Page} page @param {string} selector */
export async function canvasPixels(page, selector) {
  const { width, height, base64 } = await page.locator(selector).evaluate(async (canvas) => {
    if (!(canvas instanceof HTMLCanvasElement)) throw new Error("no canvas");
    const { width, height } = canvas;
    // Read from a copy: reading moves a canvas out of the graphics memory, which a user's page never does.
    const copy = document.createElement("canvas");
    Object.assign(copy, { width, height });
    const context = copy.getContext("2d", { willReadFrequently: true });
    context?.drawImage(canvas, 0, 0);
    const image = context?.getImageData(0, 0, width, height);
    const blob = new Blob([image?.data ?? ""]);
    const url = await new Promise((/** @type {(url: string) => void} */ resolve) => {
      const reader = new FileReader();
      reader.onload = () => resolve(String(reader.result));
      reader.readAsDataURL(blob);
    });
    return { width, height, base64: url.slice(url.indexOf(",") + 1) };
  });
  const data = new Uint8ClampedArray(Buffer.from(base64, "base64"));
  return { data, width, height };
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
