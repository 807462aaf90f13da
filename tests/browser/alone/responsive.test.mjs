// A responsive page: how long its thread is busy with one task, which grows with what else the machine does.
import assert from "node:assert/strict";
import { after, test } from "node:test";
import { finished, startSite } from "../page.mjs";

/** @typedef {import("../page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

test("the page is never blocked for longer than 50 ms during a stitch", async () => {
  const { page, close } = await site.open();
  await page.evaluate(() => {
    const counter = { frames: 0 };
    Object.assign(globalThis, { counter });
    const count = () => {
      counter.frames++;
      requestAnimationFrame(count);
    };
    requestAnimationFrame(count);
  });
  const tasks = await mainThreadTasks(page, async () => {
    await page.locator("#start-sample").click();
    await finished(page);
    await page.locator("#view-caption", { hasText: "pixels" }).waitFor();
  });
  assert.ok(Number(await page.evaluate("counter.frames")) > 20, "frames were drawn meanwhile");
  assert.ok(tasks.length > 100, "the tasks were seen");
  const longest = Math.max(...tasks);
  console.log(`longest task of the page's thread: ${longest.toFixed(1)} ms`);
  assert.ok(longest <= 50, `blocked for ${longest.toFixed(0)} ms`);
  await close();
});

/**
 * How long each task of the page's own thread worked, in milliseconds of that thread's time: what else the machine does
 * is not the page's.
 *
 * @param {Page} page
 * @param {() => Promise<void>} work
 */
async function mainThreadTasks(page, work) {
  const browser = page.context().browser();
  if (!browser) throw new Error("no browser");
  const categories = ["toplevel", "disabled-by-default-devtools.timeline"];
  await browser.startTracing(page, { categories });
  await work();
  /** @type {{ traceEvents: { name: string, ph: string, pid: number, tid: number, tdur?: number, args: { name?: string } }[] }} */
  const { traceEvents } = JSON.parse((await browser.stopTracing()).toString());
  const threads = new Set(
    traceEvents
      .filter(({ name, args }) => name === "thread_name" && args.name === "CrRendererMain")
      .map(({ pid, tid }) => `${pid} ${tid}`),
  );
  return traceEvents
    .filter(({ name, ph }) => name === "RunTask" && ph === "X")
    .filter(({ pid, tid }) => threads.has(`${pid} ${tid}`))
    .map(({ tdur }) => (tdur ?? 0) / 1000);
}
