// Files that are written by `npm run generate` are current.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { documents, optionFiles } from "../../js/tools/generate.mjs";
import { root } from "../../js/tools/shared.mjs";

for (const [path, text] of [...(await optionFiles()), ...(await documents())]) {
  test(`${path} is current`, () => {
    const committed = readFileSync(join(root, path), "utf8");
    assert.ok(committed === text, `${path} is not what \`npm run generate\` writes`);
  });
}
