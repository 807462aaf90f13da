import { execFile } from "node:child_process";
import { existsSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";

import { CASE_FILE } from "../cases/case.js";
import type { Times, Method } from "./stages.js";

/** The crate's root, from dist/bench. */
const ROOT = fileURLToPath(new URL("../../", import.meta.url));
const RENDER = ["--example", "render-sample"];
const TIMES = ["--package", "benches", "--bin", "native-times"];

/** A case folder with the sample scene at this size, rendered unless it is there from an earlier run. */
export async function renderSample(width: number, height: number): Promise<string> {
  const folder = join(ROOT, "target", "bench-sample", `${width}x${height}`);
  if (!existsSync(join(folder, CASE_FILE))) {
    await run(RENDER, [folder, String(width), String(height)]);
  }
  return folder;
}

/** As {@link renderSample}, with so many photos instead of a pair: the first time it takes ten seconds per million pixels. */
export async function renderMany(width: number, height: number, count: number): Promise<string> {
  const folder = join(ROOT, "target", "bench-sample", `${count}x${width}x${height}`);
  if (!existsSync(join(folder, CASE_FILE))) {
    await run(RENDER, [folder, ...[width, height, count].map(String)]);
  }
  return folder;
}

/** The same stages in native code. */
export async function nativeTimes(folder: string, method: Method, runs: number): Promise<Times> {
  const times: unknown = JSON.parse(await run(TIMES, [folder, method, String(runs)]));
  if (!isTimes(times)) throw new Error("native-times did not print times by stage");
  return times;
}

/** Runs one of the crate's programs and gives what it prints. */
async function run(program: readonly string[], args: readonly string[]): Promise<string> {
  const cargo = ["run", "--quiet", "--release", ...program, "--", ...args];
  const { stdout } = await promisify(execFile)("cargo", cargo, { cwd: ROOT });
  return stdout;
}

function isTimes(value: unknown): value is Times {
  const times = Object.values(Object.assign({}, value));
  return times.length > 0 && times.every((ms) => Number.isFinite(ms));
}
