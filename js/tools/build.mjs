// Builds dist/: the wasm modules, then TypeScript. Steps with unchanged inputs are skipped.
import {
  cpSync,
  existsSync,
  mkdirSync,
  readdirSync,
  readFileSync,
  rmSync,
  writeFileSync,
} from "node:fs";
import { homedir } from "node:os";
import { basename, dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { filesBelow, unlessFresh } from "./fresh.mjs";
import {
  bin,
  cargoEnv,
  isMain,
  npmBin,
  output,
  root,
  run,
  runAsync,
  simd,
  toolsDir,
} from "./shared.mjs";

const dist = join(root, "dist");
const wasmDir = join(dist, "wasm");
const evaluationDir = join(dist, "eval", "wasm");

// Features of all browsers with WebAssembly SIMD; rustc enables the same set.
const wasmFeatures = [
  "--enable-simd",
  "--enable-bulk-memory",
  "--enable-bulk-memory-opt",
  "--enable-mutable-globals",
  "--enable-nontrapping-float-to-int",
  "--enable-sign-ext",
  "--enable-reference-types",
  "--enable-multivalue",
];

/**
 * @typedef {object} WasmModule
 * @property {string} name of the output files
 * @property {string} folder of the output files
 * @property {string} feature of the crate, whose bindings it holds
 * @property {string[]} opt wasm-opt's passes; speed was seen to by LLVM
 */

/** Passes for the two modules that stitch. */
const smallest = [
  "-Oz",
  "--converge",
  // Inlining hot functions into callers that run once would keep them from ever being optimised by the engine.
  "--one-caller-inline-max-function-size=12",
  "--always-inline-max-function-size=0",
  "--flexible-inline-max-function-size=0",
  // The lowest kilobyte is the last of the stack: no pointer wraps around to it.
  "--low-memory-unused",
  // What is alike lies together, where gzip sees it.
  "--reorder-functions-by-name",
];

/** @type {WasmModule[]} */
const modules = [
  { name: "depthstitch", folder: wasmDir, feature: "wasm-core", opt: smallest },
  { name: "many", folder: wasmDir, feature: "wasm-many", opt: smallest },
  {
    name: "codecs",
    folder: wasmDir,
    feature: "wasm-codecs",
    opt: ["-Oz"],
  },
  {
    name: "evaluation",
    folder: evaluationDir,
    feature: "wasm-evaluation",
    opt: ["-Oz"],
  },
];

/** Panic messages name source files: they must not reveal where the builder keeps them. */
const cargoHome = process.env.CARGO_HOME ?? join(homedir(), ".cargo");
// Flags are separated by spaces.
const remap = cargoHome.includes(" ") ? [] : [`--remap-path-prefix=${cargoHome}=cargo`];

/**
 * Hot loops are written with explicit SIMD lanes. Vectorising, unrolling, inlining and eliminating partial redundancies in all
 * the others would grow the download by a third.
 */
const wasmEnv = {
  ...cargoEnv,
  CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: [
    simd,
    ...remap,
    "-Cno-vectorize-loops",
    "-Cno-vectorize-slp",
    ...[
      "inline-threshold=50",
      "unroll-threshold=40",
      "unroll-full-max-count=8",
      "unroll-runtime=false",
      "unroll-allow-partial=false",
      "enable-pre=false",
      "enable-load-pre=false",
    ].map((option) => `-Cllvm-args=-${option}`),
  ].join(" "),
};

/** The version of the wasm-bindgen crate, which its command line tool must have too. */
function bindgenVersion() {
  const lock = readFileSync(join(root, "Cargo.lock"), "utf8");
  const version = /^name = "wasm-bindgen"\nversion = "([\d.]+)"$/m.exec(lock)?.[1];
  if (!version) throw new Error("Cargo.lock has no wasm-bindgen");
  return version;
}

/** Installs what the build needs besides npm packages: the wasm target and the wasm-bindgen tool. */
export function setup() {
  const installed = output("rustup", ["target", "list", "--installed"]);
  if (!installed.split("\n").includes("wasm32-unknown-unknown")) {
    run("rustup", ["target", "add", "wasm32-unknown-unknown"]);
  }
  const version = bindgenVersion();
  const tool = bin("wasm-bindgen");
  if (existsSync(tool) && output(tool, ["--version"]).trim() === `wasm-bindgen ${version}`) return;
  const what = ["wasm-bindgen-cli", "--version", version];
  // Not --locked, as its lock file pins crates that do not build on all platforms.
  run("cargo", ["install", ...what, "--root", toolsDir, "--force"], { env: toolEnv });
}

/** A tool that runs for a second is not worth minutes of optimising. */
const toolEnv = {
  CARGO_PROFILE_RELEASE_OPT_LEVEL: "0",
  CARGO_PROFILE_RELEASE_LTO: "off",
  CARGO_PROFILE_RELEASE_CODEGEN_UNITS: "16",
};

/** What cargo compiles. */
function rustInputs() {
  const settings = ["Cargo.toml", "Cargo.lock", "rust-toolchain.toml"].map((file) =>
    join(root, file),
  );
  const files = [...filesBelow(join(root, "src")), ...settings, fileURLToPath(import.meta.url)];
  const compiler = [output("rustc", ["--version"]), JSON.stringify(wasmEnv)];
  return [...compiler, ...files.flatMap((file) => [file, readFileSync(file)])];
}

/**
 * What cargo makes of a module. It takes the place of that of the module before, so cargo finds none of them fresh.
 *
 * @param {WasmModule} module
 * @param {(string | Buffer)[]} inputs
 */
async function compile({ name, feature }, inputs) {
  const compiled = join(root, "target", `${name}.compiled.wasm`);
  await unlessFresh(`${name}.compiled.sha256`, inputs, [compiled], async () => {
    const target = "wasm32-unknown-unknown";
    const what = ["--profile", "wasm", "--lib", "--target", target, "--features", feature];
    await runAsync("cargo", ["build", ...what], { env: wasmEnv });
    cpSync(join(root, "target", target, "wasm", "depthstitch.wasm"), compiled);
  });
  return compiled;
}

/** Adds the JavaScript bindings and makes the module small. @param {WasmModule} module @param {string} compiled */
async function finish({ name, folder, opt }, compiled) {
  const final = join(folder, `${name}_bg.wasm`);
  const outputs = [final, join(folder, `${name}.js`), join(folder, `${name}.d.ts`)];
  const optimiser = readFileSync(join(root, "node_modules", "binaryen", "package.json"));
  const inputs = [
    readFileSync(compiled),
    bindgenVersion(),
    optimiser,
    readFileSync(new URL(import.meta.url)),
  ];
  await unlessFresh(`${name}.sha256`, inputs, outputs, async () => {
    run(bin("wasm-bindgen"), [compiled, "--out-dir", folder, "--out-name", name, ...flags]);
    const raw = join(root, "target", `${name}.unoptimised.wasm`);
    const text = join(root, "target", `${name}.wat`);
    cpSync(final, raw);
    const wasmOpt = npmBin("binaryen", "wasm-opt");
    /** @param {string} from @param {string} to @param {string[]} options */
    const optimise = (from, to, options) =>
      runAsync(process.execPath, [wasmOpt, from, "-o", to, ...options, ...wasmFeatures]);
    // Names are needed to shorten imports, and stripped afterwards. The second time it still finds something.
    await optimise(raw, text, [...opt, "--debuginfo", "--emit-text"]);
    shortenImports(text, join(folder, `${name}.js`));
    await optimise(text, final, [...opt, "--strip-debug"]);
  });
}

/** All modules: one is finished while the next is compiled, as either keeps one core busy. */
async function buildModules() {
  const inputs = rustInputs();
  let finishing = async () => {};
  for (const module of modules) {
    const [compiled] = await Promise.all([compile(module, inputs), finishing()]);
    finishing = () => finish(module, compiled);
  }
  await finishing();
}

/**
 * wasm-bindgen names each import by what it is and a hash: together more than a kilobyte that does not compress. Nobody but
 * its own JavaScript calls them.
 *
 * @param {string} text the module @param {string} glue the JavaScript
 */
function shortenImports(text, glue) {
  /** @type {Map<string, string>} */
  const short = new Map();
  const module = readFileSync(text, "utf8").replace(
    /\(import "(.*?)" "(.*?)"/g,
    (_, from, name) => {
      short.set(name, `i${short.size.toString(36)}`);
      return `(import "${from}" "${short.get(name)}"`;
    },
  );
  writeFileSync(text, module);
  const names = readFileSync(glue, "utf8").replace(
    /^( {8})(\w+)(?=: function)/gm,
    (_, indent, name) => indent + (short.get(name) ?? name),
  );
  writeFileSync(glue, names);
}

const flags = [
  "--target",
  "web",
  // The package passes the location of its wasm.
  "--omit-default-module-path",
  "--remove-producers-section",
  "--ts-typed-array-buffers",
  // Allows calls after one that trapped.
  "--experimental-reset-state-function",
];

function buildTypeScript() {
  // The public types are published next to the bindings.
  mkdirSync(wasmDir, { recursive: true });
  cpSync(join(root, "src", "wasm", "types.d.ts"), join(wasmDir, "types.d.ts"));
  // The compiler copies no declarations.
  cpSync(join(root, "js", "wasm-file.d.ts"), join(dist, "wasm-file.d.ts"));
  run(process.execPath, [npmBin("typescript-7", "tsc"), "-p", root]);
  // They would be packed.
  for (const file of withoutSource(dist, join(root, "js"))) rmSync(file);
}

/**
 * What the compiler has made of files that are no longer there.
 *
 * @param {string} outputs @param {string} sources
 */
export function withoutSource(outputs, sources) {
  return filesBelow(outputs).filter((file) => {
    if (basename(dirname(file)) === "wasm") return false;
    const source = join(sources, relative(outputs, file));
    return ![source, source.replace(/(\.d)?\.[jt]s$/, ".ts")].some((path) => existsSync(path));
  });
}

/** Types for TypeScript before 5.7, whose typed arrays have no type parameter. */
function downlevelTypes() {
  const old = join(dist, "types-5.6");
  rmSync(old, { recursive: true, force: true });
  const files = readdirSync(dist, { recursive: true, encoding: "utf8" });
  for (const file of files.filter((file) => file.endsWith(".d.ts"))) {
    if (/^(bench|eval|cli)\b/.test(file)) continue;
    const text = readFileSync(join(dist, file), "utf8");
    mkdirSync(join(old, file, ".."), { recursive: true });
    writeFileSync(join(old, file), text.replace(/(\bU?[A-Z]\w*Array)<ArrayBuffer(Like)?>/g, "$1"));
  }
}

export async function build() {
  setup();
  await buildModules();
  buildTypeScript();
  downlevelTypes();
}

if (isMain(import.meta.url)) await build();
