// Runs: progress, cancelling in every stage, a lost worker.
import assert from "node:assert/strict";
import { after, test } from "node:test";
import {
  assertSame,
  cancelDuring,
  exampleFile,
  finished,
  idle,
  recorded,
  savedPicture,
  smallPhotos,
  startSite,
  statusSays,
  stitchAgain,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

/** What the status says in each stage of two photos without anything else. */
const stages = ["Reading", "Detecting", "Matching", "Fitting", "Computing", "Refining", "Warping"];
const later = ["Blending", "Measuring", "Filling"];

test("cancels in every stage, and runs again to the same bytes, twice", async () => {
  const { page, complaints, close } = await site.open();
  for (const [index, stage] of [...stages, ...later].entries()) {
    await page.evaluate(cancelDuring, stage);
    if (index === 0) await page.setInputFiles("#many-files", smallPhotos);
    else await page.locator("#run").click();
    await page.locator(`body[data-cancelled="${stage}"]`).waitFor();
    await page.locator("#status", { hasText: "Cancelled" }).waitFor();
    await idle(page);
  }
  await stitchAgain(page);
  const first = await savedPicture(page);
  assert.equal(await page.locator("#message").textContent(), "");
  for (let run = 0; run < 2; run++) {
    await page.locator("#swap").click();
    await idle(page);
    await finished(page);
  }
  assertSame(await savedPicture(page), first);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("cancels while photos are loaded, which leaves those that were there", async () => {
  const { page, complaints, close } = await site.open();
  await page.evaluate(cancelDuring, "Loading");
  await page.setInputFiles("#many-files", smallPhotos);
  await page.locator("#status", { hasText: "Cancelled" }).waitFor();
  assert.equal(await page.locator("body").getAttribute("data-phase"), "start");
  await page.setInputFiles("#many-files", smallPhotos);
  await finished(page);
  const before = await savedPicture(page);

  await page.evaluate(cancelDuring, "Loading");
  await page.setInputFiles("#reference-file", exampleFile("reference.jpg"));
  await page.locator("#status", { hasText: "Cancelled" }).waitFor();
  await stitchAgain(page);
  assertSame(await savedPicture(page), before);

  // Of a set those that are read are kept, and the others come back.
  await page.evaluate(cancelDuring, "Loading");
  await page.setInputFiles("#add-files", [exampleFile("target.jpg")]);
  await page.locator("#undo-text", { hasText: "Left out 1 photo" }).waitFor();
  await page.locator("#undo-actions button", { hasText: "Read on" }).click();
  await page.locator("#result-source", { hasText: "3 of 3 photos" }).waitFor();
  assert.deepEqual(await complaints(), []);
  await close();
});

test("reports every stage in order", async () => {
  const { page, close } = await site.open();
  const said = await recorded(page, "#status");
  await page.setInputFiles("#many-files", smallPhotos);
  await finished(page);
  // Depth is extrapolated after its refinement, so its stage appears twice.
  const once = new Set((await said()).filter(Boolean).map((words) => words.split(" ")[0]));
  assert.deepEqual([...once], ["Loading", ...stages, ...later, "Done"]);
  await close();
});

test("photos that change during a run are stitched instead", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const running = statusSays(page, /…$/);
  await page.locator("#swap").click();
  await running;
  await page.locator("#swap").click();
  await idle(page);
  await finished(page);
  assert.match(
    (await page.locator("#result-source").textContent()) ?? "",
    /^target\.jpg onto reference\.jpg$/,
  );
  await close();
});

test("a lost worker is reported, and the next run works", async () => {
  const { page, close } = await site.open();
  // The core's worker, as a page would lose it when the browser runs short of memory.
  await page.route(/assets\/browser-.*\.js$/, (route) => route.abort());
  await page.setInputFiles("#many-files", smallPhotos);
  await page.locator("#message", { hasText: /could not be loaded/ }).waitFor();
  await page.unroute(/assets\/browser-.*\.js$/);

  await page.route(/assets\/browser-.*\.js$/, (route) =>
    route.fulfill({
      contentType: "text/javascript",
      body: "postMessage({ ready: true }); onmessage = () => setTimeout(() => { throw new Error('gone'); });",
    }),
  );
  await page.locator("#run").click();
  await page.locator("#message", { hasText: /bug in the program/ }).waitFor();
  await page.unroute(/assets\/browser-.*\.js$/);

  // A failed growth of memory has no number of bytes.
  const full = { code: "out-of-memory", stage: "input", message: "out of memory", details: {} };
  await page.route(/assets\/browser-.*\.js$/, (route) =>
    route.fulfill({
      contentType: "text/javascript",
      body: `postMessage({ ready: true }); onmessage = () => postMessage({ error: ${JSON.stringify(full)} });`,
    }),
  );
  await page.locator("#run").click();
  await page.locator("#message", { hasText: "The browser has no memory left for this." }).waitFor();
  await page.unroute(/assets\/browser-.*\.js$/);
  await stitchAgain(page);
  assert.equal(await page.locator("#message").textContent(), "");
  await close();
});

test("methods that are not compared, as that was cancelled, say so", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await page.locator("#methods-panel > summary").click();
  await page.evaluate(cancelDuring, "Warping");
  await page.locator("#methods-run").click();
  await page.locator('body[data-cancelled="Warping"]').waitFor();
  await idle(page);
  const words = page.locator(".method .agreement", { hasText: "Not computed." });
  await words.first().waitFor();
  assert.equal(await page.locator(".method .agreement", { hasText: /^…$/ }).count(), 0);
  await close();
});
