// Three engines behind one small interface: Chromium over its own protocol, Firefox over WebDriver BiDi, and WebKitGTK
// over WebDriver.
import { spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { readdir, readFile } from "node:fs/promises";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import puppeteer from "puppeteer-core";
import { launch } from "../../js/tools/chromium.mjs";
import { aptInstall, findProgram, hasApt } from "../../js/tools/installed.mjs";

/**
 * A browser with one page.
 *
 * @typedef {object} Tab
 * @property {(url: string) => Promise<unknown>} go opens an address and waits until it is loaded
 * @property {(expression: string) => Promise<unknown>} evaluate the value of an expression in the page, awaited there
 * @property {string} downloads folder of the files that were saved
 * @property {() => Promise<void>} close
 */

/** @typedef {"Chromium" | "Firefox" | "WebKitGTK"} EngineName */

/** Starts each engine. A result of `null` says that it is not installed. */
export const engines = /** @type {Record<EngineName, () => Promise<Tab | null>>} */ ({
  Chromium: openChromium,
  Firefox: openFirefox,
  WebKitGTK: openWebKit,
});

/**
 * Runs a function in the page. It may use nothing but its arguments and what the page has.
 *
 * @template {readonly unknown[]} A
 * @template R
 * @param {Tab} tab
 * @param {(...args: A) => R} work
 * @param {A} args as JSON has them
 */
export async function inTab(tab, work, ...args) {
  const list = args.map((arg) => JSON.stringify(arg)).join(", ");
  return /** @type {Awaited<R>} */ (await tab.evaluate(`(${work})(${list})`));
}

/**
 * Asks the page again and again until the answer is not falsy.
 *
 * @template {readonly unknown[]} A
 * @template R
 * @param {Tab} tab
 * @param {(...args: A) => R} work
 * @param {A} args
 */
export async function until(tab, work, ...args) {
  const end = Date.now() + 60_000;
  for (;;) {
    const answer = await inTab(tab, work, ...args);
    if (answer) return answer;
    if (Date.now() > end) {
      throw new Error(`never true: ${work}\n${await tab.evaluate("document.body.innerText")}`);
    }
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

/** The only file that is saved by `save`. @param {Tab} tab @param {() => Promise<unknown>} save */
export async function savedIn({ downloads }, save) {
  await save();
  let before = 0;
  for (const end = Date.now() + 30_000; Date.now() < end;) {
    const [name = "", ...more] = await readdir(downloads);
    // Browsers write to another name, which may be gone by now, or beside an empty file, until all is there.
    const whole = more.length === 0 && !/^$|\.(part|crdownload|wkdownload)$/.test(name);
    const bytes = whole ? await readFile(join(downloads, name)).catch(() => null) : null;
    if (bytes && bytes.length > 0 && bytes.length === before) {
      rmSync(join(downloads, name));
      return { name, bytes };
    }
    before = bytes?.length ?? 0;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  throw new Error("nothing was saved");
}

async function openChromium() {
  const downloads = newFolder();
  const browser = await launch();
  const page = await browser.newPage();
  page.on("download", (download) => {
    void download.saveAs(join(downloads, download.suggestedFilename()));
  });
  return tabOf(browser, page, downloads);
}

async function openFirefox() {
  const find = () =>
    findProgram(
      "FIREFOX_PATH",
      ["firefox-esr", "firefox"],
      ["/Applications/Firefox.app/Contents/MacOS/firefox"],
    );
  const executablePath = found(find, "firefox-esr");
  if (!executablePath) return null;
  const downloads = newFolder();
  const browser = await puppeteer.launch({
    browser: "firefox",
    executablePath,
    extraPrefsFirefox: { "browser.download.dir": downloads, "browser.download.folderList": 2 },
  });
  return tabOf(browser, await browser.newPage(), downloads);
}

/**
 * A page of a browser that is driven by a library.
 *
 * @param {{ close(): Promise<void> }} browser
 * @param {{ goto(url: string): Promise<unknown>, evaluate(expression: string): Promise<unknown> }} page
 * @param {string} downloads
 * @returns {Tab}
 */
function tabOf(browser, page, downloads) {
  return {
    downloads,
    go: (url) => page.goto(url),
    evaluate: (expression) => page.evaluate(expression),
    async close() {
      await browser.close();
      rmSync(downloads, { recursive: true });
    },
  };
}

/** WebKitGTK's small browser, on a screen of its own that is not shown. */
async function openWebKit() {
  const driver = found(
    () => findProgram("WEBKIT_DRIVER_PATH", ["WebKitWebDriver"]),
    "webkit2gtk-driver",
  );
  const screen = found(() => findProgram("XVFB_PATH", ["Xvfb"]), "xvfb");
  if (!driver || !screen) return null;

  const home = newFolder();
  const downloads = join(home, "downloads");
  mkdirSync(downloads);
  writeFileSync(join(home, "user-dirs.dirs"), `XDG_DOWNLOAD_DIR="${downloads}"\n`);
  const xvfb = spawn(screen, ["-displayfd", "1", "-screen", "0", "1400x1000x24"], {
    stdio: ["ignore", "pipe", "ignore"],
  });
  const display = await firstLine(xvfb.stdout);
  const port = await freePort();
  const server = spawn(driver, [`--port=${port}`], {
    stdio: "ignore",
    env: {
      ...process.env,
      DISPLAY: `:${display}`,
      GDK_BACKEND: "x11",
      NO_AT_BRIDGE: "1",
      HOME: home,
      XDG_CONFIG_HOME: home,
      XDG_CACHE_HOME: home,
      XDG_DATA_HOME: home,
    },
  });
  const base = `http://127.0.0.1:${port}/session`;
  const stop = () => {
    server.kill();
    xvfb.kill();
    // The browser's own processes end a little later, and write until then.
    rmSync(home, { recursive: true, maxRetries: 15, retryDelay: 100 });
  };
  let session = "";
  try {
    await answers(base);
    const { sessionId } = await request("POST", base, { capabilities: {} });
    session = `${base}/${sessionId}`;
  } catch (error) {
    stop();
    throw error;
  }
  return {
    downloads,
    go: (/** @type {string} */ url) => request("POST", `${session}/url`, { url }),
    async evaluate(/** @type {string} */ expression) {
      const script = `
        const done = arguments[0];
        (async () => ${expression})().then((value) => done({ value }), (error) => done({ error: String(error) }));`;
      const answer = await request("POST", `${session}/execute/async`, { script, args: [] });
      if ("error" in answer) throw new Error(answer.error);
      return answer.value;
    },
    async close() {
      await request("DELETE", session);
      stop();
    },
  };
}

/** A program that is installed, if need be from a package of Debian. @param {() => string | undefined} find @param {string} debian */
function found(find, debian) {
  const path = find();
  if (path || !hasApt) return path;
  try {
    aptInstall(debian);
  } catch (error) {
    console.error(String(error));
  }
  return find();
}

function newFolder() {
  return mkdtempSync(join(tmpdir(), "depthstitch-engine-"));
}

/** The first line that a program prints. @param {import("node:stream").Readable} stream */
async function firstLine(stream) {
  let text = "";
  for await (const chunk of stream) {
    text += String(chunk);
    if (text.includes("\n")) break;
  }
  return text.trim();
}

/** A port that nothing listens on. @returns {Promise<number>} */
function freePort() {
  return new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const address = server.address();
      server.close(() => resolve(typeof address === "object" ? (address?.port ?? 0) : 0));
    });
  });
}

/** Waits until a server answers at all. @param {string} url */
async function answers(url) {
  for (const end = Date.now() + 60_000; ;) {
    try {
      return await fetch(url);
    } catch (error) {
      if (Date.now() > end) throw error;
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
  }
}

/** A command of WebDriver. @param {string} method @param {string} url @param {object} [body] */
async function request(method, url, body) {
  const response = await fetch(url, { method, ...(body && { body: JSON.stringify(body) }) });
  const { value } = await response.json();
  if (!response.ok) throw new Error(`${value.error}: ${value.message}`);
  return value;
}
