// The page as it opens: the sample stitched in a worker, shown, reported and ready to be saved.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { decodeDepth, decodeImage } from "depthstitch/codecs";
import { stitch } from "depthstitch";
import { asOnCanvas, assertSame, canvasPixels, sampleFile, seen, startSite } from "./page.mjs";

/** @type {Awaited<ReturnType<typeof startSite>>} */
let site;
before(async () => {
  site = await startSite();
});
after(() => site.close());

/** A photo of the sample as the browser decodes it: JPEG decoders differ in their last bit. @param {import("./page.mjs").Page} page @param {string} name */
async function decodedByBrowser(page, name) {
  await page.evaluate(async (name) => {
    const bitmap = await createImageBitmap(await (await fetch(`sample/${name}`)).blob());
    const canvas = document.createElement("canvas");
    canvas.id = "decoded";
    canvas.width = bitmap.width;
    canvas.height = bitmap.height;
    canvas.getContext("2d", { willReadFrequently: true })?.drawImage(bitmap, 0, 0);
    document.getElementById("decoded")?.remove();
    document.body.append(canvas);
  }, name);
  return canvasPixels(page, "#decoded");
}

/** The sample stitched by Node, from the photos as the browser sees them. @param {import("./page.mjs").Page} page */
async function stitchedByNode(page) {
  const { depth } = JSON.parse(await readFile(sampleFile("case.json"), "utf8"));
  const map = async (/** @type {string} */ name) => ({
    ...(await decodeDepth(await readFile(sampleFile(name)))),
    kind: depth.kind,
    invalid: depth.invalid,
  });
  const lines = (await readFile(sampleFile("matches.csv"), "utf8")).trim().split("\n").slice(1);
  return stitch(
    await decodedByBrowser(page, "target.jpg"),
    await decodedByBrowser(page, "reference.jpg"),
    {
      matches: new Float32Array(lines.flatMap((line) => line.split(",").map(Number))),
      targetDepth: await map("target_depth.png"),
      referenceDepth: await map("reference_depth.png"),
    },
  );
}

test("opens with the sample stitched, byte for byte what Node makes of the same pixels", async () => {
  const { page, complaints, close } = await site.open();
  const expected = await stitchedByNode(page);
  for (const name of /** @type {const} */ (["mosaic", "warped"])) {
    const shown = await canvasPixels(page, `#${name}`);
    assert.ok(
      shown.width > 100 && shown.height > 100 && coloured(shown.data) > 0.02,
      "there is a picture",
    );
    assertSame(shown, asOnCanvas(expected[name]), name);
  }

  const inliers = await page.locator('[data-figure="inliers"]').textContent();
  assert.equal(inliers, `${expected.report.inliers} / ${expected.report.usable}`);
  const quality = expected.quality;
  assert.equal(
    await page.locator('[data-figure="psnr"]').textContent(),
    `${quality.psnrMask.toFixed(2)}\u00a0dB`,
  );
  for (const figure of ["psnr", "ssim"]) {
    assert.match(
      (await page.locator(`[data-under="${figure}"]`).textContent()) ?? "",
      new RegExp(`^over ${(100 * quality.coverage).toFixed(0)}`),
      "never without coverage",
    );
  }
  assert.deepEqual(
    await page.locator("#warnings li").allTextContents(),
    expected.report.warnings.map(({ message }) => message),
  );
  assert.deepEqual(await complaints(), []);
  await close();
});

test("works in a worker, asks no other host, breaks no policy and does not jump", async () => {
  const { page, complaints, close } = await site.open();
  assert.equal(page.workers().length, 1);
  const policy = await page
    .locator('meta[http-equiv="Content-Security-Policy"]')
    .getAttribute("content");
  assert.match(policy ?? "", /script-src 'self' 'wasm-unsafe-eval'/);
  assert.doesNotMatch(policy ?? "", /unsafe-inline|'unsafe-eval'|https?:/);
  // The policy is in force: what it forbids does not run.
  await page.evaluate(() => {
    const script = document.createElement("script");
    script.textContent = "globalThis.injected = true";
    document.head.append(script);
  });
  assert.equal(await page.evaluate("globalThis.injected"), undefined);
  const { violations, shift } = await seen(page);
  assert.equal(violations.length, 1, "only the one that this test provoked");
  assert.ok(shift < 0.02, `cumulative layout shift ${shift}`);
  assert.ok((await complaints()).every((text) => /script-src/.test(text)));
  await close();
});

