// `npm run bench:page -- --megapixels 1,12,24 --json FILE`: the page with large photos, in Chromium without a GPU, on Linux: how long its
// main thread is blocked, and how much memory it takes, while photos are loaded and stitched, views change, and the picture is saved.
// `blocks` are tasks of 50 ms or more, in time of day: where `waited` is large, others had the processors. `peak` and `after` are of the
// page's process with its workers, `all` of the whole browser, what is shared divided.
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { renderSample } from "../js/tools/sample.mjs";
import { root } from "../js/tools/shared.mjs";
import { startSite } from "../tests/browser/page.mjs";

/** @typedef {import("playwright-core").Page} Page */
/** @typedef {{ phase: string, ms: number, tasks: { ms: number, during: string }[], computed: number, waited: number, peak: number, after: number, all: number }} Row */

const { values: flags } = parseArgs({
  options: {
    megapixels: { type: "string", default: "1,12,24" },
    json: { type: "string" },
  },
});
/** The sample's. */
const ASPECT = 1000 / 662;
/** Milliseconds in which nothing more happens: a view is drawn, a task that was begun has ended. */
const QUIET = 700;
const MOST_WAIT = 900_000;

/** Widths and heights of these many million pixels. */
const sizes = flags.megapixels.split(",").map((text) => {
  const pixels = Number(text) * 1e6;
  if (!(pixels > 0)) throw new RangeError(`--megapixels must be numbers above 0, got ${text}`);
  const width = Math.round(Math.sqrt(pixels * ASPECT));
  return [width, Math.round(width / ASPECT)];
});

const site = await startSite();
/** @type {Record<string, Row[]>} */
const found = {};
try {
  for (const [width = 0, height = 0] of sizes) {
    const folder = join("target", "bench-sample", `${width}x${height}`);
    await renderSample(folder, width, height);
    const files = ["target.jpg", "reference.jpg"].map((name) => join(root, folder, name));
    const name = `${((width * height) / 1e6).toFixed(1)} MP`;
    console.log(`\n${name} (${width}×${height}), two photos alone`);
    console.log(
      line("", ["s", "blocks", "longest ms", "cpu ms", "waited", "peak MiB", "after", "all"]),
    );
    found[name] = await measure(files);
  }
} finally {
  await site.close();
}
if (flags.json) writeFileSync(flags.json, `${JSON.stringify(found, null, 1)}\n`);

/** Goes through the page with two photos. @param {string[]} files */
async function measure(files) {
  const { page, complaints, close } = await site.open({ hash: "#page.photoLimit=0" });
  page.setDefaultTimeout(MOST_WAIT);
  await page.evaluate(watchMainThread);
  const pid = await rendererOf(page);
  /** @type {Row[]} */
  const rows = [];
  /** @param {string} phase @param {() => Promise<unknown>} work */
  const during = async (phase, work) => {
    writeFileSync(`/proc/${pid}/clear_refs`, "5");
    const before = mainThread(pid);
    const start = await page.evaluate("performance.now()");
    await work();
    const end = await page.evaluate("performance.now()");
    await page.waitForTimeout(QUIET);
    const tasks = await page.evaluate(tasksSince, Number(start));
    const now = mainThread(pid);
    const status = readFileSync(`/proc/${pid}/status`, "utf8");
    const kilobytes = (/** @type {string} */ key) =>
      Number(status.match(new RegExp(`^${key}:\\s*(\\d+)`, "m"))?.[1]) * 1024;
    const [peak, after] = [kilobytes("VmHWM"), kilobytes("VmRSS")];
    /** @type {Row} */
    const row = {
      phase,
      ms: Number(end) - Number(start),
      tasks,
      computed: now.computed - before.computed,
      waited: now.waited - before.waited,
      peak,
      after,
      all: proportional(),
    };
    rows.push(row);
    print(row);
  };

  await during("load, stitch", async () => {
    await page.setInputFiles("#many-files", files);
    await page.locator("#status", { hasText: /^Done/ }).waitFor();
  });
  for (const id of await page
    .locator("#tabs button:visible")
    .evaluateAll((tabs) => tabs.map(({ id }) => id))) {
    await during(id, async () => {
      await page.locator(`#${id}`).click();
      await shownView(page);
    });
  }
  await page.locator("#tab-mosaic").click();
  await shownView(page);
  await during("zoom, pan", async () => {
    await page.locator("#frame").focus();
    for (const key of [
      "+",
      "+",
      "+",
      "+",
      "ArrowLeft",
      "ArrowDown",
      "+",
      "+",
      "+",
      "+",
      "ArrowRight",
      "0",
    ]) {
      await page.keyboard.press(key);
      await page.waitForTimeout(100);
    }
  });
  await during("crop", async () => {
    for (const crop of ["whole", "inner"]) await page.selectOption("#save-crop", crop);
  });
  for (const format of ["jpeg", "png"]) {
    await page.selectOption("#save-format", format);
    await during(`save ${format}`, async () => {
      const [download] = await Promise.all([
        page.waitForEvent("download"),
        page.locator("#download-mosaic").click(),
      ]);
      await download.path();
    });
  }
  const wrong = await complaints();
  if (wrong.length > 0) throw new Error(wrong.join("\n"));
  await close();
  return rows;
}

/** Waits until the chosen view is computed. @param {Page} page */
async function shownView(page) {
  await page
    .locator("#view-caption", { hasText: /[^…\s].*\w/ })
    .filter({ hasNotText: "Computing…" })
    .waitFor();
  await page.locator('#run[aria-disabled="false"]').waitFor();
}

