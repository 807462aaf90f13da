// The Rust tests as wasm under Node. One program of tests uses one thread, and cargo runs one program after another.
import { spawn } from "node:child_process";
import { readFileSync } from "node:fs";
import { availableParallelism } from "node:os";
import { relative } from "node:path";
import { bin, cargoEnv, output, root, run } from "./shared.mjs";

const TARGET = ["--target", "wasm32-unknown-unknown"];

/** As what is shipped: without what debuggers read, which is most of a program, and without the checks that the native tests make. */
const asShipped = {
  CARGO_PROFILE_DEV_DEBUG: "none",
  CARGO_PROFILE_DEV_OPT_LEVEL: "2",
  CARGO_PROFILE_DEV_OVERFLOW_CHECKS: "false",
  CARGO_PROFILE_DEV_DEBUG_ASSERTIONS: "false",
};

/** How the source of a program begins that has no tests in wasm. */
const NATIVE = /^#!\[cfg\(not\(target_arch = "wasm32"\)\)\]$/m;

/**
 * Builds the programs and runs them, one on each core. Throws at the end if any failed, or had no test.
 *
 * @param {string[]} args
 */
export async function wasmTests(args) {
  const build = ["test", ...args, "--lib", "--test", "*", ...TARGET, "--no-run"];
  const env = { ...cargoEnv, ...asShipped };
  run("cargo", build, { env });
  const programs = output("cargo", [...build, "--quiet", "--message-format=json"], { env })
    .split("\n")
    .filter((line) => line.startsWith("{"))
    .map((line) => JSON.parse(line))
    .filter(({ reason, executable, profile, target }) => {
      if (reason !== "compiler-artifact" || !executable || !profile.test) return false;
      return !NATIVE.test(readFileSync(target.src_path, "utf8"));
    })
    .map(({ executable }) => String(executable));
  if (programs.length === 0) throw new Error("cargo built no tests");

  /** @type {string[]} */
  const failed = [];
  const waiting = [...programs];
  const worker = async () => {
    for (let program = waiting.shift(); program; program = waiting.shift()) {
      const { passed, text } = await runProgram(program);
      console.log(`\n     Running ${relative(root, program)}\n${text}`);
      if (!passed) failed.push(relative(root, program));
    }
  };
  await Promise.all(Array.from({ length: availableParallelism() }, worker));
  if (failed.length > 0) throw new Error(`tests failed in ${failed.join(", ")}`);
}

/**
 * What one program prints, whole, as others print meanwhile.
 *
 * @param {string} program
 * @returns {Promise<{ passed: boolean, text: string }>}
 */
function runProgram(program) {
  return new Promise((resolve, reject) => {
    const child = spawn(bin("wasm-bindgen-test-runner"), [program], {
      cwd: root,
      stdio: ["ignore", "pipe", "pipe"],
    });
    let text = "";
    for (const stream of [child.stdout, child.stderr]) {
      stream.setEncoding("utf8").on("data", (/** @type {string} */ part) => (text += part));
    }
    child.on("error", reject);
    // It is content with a program without tests.
    child.on("close", (code) =>
      resolve({ passed: code === 0 && / [1-9]\d* passed/.test(text), text }),
    );
  });
}
