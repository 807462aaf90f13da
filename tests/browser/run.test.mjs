// Running: progress, cancelling, and everything by keyboard.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { assertSame, canvasPixels, finished, same, startSite, stitchAgain } from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

/** @type {Awaited<ReturnType<typeof startSite>>} */
let site;
before(async () => {
  site = await startSite();
});
after(() => site.close());

/** Presses Cancel as soon as the status says that this stage runs. @param {Page} page @param {RegExp} stage */
async function cancelDuring(page, stage) {
  await page.evaluate((source) => {
    const status = document.querySelector("#status");
    const cancel = document.querySelector("#cancel");
    const observer = new MutationObserver(() => {
      if (!new RegExp(source).test(status?.textContent ?? "")) return;
      observer.disconnect();
      if (cancel instanceof HTMLElement) cancel.click();
    });
    if (status) observer.observe(status, { childList: true, characterData: true, subtree: true });
  }, stage.source);
  await page.locator("#run").click();
}

test("cancels in the middle, keeps the earlier result, and runs again to the same bytes", async () => {
  const { page, complaints, close } = await site.open();
  const before = await canvasPixels(page, "#mosaic");
  for (const stage of [/^Fitting/, /^Warping/]) {
    await cancelDuring(page, stage);
    await page.locator("#status", { hasText: "Cancelled" }).waitFor();
    assert.equal(await page.locator("#run").getAttribute("aria-disabled"), "false");
    while (page.workers().length > 0) await page.workers()[0]?.waitForEvent("close");
    assertSame(await canvasPixels(page, "#mosaic"), before);
  }
  await stitchAgain(page);
  assert.equal(await page.locator("#message").textContent(), "");
  assertSame(await canvasPixels(page, "#mosaic"), before);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("tells every stage as it comes", async () => {
  const { page, close } = await site.open();
  await page.evaluate(() => {
    /** @type {string[]} */
    const heard = [];
    Object.assign(globalThis, { heard });
    const status = document.querySelector("#status");
    const note = () => void heard.push(status?.textContent ?? "");
    if (status) new MutationObserver(note).observe(status, { childList: true });
  });
  await stitchAgain(page);
  /** @type {string[]} */
  const heard = await page.evaluate("heard");
  const stages = heard.map((words) => words.split(" ")[0]);
  assert.deepEqual(stages, [
    "Reading",
    "Fitting",
    "Warping",
    "Measuring",
    "Blending",
    "Filling",
    "Done",
  ]);
  await close();
});

test("options change the result, and resetting brings it back", async () => {
  const { page, close } = await site.open();
  const before = await canvasPixels(page, "#mosaic");
  await page.locator("summary").click();
  await page.selectOption("#option-robustFit", "homography");
  await stitchAgain(page);
  const flat = await canvasPixels(page, "#mosaic");
  assert.ok(!same(flat, before), "a homography gives another mosaic");
  await page.getByRole("button", { name: "Reset to defaults" }).click();
  await stitchAgain(page);
  assertSame(await canvasPixels(page, "#mosaic"), before);
  await close();
});

test("everything is reached and worked by keyboard, with the focus in sight", async () => {
  const { page, close } = await site.open();
  /** @type {string[]} */
  const path = [];
  for (let i = 0; i < 60; i++) {
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
        name: element.id || element.getAttribute("data-part") || element.tagName.toLowerCase(),
        outlined: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 1,
        // In the window, and not under the bar with the Stitch button.
        visible: ringed.contains(
          document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2),
        ),
      };
    });
    if (name === "") break;
    assert.ok(outlined, `${name} shows that it has the focus`);
    assert.ok(visible, `${name} is in view`);
    path.push(name);
  }
  for (const id of [
    "load-sample",
    "clear-inputs",
    "many-files",
    "target-file",
    "reference-file",
    "targetDepth-file",
    "referenceDepth-file",
    "depth-invalid",
    "matches-file",
    "summary",
    "run",
    "cancel",
    "download-mosaic",
    "download-warped",
    "download-report",
  ]) {
    assert.ok(path.includes(id), `${id} is reached; the path was ${path.join(" ")}`);
  }

  await page.locator("#run").focus();
  await page.keyboard.press("Enter");
  await page.keyboard.press("Escape");
  await page.locator("#status", { hasText: "Cancelled" }).waitFor();
  assert.equal(await page.evaluate(() => document.activeElement?.id), "run", "the focus stays");
  await page.keyboard.press("Enter");
  await finished(page);
  await close();
});

test("every control has a name", async () => {
  const { page, close } = await site.open();
  await page.locator("summary").click();
  const snapshot = await page.locator("body").ariaSnapshot();
  assert.doesNotMatch(
    snapshot,
    /- (button|textbox|spinbutton|combobox|checkbox|radio|link)(:| *$| \[)/m,
  );
  const nameless = await page.evaluate(() =>
    [...document.querySelectorAll("input, select, button")]
      .filter((control) => {
        if (control instanceof HTMLButtonElement) return !control.textContent?.trim();
        const { labels } = /** @type {HTMLInputElement | HTMLSelectElement} */ (control);
        return labels?.length === 0;
      })
      .map((control) => control.id),
  );
  assert.deepEqual(nameless, []);
  await close();
});
