// What is given up: how soon the next thing begins, in time that grows with what else the machine does.
import assert from "node:assert/strict";
import { after, test } from "node:test";
import { encodeGrayPng } from "depthstitch/codecs";
import { scratchFolder, smallFile, smallPhotos, startSite } from "../page.mjs";

const site = await startSite();
after(() => site.close());
const { written } = scratchFolder();

test("a depth map that is given up is not decoded to its end before the next file", async () => {
  const side = 9000;
  const black = { data: new Uint8Array(side * side), width: side, height: side };
  const slow = written("slow.png", await encodeGrayPng(black));
  const begun = async () => {
    const tab = await site.open({ files: smallPhotos });
    await tab.page.setInputFiles("#targetDepth-file", slow);
    await tab.page.locator("#status", { hasText: "Loading" }).waitFor();
    return tab;
  };
  const whole = await begun();
  let start = performance.now();
  await whole.page.locator("#status", { hasText: "Loading" }).waitFor({ state: "detached" });
  const takes = performance.now() - start;
  await whole.close();

  const { page, complaints, close } = await begun();
  await page.waitForTimeout(takes / 4);
  await page.keyboard.press("Escape");
  await page.locator("#status", { hasText: "Cancelled" }).waitFor();
  start = performance.now();
  await page.setInputFiles("#target-file", smallFile("reference.jpg"));
  await page.locator('[data-slot="target"]', { hasText: "reference.jpg" }).waitFor();
  const next = performance.now() - start;
  console.log(`${next.toFixed(0)} ms; the depth map takes ${takes.toFixed(0)} ms`);
  assert.ok(next < takes / 2, `${next} ms, the depth map takes ${takes} ms`);
  assert.deepEqual(await complaints(), []);
  await close();
});
