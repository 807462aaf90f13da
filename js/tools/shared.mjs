// Functions of the build scripts. They use modules of Node only, as they run before `npm ci`.
import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import { existsSync, readFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

export const root = resolve(dirname(fileURLToPath(import.meta.url)), "..", "..");

/** Where the real cases are: the tests on them are skipped where they are not. */
export const dataFolder = process.env.DEPTHSTITCH_DATA ?? join(root, "../shared/data");
export const toolsDir = join(root, "target", "tools");
const exe = process.platform === "win32" ? ".exe" : "";

/** Path of a tool that `setup` installs. @param {string} name */
export const bin = (name) => join(toolsDir, "bin", name + exe);

/**
 * Path of the script behind a command of an npm package, to be run by node.
 *
 * @param {string} name
 * @param {string} command
 * @returns {string}
 */
export function npmBin(name, command) {
  const folder = join(root, "node_modules", name);
  const { bin } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  return join(folder, typeof bin === "string" ? bin : bin[command]);
}

/** All wasm builds and tests use SIMD. */
export const simd = "-Ctarget-feature=+simd128";

export const cargoEnv = {
  CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: simd,
  CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUNNER: bin("wasm-bindgen-test-runner"),
};

/** Features of the crate that the Rust tests and examples are built with. */
export const testFeatures = ["--features", "codecs"];

/**
 * Cargo's arguments to run an example as the Rust tests build it, so that it is built once.
 *
 * @param {string} name
 * @param {string[]} args the example's own
 */
export const exampleRun = (name, args) => [
  "run",
  ...testFeatures,
  "--example",
  name,
  "--",
  ...args,
];

/**
 * Runs a command in the root of the repository with its output shown. Throws if it fails.
 *
 * @param {string} command
 * @param {string[]} args
 * @param {{ env?: Record<string, string> }} [options]
 */
export function run(command, args, options) {
  const { status, signal, error } = spawnSync(command, args, shown(command, args, options));
  if (error) throw error;
  check(command, status, signal);
}

/** As `run`, while others run. @type {(...args: Parameters<typeof run>) => Promise<void>} */
export async function runAsync(command, args, options) {
  const [status, signal] = await once(spawn(command, args, shown(command, args, options)), "close");
  check(command, status, signal);
}

/**
 * Prints a command; the options to run it with its output shown.
 *
 * @param {string} command
 * @param {string[]} args
 * @param {{ env?: Record<string, string> }} [options]
 * @returns {import("node:child_process").SpawnOptions}
 */
function shown(command, args, { env = {} } = {}) {
  console.log(`$ ${[command, ...args].join(" ").replaceAll(root, ".")}`);
  return { cwd: root, env: { ...process.env, ...env }, stdio: ["ignore", "inherit", "inherit"] };
}

/** @param {string} command @param {number | null} status @param {NodeJS.Signals | null} signal */
function check(command, status, signal) {
  if (status !== 0) throw new Error(`${command} ended with ${signal ?? `status ${status}`}`);
}

/**
 * The output of a command.
 *
 * @param {string} command
 * @param {string[]} args
 * @param {{ env?: Record<string, string> }} [options]
 */
export function output(command, args, { env = {} } = {}) {
  const { status, stdout, error } = spawnSync(command, args, {
    cwd: root,
    env: { ...process.env, ...env },
    maxBuffer: Infinity,
    encoding: "utf8",
    stdio: ["ignore", "pipe", "inherit"],
  });
  if (error) throw error;
  if (status !== 0) throw new Error(`${command} ended with status ${status}`);
  return stdout;
}

/** Runs npm, whose command is a script on Windows. @param {string[]} args */
export function npm(args) {
  if (process.env.npm_execpath) run(process.execPath, [process.env.npm_execpath, ...args]);
  else run("npm", args);
}

/** Installs the packages of package-lock.json unless they are installed. */
export function installPackages() {
  const done = join(root, "node_modules", ".package-lock.json");
  if (!existsSync(done) || lockOf(done) !== lockOf(join(root, "package-lock.json"))) {
    npm(["ci", "--ignore-scripts", "--no-audit", "--no-fund"]);
  }
}

/** Names and versions in a lock file, without those of other platforms. @param {string} file */
function lockOf(file) {
  /** @type {{ packages: Record<string, { version: string, optional?: boolean }> }} */
  const { packages } = JSON.parse(readFileSync(file, "utf8"));
  return Object.entries(packages)
    .filter(([path, { optional }]) => path !== "" && !optional)
    .map(([path, { version }]) => `${path}@${version}`)
    .sort()
    .join("\n");
}

/** Whether a module is the script that node was started with. @param {string} url */
export const isMain = (url) => url === pathToFileURL(process.argv[1] ?? "").href;
