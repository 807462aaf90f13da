// Accessibility and platform: keyboard, axe-core, both themes, narrow screens, content security policy, size, offline use.
import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { after, test } from "node:test";
import { gzipSync } from "node:zlib";
import {
  cancelDuring,
  exampleFile,
  finished,
  openPanel,
  savedPicture,
  seen,
  smallCase,
  smallFile,
  smallPhotos,
  startSite,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Three photos, of which the third is larger. */
const threePhotos = [...smallPhotos, exampleFile("target.jpg")];

/** What axe-core finds, of whatever impact. @param {Page} page */
async function violations(page) {
  const devtools = await page.context().newCDPSession(page);
  // Past the policy of the page, as a browser's own tools are.
  await devtools.send("Runtime.evaluate", { expression: axe });
  /** @type {{ violations: { id: string, impact: string, nodes: { html: string }[] }[] }} */
  const found = await page.evaluate("axe.run(document, { resultTypes: ['violations'] })");
  return found.violations.map(
    ({ id, impact, nodes }) =>
      `${id}, ${impact}: ${nodes.map(({ html }) => html.slice(0, 120)).join(" | ")}`,
  );
}

for (const colorScheme of /** @type {const} */ (["light", "dark"])) {
  test(`axe-core finds nothing in the ${colorScheme} theme`, async () => {
    const { page, close } = await site.open({ colorScheme });
    assert.deepEqual(await violations(page), [], "at the start");
    const ground = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const [red = 0] = (ground.match(/\d+/g) ?? []).map(Number);
    assert.ok(colorScheme === "dark" ? red < 60 : red > 200, `the ground is ${ground}`);

    await page.setInputFiles("#many-files", smallCase);
    await finished(page);
    for (const name of /** @type {const} */ (["depth", "fill", "options"])) {
      await openPanel(page, name);
    }
    await page.locator("#report-panel > summary").click();
    await page.locator("#methods-panel > summary").click();
    for (const summary of await page.locator("#options summary").all()) await summary.click();
    await page.setInputFiles("#targetDepth-file", smallFile("matches.csv"));
    await page.locator('[data-slot="targetDepth"] .bad').waitFor();
    assert.deepEqual(await violations(page), [], "with everything open");

    await page.setInputFiles("#add-files", [
      exampleFile("reference.jpg"),
      smallFile("matches.csv"),
    ]);
    await page.locator("#result-source", { hasText: "of 3 photos" }).waitFor();
    await page.locator("#pairs-panel > summary").click();
    await page.locator("#tab-seam").click();
    await page.locator(".swatches.names").waitFor();
    assert.deepEqual(await violations(page), [], "with three photos");
    assert.equal(await page.getByRole("group", { name: "Latest change" }).count(), 1);
    await page.locator("#pairs-panel > summary").focus();
    await page.keyboard.press("Tab");
    const focused = await page.evaluate(() => document.activeElement?.id);
    assert.equal(focused, "pairs", "what scrolls can be scrolled by keys");
    await close();
  });
}

test("the tab key reaches all controls in order, with visible focus", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await openPanel(page, "depth");
  await openPanel(page, "fill");
  await openPanel(page, "options");
  await page.locator(".skip-link").focus();
  /** @type {string[]} */
  const path = [];
  for (let i = 0; i < 80; i++) {
    await page.keyboard.press("Tab");
    const { name, outlined, visible } = await page.evaluate(() => {
      const element = document.activeElement;
      if (!(element instanceof HTMLElement) || element === document.body) {
        return { name: "", outlined: true, visible: true };
      }
      // A file input lends its focus ring to its label.
      const file = element instanceof HTMLInputElement && element.type === "file";
      const ringed = file ? (element.nextElementSibling ?? element) : element;
      const style = getComputedStyle(ringed);
      const box = ringed.getBoundingClientRect();
      return {
        name: element.id || element.getAttribute("name") || element.tagName.toLowerCase(),
        outlined: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1,
        visible: ringed.contains(
          document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2),
        ),
      };
    });
    if (name === "" || (i > 0 && name === path[0])) break;
    assert.ok(outlined, `${name} shows that it has the focus`);
    assert.ok(visible, `${name} is in view`);
    path.push(name);
  }
  const stops = [
    "load-sample",
    "target-file",
    "swap",
    "reference-file",
    "run",
    "cancel",
    "tab-mosaic",
    "frame",
    "zoom-in",
    "download-mosaic",
    "save-format",
    "save-crop",
    "download-report",
    "depth-source",
    "fill-method",
    "photo-limit",
    "matches-file",
    "option-mode",
  ];
  const places = stops.map((stop) => path.indexOf(stop));
  assert.ok(
    !places.includes(-1),
    `all of ${stops.join()} are reached; the path was ${path.join()}`,
  );
  assert.deepEqual(
    places,
    [...places].sort((a, b) => a - b),
    "in order",
  );
  await close();
});

