// What is made again only after its inputs have changed, by their contents: a copy or a checkout has the times of its own.
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { root } from "./shared.mjs";

/**
 * Calls `make` unless `outputs` exist and were made from the same inputs.
 *
 * @param {string} name
 * @param {(string | Buffer)[]} inputs
 * @param {string[]} outputs
 * @param {() => void | Promise<void>} make
 */
export async function unlessFresh(name, inputs, outputs, make) {
  const hash = createHash("sha256");
  for (const input of inputs) hash.update(input).update("\0");
  const digest = hash.digest("hex");
  const stamp = join(root, "target", "stamps", name);
  if (outputs.every((file) => existsSync(file)) && existsSync(stamp)) {
    if (readFileSync(stamp, "utf8") === digest) return;
  }
  rmSync(stamp, { force: true });
  await make();
  mkdirSync(join(stamp, ".."), { recursive: true });
  writeFileSync(stamp, digest);
}

/** The files below a folder, in order. @param {string} folder */
export function filesBelow(folder) {
  return readdirSync(folder, { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => join(entry.parentPath, entry.name))
    .sort();
}
