// What the packaging tests share: an empty project with the packed package installed, and pages in Chromium.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { cpSync, readFileSync, rmSync } from "node:fs";
import { join } from "node:path";
import { preview } from "vite";
import { launch } from "../../js/tools/chromium.mjs";
import { pack } from "../../js/tools/pack.mjs";
import { root } from "../../js/tools/shared.mjs";

/** Runs a program in `cwd`; its output. @param {string} command @param {string[]} args @param {string} cwd */
export function runIn(cwd, command, args) {
  // Without the npm configuration of this repository.
  const env = Object.entries(process.env).filter(([name]) => !/^npm_/i.test(name));
  const { status, stdout, stderr, error } = spawnSync(command, args, {
    cwd,
    encoding: "utf8",
    env: Object.fromEntries(env),
    shell: process.platform === "win32",
  });
  assert.ok(!error && status === 0, `${command} ${args.join(" ")}: ${error ?? stdout + stderr}`);
  return stdout;
}

/**
 * Makes `folder` anew, with a project `consumer` that has the package installed, and the small sample in its `web/public`.
 *
 * @param {string} folder
 */
export function consumerIn(folder) {
  rmSync(folder, { recursive: true, force: true });
  const consumer = join(folder, "consumer");
  const web = join(consumer, "web");
  cpSync(join(root, "tests", "packaging", "consumer"), consumer, { recursive: true });
  cpSync(join(root, "target", "sample-small"), join(web, "public"), { recursive: true });
  const packed = pack(folder);
  runIn(consumer, "npm", ["install", "--offline", "--no-audit", "--no-fund", packed]);
  return { consumer, web, packed };
}

/** Serves a folder by HTTP while `use` runs. @param {string} folder @param {(url: string) => Promise<void>} use */
export async function served(folder, use) {
  const server = await preview({
    root: folder,
    configFile: false,
    logLevel: "error",
    build: { outDir: folder },
    preview: { port: 0 },
  });
  try {
    const url = server.resolvedUrls?.local[0];
    assert.ok(url);
    await use(url);
  } finally {
    await server.close();
  }
}

/** What the page at `url` writes to its title, in Chromium. @param {string | undefined} url */
export async function inChromium(url) {
  assert.ok(url);
  const browser = await launch();
  try {
    const page = await browser.newPage();
    let workers = 0;
    page.on("worker", () => (workers += 1));
    await page.goto(url);
    await page.waitForFunction(() => document.title !== "consumer", undefined, { timeout: 60_000 });
    return { digest: await page.title(), workers };
  } finally {
    await browser.close();
  }
}

/** Fails if a build contains code of networks, which is not imported. @param {string} script */
export function assertNoNetworks(script) {
  assert.doesNotMatch(readFileSync(script, "utf8"), /onnx|transformers|model-load-failed/, script);
}