test("headings go down one level at a time", async () => {
  const { page, close } = await site.open();
  const levels = () =>
    page.evaluate(() =>
      [...document.querySelectorAll("h1, h2, h3, h4, h5, h6")]
        .filter((heading) => heading.checkVisibility())
        .map((heading) => Number(heading.tagName.slice(1))),
    );
  const check = async (/** @type {string} */ when) => {
    const found = await levels();
    assert.equal(found[0], 1, when);
    for (const [i, level] of found.entries()) {
      assert.ok(level <= (found[i - 1] ?? 0) + 1, `${when}: ${found.join()}`);
    }
  };
  await check("at the start");
  await page.setInputFiles("#many-files", smallPhotos);
  await finished(page);
  for (const name of /** @type {const} */ (["depth", "fill", "options"])) {
    await openPanel(page, name);
  }
  await page.check('input[name="depth-source"][value="files"]');
  await page.locator("#methods-panel > summary").click();
  await page.locator("#methods-run").click();
  await page.locator(".method").first().waitFor();
  await check("with a result");
  await close();
});

test("what a finger is to hit is 44 px high at least", async () => {
  const { page, close } = await site.open({
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  const small = () =>
    page.evaluate(() => {
      const found = [];
      for (const element of document.querySelectorAll(
        'button, summary, select, input:not([type="file"]), .file-button > label, a[href]',
      )) {
        // A box or button is hit by its label as well.
        const inLabel = element instanceof HTMLInputElement && element.closest("label");
        const target = inLabel || element;
        const { width, height } = target.getBoundingClientRect();
        const shown = element.checkVisibility() && width > 1 && !element.matches(".skip-link");
        if (shown && (height < 43.9 || width < 43.9)) {
          found.push(`${element.id || element.textContent?.trim()}: ${width}×${height}`);
        }
      }
      return found;
    });
  assert.deepEqual(await small(), [], "at the start");
  await page.setInputFiles("#many-files", smallCase);
  await finished(page);
  for (const name of /** @type {const} */ (["depth", "fill", "options"])) {
    await openPanel(page, name);
  }
  for (const summary of await page.locator("#options summary").all()) await summary.click();
  await page.locator("#methods-panel > summary").click();
  await page.locator("#report-panel > summary").click();
  await page.locator("#tab-matches").click();
  await page.locator("#view-controls .check").first().waitFor();
  assert.deepEqual(await small(), [], "with a result");
  await page.setInputFiles("#add-files", exampleFile("target.jpg"));
  await page.locator("#result-source", { hasText: "of 3 photos" }).waitFor();
  assert.deepEqual(await small(), [], "with three photos");
  await close();
});

test("the page works by keyboard alone", async () => {
  const { page, close } = await site.open();
  await page.locator("#start-sample").focus();
  await page.evaluate(cancelDuring, { word: "Fitting", key: "Escape" });
  await page.keyboard.press("Enter");
  await page.locator("#status", { hasText: "Cancelled" }).waitFor();
  await page.locator("#run").focus();
  await page.keyboard.press("Enter");
  await finished(page);
  assert.equal(await page.evaluate(() => document.activeElement?.id), "run", "the focus stays");
  await close();
});

test("works in a worker without other hosts, policy violations or layout shifts", async () => {
  const { page, complaints, close } = await site.open();
  const atStart = (await seen(page)).shift;
  assert.ok(atStart < 0.02, `cumulative layout shift ${atStart} at the start`);
  // Two photos turn the page into a workbench; from then on everything stays in its place.
  const laidOut = page.evaluate(async () => {
    const { body } = document;
    await new Promise((/** @type {(value: void) => void} */ resolve) => {
      const observer = new MutationObserver(() => {
        if (body.dataset.phase === "work") resolve(observer.disconnect());
      });
      observer.observe(body, { attributes: true });
    });
    for (let i = 0; i < 2; i++) await new Promise(requestAnimationFrame);
  });
  await page.setInputFiles("#many-files", smallPhotos);
  await laidOut;
  const before = (await seen(page)).shift;
  await finished(page);
  await page.locator("#view-caption", { hasText: "pixels" }).waitFor();
  const policy = await page
    .locator('meta[http-equiv="Content-Security-Policy"]')
    .getAttribute("content");
  assert.match(policy ?? "", /script-src 'self' 'wasm-unsafe-eval'/);
  assert.doesNotMatch(policy ?? "", /unsafe-inline|'unsafe-eval'/);
  const shift = (await seen(page)).shift - before;
  assert.ok(shift < 0.02, `cumulative layout shift ${shift}`);
  assert.deepEqual(await complaints(), []);
  // The policy is in force: what it forbids does not run.
  await page.evaluate(() => {
    const script = document.createElement("script");
    script.textContent = "globalThis.injected = true";
    document.head.append(script);
  });
  assert.equal(await page.evaluate("globalThis.injected"), undefined);
  assert.equal((await seen(page)).violations.length, 1, "only the one that this test provoked");
  await close();
});

test("fits a phone without scrolling sideways", async () => {
  for (const width of [320, 390]) {
    const { page, close } = await site.open({
      viewport: { width, height: 844 },
      hasTouch: true,
      isMobile: true,
    });
    const widest = () => page.evaluate(() => document.documentElement.scrollWidth);
    assert.equal(await widest(), width, "at the start");
    await page.setInputFiles("#many-files", smallCase);
    await finished(page);
    for (const name of /** @type {const} */ (["depth", "fill", "options"])) {
      await openPanel(page, name);
    }
    await page.locator("#report-panel > summary").click();
    assert.equal(await widest(), width);
    const frame = await page.locator("#frame").boundingBox();
    assert.ok(frame && frame.x >= 0 && frame.x + frame.width <= width && frame.width > 0.9 * width);
    await close();

    const many = await site.open({
      viewport: { width, height: 844 },
      hasTouch: true,
      isMobile: true,
      files: threePhotos,
    });
    await many.page.locator("#pairs-panel > summary").click();
    const wide = await many.page.evaluate(() => document.documentElement.scrollWidth);
    assert.equal(wide, width, "with three photos");
    await many.close();
  }
});

test("a phone held sideways shows photos and result beside each other", async () => {
  const viewport = { width: 844, height: 390 };
  const { page, close } = await site.open({ viewport, hasTouch: true, isMobile: true });
  const start = await page.locator('label[for="many-files"]').boundingBox();
  assert.ok(start && start.y + start.height <= viewport.height, "the first button is in view");
  await page.setInputFiles("#many-files", smallPhotos);
  await finished(page);
  await page.evaluate(() => scrollTo(0, 0));
  const photos = await page.locator(".photo-cards").boundingBox();
  const frame = await page.locator("#frame").boundingBox();
  assert.ok(photos && frame && frame.x > photos.x + photos.width);
  assert.ok(frame.y + frame.height <= viewport.height && frame.height > 0.55 * viewport.height);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), viewport.width);
  await close();
});

