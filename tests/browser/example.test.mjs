// The example that the page fetches: what happens meanwhile, and when it is given up.
import assert from "node:assert/strict";
import { after, test } from "node:test";
import {
  assertSame,
  exampleFile,
  finished,
  idle,
  savedPicture,
  smallPhotos,
  startSite,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

const threePhotos = [...smallPhotos, exampleFile("target.jpg")];

/** The photos of the example do not arrive before `arrive` is called; `asked` is when the page asks for them. @param {Page} page */
async function delayExample(page) {
  /** @type {() => void} */
  let arrive = () => {};
  const arrived = new Promise((resolve) => (arrive = () => resolve(undefined)));
  await page.route("**/sample/*.jpg", async (route) => {
    await arrived;
    // The page may have given it up.
    await route.continue().catch(() => {});
  });
  return { asked: page.waitForRequest("**/sample/target.jpg"), arrive };
}

test("photos that are chosen while the example is fetched are kept", async () => {
  const chosen = { two: smallPhotos, three: threePhotos };
  for (const [many, files] of Object.entries(chosen)) {
    const { page, close } = await site.open();
    const { asked, arrive } = await delayExample(page);
    await page.locator("#start-sample").click();
    await asked;
    await page.locator("#status", { hasText: "Loading the files" }).waitFor();
    await page.setInputFiles("#many-files", files);
    await finished(page);
    const source = await page.locator("#result-source").textContent();
    arrive();
    await page.waitForTimeout(300);
    await idle(page);
    assert.equal(await page.locator("#result-source").textContent(), source, many);
    assert.doesNotMatch(source ?? "", /example/);
    assert.equal(await page.locator("#message").textContent(), "");
    await close();
  }
});

test("the example that is given up while it is read leaves three photos as they were", async () => {
  const { page, complaints, close } = await site.open({ files: threePhotos });
  const first = await savedPicture(page);
  await page.evaluate(() => {
    const cancel = document.querySelector("#cancel");
    const card = document.querySelector('[data-slot="target"]');
    let busy = 0;
    // Once while the files are fetched, and once more while they are read.
    const observer = new MutationObserver((changes) => {
      busy += changes.length;
      if (busy > 1 && cancel instanceof HTMLElement) cancel.click();
    });
    if (card) observer.observe(card, { attributeFilter: ["aria-busy"] });
  });
  await page.locator("#load-sample").click();
  await page.locator("#status", { hasText: "Cancelled" }).waitFor();
  await idle(page);
  assert.equal(await page.getAttribute("body", "data-photos"), "many");
  assertSame(await savedPicture(page), first);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("photos that come back while the example is fetched stay", async () => {
  const ways = [
    {
      files: smallPhotos,
      remove: "#clear-inputs",
      example: "#start-sample",
      source: /^target\.jpg onto reference\.jpg$/,
    },
    {
      files: threePhotos,
      remove: '.tile button[aria-label^="Remove photo 3"]',
      example: "#load-sample",
      source: /^3 of 3 photos/,
    },
  ];
  for (const { files, remove, example, source } of ways) {
    const { page, close } = await site.open({ files });
    const { asked, arrive } = await delayExample(page);
    await page.locator(remove).click();
    await page.locator(example).click();
    const givenUp = page.waitForEvent("requestfailed");
    await asked;
    await page.getByRole("button", { name: "Undo" }).click();
    await givenUp;
    arrive();
    await page.locator("#result-source", { hasText: source }).waitFor();
    await finished(page);
    assert.equal(await page.getAttribute("body", "data-loading"), "false");
    assert.match((await page.locator("#result-source").textContent()) ?? "", source);
    await close();
  }
});
