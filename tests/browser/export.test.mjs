// Export: images as PNG and JPEG, whole and cropped, the report, and a link to the settings.
import assert from "node:assert/strict";
import { after, test } from "node:test";
import { decodeImage } from "depthstitch/codecs";
import {
  finished,
  openPanel,
  saved,
  savedPicture,
  smallCase,
  smallPhotos,
  startSite,
} from "./page.mjs";

const site = await startSite();
after(() => site.close());

test("saves the mosaic whole with transparency, or cropped without", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const whole = await savedPicture(page);
  assert.ok(transparent(whole) > 0.01, "the canvas has empty corners");

  await page.selectOption("#save-crop", "inner");
  const png = await saved(page, "#download-mosaic");
  assert.equal(png.name, "target_reference-stitched.png");
  const inner = await decodeImage(png.bytes);
  assert.equal(transparent(inner), 0);
  assert.ok(inner.width * inner.height > 0.5 * whole.width * whole.height);
  assert.match(
    (await page.locator("#export-status").textContent()) ?? "",
    /Saved target_reference-stitched, \d+ × \d+/,
  );

  await page.selectOption("#save-format", "jpeg");
  const jpeg = await saved(page, "#download-mosaic");
  assert.equal(jpeg.name, "target_reference-stitched.jpg");
  assert.deepEqual([...jpeg.bytes.subarray(0, 2)], [0xff, 0xd8]);
  const { width, height } = await decodeImage(jpeg.bytes);
  assert.deepEqual([width, height], [inner.width, inner.height]);
  await close();
});

/** Share of pixels without a picture. @param {{ data: Uint8ClampedArray }} image */
function transparent({ data }) {
  let count = 0;
  for (let i = 3; i < data.length; i += 4) if (data[i] === 0) count++;
  return (4 * count) / data.length;
}

test("says beside Save what size it has, and what full size would give and take", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const words = () => page.locator("#save-size").textContent();
  const size = (/** @type {string | null} */ text) =>
    text
      ?.match(/(\d+).×.(\d+) pixels/)
      ?.slice(1)
      .map(Number);
  assert.ok(!(await page.locator("#full-size").isVisible()), "the photos are used whole");
  await page.selectOption("#save-crop", "whole");
  const full = size(await words());
  const picture = await savedPicture(page);
  assert.deepEqual(full, [picture.width, picture.height]);
  await page.selectOption("#save-crop", "inner");
  assert.notDeepEqual(size(await words()), full);

  await openPanel(page, "options");
  await page.evaluate(() => void (location.hash = "#page.photoLimit=160"));
  await page
    .locator("#save-size", { hasText: /downscaled to 67.%; at full size.*about \d+.s/ })
    .waitFor();
  const offered = size((await words())?.split("at full size")[1] ?? "");
  await page.locator("#full-size").click();
  await page.locator("#full-size").waitFor({ state: "hidden" });
  const [width = 0] = size(await words()) ?? [];
  assert.ok(Math.abs(width / (offered?.[0] ?? 0) - 1) < 0.15, `${width} for ${offered}`);
  assert.equal(await page.inputValue("#photo-limit"), "0");
  await close();
});

test("copies the picture, and shares it where the browser can", async () => {
  const { page, close } = await site.open({
    files: smallPhotos,
    permissions: ["clipboard-read", "clipboard-write"],
  });
  const whole = await savedPicture(page);
  await page.locator("#copy-mosaic").click();
  await page.locator("#export-status", { hasText: /^Copied, \d+ × \d+/ }).waitFor();
  const [width, height] = await page.evaluate(async () => {
    const [item] = await navigator.clipboard.read();
    const bitmap = await createImageBitmap((await item?.getType("image/png")) ?? new Blob());
    return [bitmap.width, bitmap.height];
  });
  assert.deepEqual([width, height], [whole.width, whole.height]);
  await close();

  const phone = await site.open();
  await phone.page.evaluate(() => {
    Object.assign(navigator, {
      canShare: () => true,
      share: (/** @type {{ files: File[] }} */ { files }) => {
        document.body.dataset.shared = `${files[0]?.name} ${files[0]?.type}`;
        return Promise.resolve();
      },
    });
  });
  await phone.page.setInputFiles("#many-files", smallPhotos);
  await finished(phone.page);
  await phone.page.locator("#share-mosaic").click();
  await phone.page
    .locator('body[data-shared="target_reference-stitched.jpg image/jpeg"]')
    .waitFor();
  await phone.close();
});