test("shows both photos, both depth maps in colour and the matches", async () => {
  const { page, close } = await site.open();
  for (const slot of ["target", "reference", "targetDepth", "referenceDepth", "matches"]) {
    const { data } = await canvasPixels(page, `[data-slot="${slot}"] canvas`);
    assert.ok(coloured(data) > 0.02, `${slot} is drawn in colour`);
  }
  assert.match((await page.locator('[data-slot="targetDepth"]').textContent()) ?? "", /16 bit/);
  await close();
});

/** Share of pixels that are neither gray nor transparent. @param {Uint8ClampedArray} data */
function coloured(data) {
  let count = 0;
  for (let i = 0; i < data.length; i += 4) {
    const [red = 0, green = 0, blue = 0, alpha = 0] = data.subarray(i, i + 4);
    if (alpha > 0 && Math.max(red, green, blue) - Math.min(red, green, blue) > 8) count++;
  }
  return (4 * count) / data.length;
}

test("saves mosaic and warped target as PNG and the report as JSON", async () => {
  const { page, close } = await site.open();
  for (const name of ["mosaic", "warped"]) {
    const png = await saved(page, `#download-${name}`, `${name}.png`);
    const image = await decodeImage(png);
    const shown = await canvasPixels(page, `#${name}`);
    assertSame(asOnCanvas(image), shown, `${name}.png`);
  }
  const report = JSON.parse((await saved(page, "#download-report", "report.json")).toString());
  assert.equal(report.forward.h.length, 9);
  assert.equal(report.inliers.length, report.report.matches);
  assert.ok(report.quality.coverage > 0 && report.quality.coverage <= 1);
  await close();
});

/** @param {import("./page.mjs").Page} page @param {string} button @param {string} name */
async function saved(page, button, name) {
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.locator(button).click(),
  ]);
  assert.equal(download.suggestedFilename(), name);
  return readFile(await download.path());
}

test("follows the system's theme, with readable contrast in both", async () => {
  for (const colorScheme of /** @type {const} */ (["light", "dark"])) {
    const { page, close } = await site.open({ colorScheme });
    const lightness = await page.evaluate(() => {
      const { backgroundColor, color } = getComputedStyle(document.body);
      const muted = getComputedStyle(document.querySelector(".hint") ?? document.body).color;
      return [backgroundColor, color, muted].map((rgb) => {
        const [r = 0, g = 0, b = 0] = (rgb.match(/[\d.]+/g) ?? []).map((value) => {
          const c = Number(value) / 255;
          return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
        });
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
      });
    });
    const [ground = 0, ...inks] = lightness;
    assert.ok(colorScheme === "dark" ? ground < 0.05 : ground > 0.8, `${colorScheme} ground`);
    for (const ink of inks) {
      const contrast = (Math.max(ground, ink) + 0.05) / (Math.min(ground, ink) + 0.05);
      assert.ok(contrast >= 4.5, `${colorScheme}: contrast ${contrast.toFixed(1)}`);
    }
    await close();
  }
});

test("fits a phone without scrolling sideways", async () => {
  for (const width of [320, 390]) {
    const { page, close } = await site.open({ viewport: { width, height: 844 }, hasTouch: true });
    await page.locator("summary").click();
    const widest = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.equal(widest, width);
    const mosaic = await page.locator("#mosaic").boundingBox();
    assert.ok(
      mosaic && mosaic.x >= 0 && mosaic.x + mosaic.width <= width && mosaic.width > 0.8 * width,
    );
    await close();
  }
});
