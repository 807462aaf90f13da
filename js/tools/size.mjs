// Checks the size budgets of the wasm modules, and that the core uses SIMD.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { isMain, root } from "./shared.mjs";

/** Maximum size of each module in bytes, compressed by gzip -9. */
const budgets = { depthstitch: 246 * 1024, many: 356 * 1024, codecs: 200 * 1024 };

export async function checkSize() {
  const { default: binaryen } = await import("binaryen");
  const failures = [];
  for (const [name, budget] of Object.entries(budgets)) {
    const wasm = readFileSync(join(root, "dist", "wasm", `${name}_bg.wasm`));
    const zipped = gzipSync(wasm, { level: 9 }).length;
    console.log(`${name}: ${kib(wasm.length)}, ${kib(zipped)} gzipped, budget ${kib(budget)}`);
    if (zipped > budget) failures.push(`${name} is ${zipped - budget} bytes over its budget`);
  }
  const core = readFileSync(join(root, "dist", "wasm", "depthstitch_bg.wasm"));
  const module = binaryen.readBinary(core);
  const text = module.emitText();
  module.dispose();
  // Loads and stores also result from copying structures; arithmetic on lanes does not.
  const lanes = /\b(?:i16x8|i32x4|f32x4|f64x2)\.(?:add|sub|mul|div|sqrt|min|max|convert\w*)\b/g;
  const simd = text.match(lanes)?.length ?? 0;
  console.log(`depthstitch: ${simd} SIMD arithmetic instructions`);
  if (simd === 0) failures.push("the core has no SIMD arithmetic");
  if (failures.length > 0) throw new Error(failures.join("; "));
}

/** @param {number} bytes */
const kib = (bytes) => `${(bytes / 1024).toFixed(1)} KB`;

if (isMain(import.meta.url)) await checkSize();