test("asks before it is left with a result that was not saved", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  // Browsers ask only about pages that were used.
  await page.locator("#tab-compare").click();
  const asked = new Promise((resolve) => {
    page.once("dialog", (dialog) => void dialog.dismiss().then(() => resolve(dialog.type())));
  });
  await page.close({ runBeforeUnload: true });
  assert.equal(await asked, "beforeunload");
  await finished(page);

  await savedPicture(page);
  const closed = page.waitForEvent("close");
  await page.close({ runBeforeUnload: true });
  await closed;
  await close();
});

test("saves the report", async () => {
  const { page, close } = await site.open({ files: smallCase });
  const { name, bytes } = await saved(page, "#download-report");
  assert.equal(name, "target_reference-report.json");
  const report = JSON.parse(bytes.toString());
  assert.equal(report.forward.h.length, 9);
  assert.equal(report.inliers.length, report.report.matches);
  assert.equal(report.matches.length, 4 * report.report.matches);
  assert.equal(report.inputs.target, "target.jpg");
  assert.ok(report.quality.coverage > 0 && report.quality.coverage <= 1);
  assert.ok(report.times.warp > 0);
  assert.equal(report.projection, "plane");
  assert.ok(report.crop.inner.width <= report.crop.bounds.width);
  assert.equal(report.gains.length, 3);
  await close();
});

test("the URL contains the settings and restores them", async () => {
  const { page, close } = await site.open({
    files: smallPhotos,
    permissions: ["clipboard-read", "clipboard-write"],
  });
  await openPanel(page, "options");
  await page.locator("#options summary", { hasText: "Geometry" }).click();
  await page.fill("#option-threshold", "2.5");
  await page.locator("#option-threshold").blur();
  await page.selectOption("#photo-limit", "1536");
  await openPanel(page, "fill");
  await page.check('input[name="fill-method"][value="migan"]');
  await page.locator("#copy-link").click();
  await page.locator("#export-status", { hasText: "copied" }).waitFor();
  const link = await page.evaluate(() => navigator.clipboard.readText());
  await page.waitForFunction((link) => location.href === link, link);
  await close();

  const again = await site.open({ hash: new URL(link).hash, files: smallPhotos });
  assert.equal(await again.page.inputValue("#option-threshold"), "2.5");
  assert.equal(await again.page.inputValue("#photo-limit"), "1536");
  assert.ok(
    await again.page.isChecked('input[name="fill-method"][value="core"]'),
    "a link must not cause downloads of networks",
  );
  assert.deepEqual(await again.complaints(), []);
  await again.close();

  const odd = await site.open({
    // Of these only the seed is valid; `constructor` is a property of every object.
    hash: "#threshold=x&nonsense=1&constructor=1&seed=7&page.photoLimit=-3&page.depthKind=z",
  });
  await odd.page.setInputFiles("#target-file", smallPhotos.slice(0, 1));
  await odd.page
    .locator("#options-summary", { hasText: "1 changed" })
    .waitFor({ state: "attached" });
  assert.equal(await odd.page.inputValue("#photo-limit"), "2048");
  assert.deepEqual(await odd.complaints(), []);
  await odd.close();
});

test("says what it prepares and why it cannot copy, and saves once", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  let downloads = 0;
  page.on("download", () => downloads++);
  const said = await page.evaluate(() => {
    const save = document.querySelector("#download-mosaic");
    if (!(save instanceof HTMLElement)) throw new Error("no button");
    save.click();
    save.click();
    return document.querySelector("#export-status")?.textContent;
  });
  assert.equal(said, "Preparing…");
  await page.locator("#export-status", { hasText: /^Saved/ }).waitFor();
  // As without HTTPS.
  await page.evaluate(() => Reflect.deleteProperty(window, "ClipboardItem"));
  await page.locator("#copy-mosaic").click();
  await page.locator("#export-status", { hasText: "Save it instead" }).waitFor();
  await saved(page, "#download-report");
  assert.equal(downloads, 2, "the picture and the report");
  await close();
});

test("a saved result that comes back is left without asking", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await savedPicture(page);
  await page.locator("#clear-inputs").click();
  await page.getByRole("button", { name: "Undo" }).click();
  await finished(page);
  let asked = false;
  page.on("dialog", (dialog) => {
    asked = true;
    void dialog.accept();
  });
  const closed = page.waitForEvent("close");
  await page.close({ runBeforeUnload: true });
  await closed;
  assert.ok(!asked);
  await close();
});
