// Renders the sample pair of photos with known depth that the page and the tests use.
import { existsSync, mkdirSync, readdirSync, statSync } from "node:fs";
import { join } from "node:path";
import { isMain, root, run } from "./shared.mjs";

const renderer = join(root, "tests", "scene");

/**
 * Renders the sample into `folder` unless it is there and newer than the program that renders it.
 *
 * @param {string} folder
 * @param {number[]} size width and height in pixels, if not the usual ones
 */
export function renderSample(folder = join("www", "public", "sample"), ...size) {
  const made = join(root, folder, "case.json");
  if (existsSync(made) && statSync(made).mtimeMs > newest(renderer)) return;
  mkdirSync(join(root, folder), { recursive: true });
  run("cargo", [
    "run",
    "--release",
    "--example",
    "render-sample",
    "--",
    folder,
    ...size.map(String),
  ]);
}

/** When the newest file below `folder` was changed, in milliseconds. @param {string} folder */
function newest(folder) {
  const files = readdirSync(folder, { recursive: true }).map((file) => join(folder, String(file)));
  return Math.max(...files.map((file) => statSync(file).mtimeMs));
}

if (isMain(import.meta.url)) renderSample();
