// Renders the sample, two photos with exact depth, for the page and the tests.
import { mkdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { filesBelow, unlessFresh } from "./fresh.mjs";
import { exampleRun, isMain, root, run } from "./shared.mjs";

const renderer = join(root, "tests", "scene");

/**
 * Renders the sample into `folder`, unless it was made by the present renderer.
 *
 * @param {string} folder
 * @param {number[]} size width and height in pixels (default 960×640)
 */
export function renderSample(folder = join("www", "public", "sample"), ...size) {
  const args = [folder, ...size.map(String)];
  const inputs = [...args, ...filesBelow(renderer).map((file) => readFileSync(file))];
  const name = `${folder.replaceAll(/[\\/]/g, "-")}.sha256`;
  return unlessFresh(name, inputs, [join(root, folder, "case.json")], () => {
    mkdirSync(join(root, folder), { recursive: true });
    run("cargo", exampleRun("render-sample", args));
  });
}

if (isMain(import.meta.url)) await renderSample();