/** @param {Row} row */
function print({ phase, ms, tasks, computed, waited, peak, after, all }) {
  const longest = Math.max(0, ...tasks.map((task) => task.ms));
  const mebibytes = [peak, after, all].map((bytes) => (bytes / 2 ** 20).toFixed(0));
  const times = [longest, computed, waited].map((ms) => ms.toFixed(0));
  console.log(line(phase, [(ms / 1000).toFixed(1), String(tasks.length), ...times, ...mebibytes]));
  for (const { ms, during } of tasks) console.log(`  ${ms.toFixed(0)} ms: ${during}`);
}

/** @param {string} name @param {string[]} cells */
function line(name, cells) {
  return [name.padEnd(14), ...cells.map((cell) => cell.padStart(10))].join("  ");
}

/**
 * What the page's main thread did.
 *
 * @typedef {object} Watched
 * @property {{ start: number, ms: number }[]} tasks that took 50 ms or more
 * @property {{ at: number, text: string }[]} said what the page said that it is doing
 * @property {Frame[]} frames that were late, with the scripts that ran
 *
 * @typedef {{ startTime: number, duration: number }} Span
 * @typedef {Span & { scripts: (Span & { invoker: string, sourceFunctionName: string })[] }} Frame
 */

/** In the page: starts to watch its main thread. */
function watchMainThread() {
  /** @type {Watched} */
  const watched = { tasks: [], said: [], frames: [] };
  Object.assign(globalThis, { watched });
  /** @param {string} type @param {(entry: PerformanceEntry) => void} see */
  const observe = (type, see) =>
    new PerformanceObserver((list) => list.getEntries().forEach(see)).observe({ type });
  observe("longtask", ({ startTime: start, duration: ms }) => watched.tasks.push({ start, ms }));
  observe("long-animation-frame", (entry) => watched.frames.push(entry.toJSON()));
  const status = document.querySelector("#status");
  if (!status) throw new Error("the page has no status");
  const changes = new MutationObserver(() =>
    watched.said.unshift({ at: performance.now(), text: status.textContent ?? "" }),
  );
  changes.observe(status, { childList: true, characterData: true, subtree: true });
}

/** In the page: the blocks since a time. @param {number} from */
function tasksSince(from) {
  const { watched } = /** @type {{ watched: Watched }} */ (/** @type {unknown} */ (globalThis));
  return watched.tasks
    .filter(({ start }) => start >= from)
    .map(({ start, ms }) => {
      /** @param {Span} span */
      const during = (span) =>
        span.startTime < start + ms && span.startTime + span.duration > start;
      const scripts = watched.frames.filter(during).flatMap((frame) => frame.scripts);
      const names = scripts
        .filter(during)
        .map(
          (script) =>
            `${script.sourceFunctionName || script.invoker} ${Math.round(script.duration)}`,
        );
      const said = watched.said.find(({ at }) => at <= start)?.text ?? "";
      return { ms, during: [said, ...names].join(", ") };
    });
}

/** Processes of the browser with their command lines. */
function processes() {
  /** @type {Map<number, { parent: number, command: string }>} */
  const all = new Map();
  for (const name of readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const parent = Number(readFileSync(`/proc/${name}/stat`, "utf8").match(/\) \S (\d+)/)?.[1]);
      const command = readFileSync(`/proc/${name}/cmdline`, "utf8");
      all.set(Number(name), { parent, command });
    } catch {
      // It has ended.
    }
  }
  const ours = (/** @type {number} */ pid) => {
    for (let at = pid; all.has(at); at = all.get(at)?.parent ?? 0)
      if (at === process.pid) return true;
    return false;
  };
  return [...all].filter(
    ([pid, { command }]) => pid !== process.pid && /chrom/.test(command) && ours(pid),
  );
}

/** The process of a page: the renderer that grows when the page does. @param {Page} page */
async function rendererOf(page) {
  const sizes = () =>
    processes()
      .filter(([, { command }]) => command.includes("--type=renderer"))
      .map(([pid]) => ({
        pid,
        pages: Number(readFileSync(`/proc/${pid}/statm`, "utf8").split(" ")[1]),
      }));
  const before = new Map(sizes().map(({ pid, pages }) => [pid, pages]));
  await page.evaluate("globalThis.filled = new Uint8Array(2 ** 26).fill(1)");
  const grown = sizes().map(({ pid, pages }) => ({ pid, pages: pages - (before.get(pid) ?? 0) }));
  await page.evaluate("globalThis.filled = globalThis.filled.buffer.transfer(0)");
  const [most] = grown.sort((a, b) => b.pages - a.pages);
  if (!most) throw new Error("the browser has no renderer");
  return most.pid;
}

/** Milliseconds for which a process's first thread has computed, and has waited for a processor. @param {number} pid */
function mainThread(pid) {
  const times = readFileSync(`/proc/${pid}/task/${pid}/schedstat`, "utf8").split(" ");
  const [computed = 0, waited = 0] = times.map((nanoseconds) => Number(nanoseconds) / 1e6);
  return { computed, waited };
}

/** Bytes of all processes of the browser, shared ones divided among them. */
function proportional() {
  const sizes = processes().map(([pid]) => {
    const rollup = readFileSync(`/proc/${pid}/smaps_rollup`, "utf8");
    return Number(rollup.match(/^Pss:\s*(\d+)/m)?.[1]) * 1024;
  });
  return sizes.reduce((sum, size) => sum + size, 0);
}
