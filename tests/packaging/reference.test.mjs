// The API's reference, as a site.
import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { writeReference } from "../../js/tools/docs.mjs";

test("the reference of the API is written without a warning", async () => {
  const folder = await writeReference();
  const index = readFileSync(join(folder, "index.html"), "utf8");
  for (const name of ["", "/codecs", "/depth", "/inpaint", "/cases", "/options"]) {
    assert.ok(index.includes(`>depthstitch${name}<`), `depthstitch${name} is listed`);
  }
  assert.ok(existsSync(join(folder, "functions", "depthstitch.stitchMany.html")));
});
