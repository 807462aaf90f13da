// `npm test`: all tests, group by group. `npm test -- rust node` runs two groups.
import { readdirSync } from "node:fs";
import { availableParallelism } from "node:os";
import { join } from "node:path";
import { build, setup } from "./build.mjs";
import { renderSample } from "./sample.mjs";
import { cargoEnv, installPackages, root, run, testFeatures } from "./shared.mjs";
import { wasmTests } from "./wasm-tests.mjs";

/** @type {Record<string, { needs: (() => void | Promise<void>)[], tests: (() => void | Promise<void>)[] }>} preparations and tests */
const groups = {
  rust: {
    needs: [setup],
    tests: [() => run("cargo", ["test", ...testFeatures], { env: cargoEnv })],
  },
  wasm: { needs: [setup], tests: [() => wasmTests(testFeatures)] },
  node: {
    needs: [build, smallSample, smallSet],
    tests: [() => nodeTest("node", availableParallelism())],
  },
  packaging: { needs: [build, smallSample], tests: [() => nodeTest("packaging")] },
  models: { needs: [build, () => renderSample()], tests: [() => nodeTest("models")] },
  browser: {
    needs: [build, () => renderSample(), smallSample],
    tests: [() => nodeTest("browser", availableParallelism()), () => nodeTest("browser/alone")],
  },
};

/**
 * One file at a time, unless told otherwise: those of the package share a folder, a network takes all cores, and
 * the page's tasks take longer beside others.
 *
 * @param {string} folder
 */
function nodeTest(folder, concurrency = 1) {
  const tests = readdirSync(join(root, "tests", folder)).filter((file) =>
    /\.test\.m?[jt]s$/.test(file),
  );
  if (tests.length === 0) throw new Error(`tests/${folder} has no tests`);
  const files = tests.map((file) => join("tests", folder, file));
  run(process.execPath, ["--test", `--test-concurrency=${concurrency}`, ...files]);
}

/** A small sample for tests that stitch it many times. */
function smallSample() {
  return renderSample(join("target", "sample-small"), 240, 160);
}

/** Four photos with true cameras and exact depth, for the evaluation of sets. */
function smallSet() {
  return renderSample(join("target", "sample-set"), 320, 240, 4);
}

const chosen = process.argv.slice(2);
const unknown = chosen.filter((name) => !(name in groups));
if (unknown.length > 0) {
  console.error(`no test group ${unknown.join(", ")}; there are ${Object.keys(groups).join(", ")}`);
  process.exit(2);
}

/** @type {{ name: string, passed: boolean, ms: number }[]} */
const summary = [];
installPackages();
const done = new Set();
for (const [name, { needs, tests }] of Object.entries(groups)) {
  if (chosen.length > 0 && !chosen.includes(name)) continue;
  console.log(`\n== ${name}`);
  const start = Date.now();
  try {
    for (const need of needs.filter((need) => !done.has(need))) {
      await need();
      done.add(need);
    }
    for (const test of tests) await test();
  } catch (error) {
    summary.push({ name, passed: false, ms: Date.now() - start });
    console.error(String(error));
    break;
  }
  summary.push({ name, passed: true, ms: Date.now() - start });
}

console.log("\n== summary");
for (const { name, passed, ms } of summary) {
  console.log(`${name}: ${passed ? "passed" : "FAILED"} in ${(ms / 1000).toFixed(1)} s`);
}
if (summary.some(({ passed }) => !passed)) process.exit(1);