test("loads in 299 KB, with what the page is for in two pictures", async () => {
  const { page, close } = await site.open();
  const pictures = page.locator(".difference img");
  await page.waitForFunction(() => [...document.images].every(({ complete }) => complete));
  const widths = await pictures.evaluateAll((images) =>
    images.map((image) => (image instanceof HTMLImageElement ? image.naturalWidth : 0)),
  );
  assert.deepEqual(widths, [400, 400]);
  /** @type {string[]} */
  const loaded = await page.evaluate(() =>
    performance
      .getEntriesByType("resource")
      .map(({ name }) => new URL(name).pathname.slice(1))
      .filter(Boolean),
  );
  const bytes = ["index.html", ...new Set(loaded)].map((name) => ({
    name,
    size: gzipSync(readFileSync(join(site.outDir, name)), { level: 9 }).length,
  }));
  const total = bytes.reduce((sum, { size }) => sum + size, 0);
  assert.ok(
    bytes.some(({ name }) => name.endsWith(".wasm")),
    "the core is among it",
  );
  assert.ok(!bytes.some(({ name }) => name.startsWith("sample/")), "the example is not");
  const list = bytes.map(({ name, size }) => `${name} ${(size / 1024).toFixed(1)}`).join(", ");
  console.log(`initial load: ${(total / 1024).toFixed(1)} KB gzipped (${list})`);
  assert.ok(total <= 299 * 1024, `${(total / 1024).toFixed(1)} KB: ${list}`);
  await close();
});

test("can be installed", async () => {
  const { page, complaints, close } = await site.open();
  const devtools = await page.context().newCDPSession(page);
  const { errors, data, url } = await devtools.send("Page.getAppManifest");
  assert.deepEqual(errors, []);
  const { name, display, start_url: start, icons } = JSON.parse(data ?? "");
  assert.deepEqual([name, display], ["depthstitch", "standalone"]);
  assert.equal(new URL(start, url).href, site.url);
  assert.ok((await page.request.get(new URL(icons[0].src, url).href)).ok());
  assert.deepEqual(await complaints(), []);
  await close();
});

test("once loaded it works offline", async () => {
  const own = await startSite();
  try {
    const { page, close } = await own.open({ serviceWorkers: "allow" });
    await page.locator("#offline", { hasText: "Works offline" }).waitFor();
    await own.stopServer();
    await page.reload();
    await page.locator("#version", { hasText: "depthstitch" }).waitFor();
    await page.setInputFiles("#many-files", smallCase);
    await finished(page);
    const picture = await savedPicture(page);
    assert.ok(picture.width > 240);
    await close();

    const cached = readFileSync(join(own.outDir, "service-worker.js"), "utf8");
    for (const file of readdirSync(join(own.outDir, "assets"))) {
      const large = /\bort[.-]|transformers/.test(file);
      assert.equal(cached.includes(file), !large, `${file} is ${large ? "not " : ""}cached ahead`);
    }
  } finally {
    await own.close().catch(() => undefined);
  }
});

test("the focus goes to the result when what was pressed at the start is gone", async () => {
  const { page, close } = await site.open();
  await page.locator("#many-files").focus();
  await page.setInputFiles("#many-files", smallPhotos);
  await finished(page);
  assert.equal(await page.evaluate(() => document.activeElement?.id), "results");
  await close();
});
