// Renders the sample, two photos with exact depth, for the page and the tests.
import { existsSync, mkdirSync, readdirSync, statSync } from "node:fs";
import { join } from "node:path";
import { exampleRun, isMain, root, run } from "./shared.mjs";

const renderer = join(root, "tests", "scene");

/**
 * Renders the sample into `folder`, unless it exists and is newer than the renderer.
 *
 * @param {string} folder
 * @param {number[]} size width and height in pixels (default 960×640)
 */
export function renderSample(folder = join("www", "public", "sample"), ...size) {
  const made = join(root, folder, "case.json");
  if (existsSync(made) && statSync(made).mtimeMs > newest(renderer)) return;
  mkdirSync(join(root, folder), { recursive: true });
  run("cargo", exampleRun("render-sample", [folder, ...size.map(String)]));
}

/** Time of the latest change of a file below `folder`, in milliseconds. @param {string} folder */
function newest(folder) {
  const files = readdirSync(folder, { recursive: true }).map((file) => join(folder, String(file)));
  return Math.max(...files.map((file) => statSync(file).mtimeMs));
}

if (isMain(import.meta.url)) renderSample();
