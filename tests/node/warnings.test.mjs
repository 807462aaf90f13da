// The codes of warnings are listed in Rust, in the types and in the guide.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { root } from "../../js/tools/shared.mjs";

/**
 * The codes in a part of a file.
 *
 * @param {string} path
 * @param {RegExp} part
 * @param {RegExp} code
 */
function codesIn(path, part, code) {
  const [text = ""] = part.exec(readFileSync(join(root, path), "utf8")) ?? [];
  return [...text.matchAll(code)].map(([, name]) => name).sort();
}

test("types and guide have every warning of the core", () => {
  const core = codesIn("src/report.rs", /pub fn code[^]*?\n    \}\n/, /=> "(.*)"/g);
  assert.ok(core.length > 10);
  const types = codesIn(
    "src/wasm/types.d.ts",
    /export type WarningCode =[^]*?\n\n/,
    /^  \| "(.*)"/gm,
  );
  assert.deepEqual(types, core);
  const guide = codesIn(
    "docs/guide.md",
    /Warnings have a stable `code`[^]*?\n## /,
    /^\| `(.*?)`/gm,
  );
  assert.deepEqual(guide, core);
});
