// No module imports itself through others, and none outlasts its source.
import assert from "node:assert/strict";
import { mkdtemp, mkdir, rm, writeFile } from "node:fs/promises";
import { readdirSync, readFileSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, relative } from "node:path";
import { test } from "node:test";
import { withoutSource } from "../../js/tools/build.mjs";
import { root } from "../../js/tools/shared.mjs";

/** All TypeScript modules below a folder. @param {string} folder @returns {string[]} */
function modules(folder) {
  return readdirSync(folder).flatMap((name) => {
    const path = join(folder, name);
    if (statSync(path).isDirectory()) return modules(path);
    return /\.m?ts$/.test(name) && !name.endsWith(".d.ts") ? [path] : [];
  });
}

/** The modules that a module imports by relative paths. @param {string} path */
function imports(path) {
  const source = readFileSync(path, "utf8");
  return [...source.matchAll(/^(?:import|export)\b[^;]*?\bfrom "(\.[^"]+)"/gm)].map(
    ([, name = ""]) => join(dirname(path), name).replace(/\.js$/, ".ts"),
  );
}

for (const folder of ["js", join("www", "src")]) {
  test(`${folder} has no circular imports`, () => {
    const graph = new Map(modules(join(root, folder)).map((path) => [path, imports(path)]));
    assert.ok([...graph.values()].flat().length > 20, "imports are found");
    /** @type {Set<string>} */
    const done = new Set();
    const visit = (/** @type {string} */ path, /** @type {string[]} */ trail) => {
      const start = trail.indexOf(path);
      const cycle = [...trail.slice(start), path].map((file) => relative(root, file));
      assert.equal(start, -1, cycle.join(" → "));
      if (done.has(path)) return;
      for (const next of graph.get(path) ?? []) visit(next, [...trail, path]);
      done.add(path);
    };
    for (const path of graph.keys()) visit(path, []);
  });
}

test("what was compiled from a file that is gone is found", async (t) => {
  const folder = await mkdtemp(join(tmpdir(), "depthstitch-build-"));
  t.after(() => rm(folder, { recursive: true }));
  const [sources, outputs] = [join(folder, "js"), join(folder, "dist")];
  const files = {
    [sources]: ["a.ts", "part/b.ts", "given.d.ts"],
    [outputs]: ["a.js", "a.d.ts", "part/b.js", "given.d.ts", "wasm/glue.js"],
  };
  const stale = ["gone.js", "part/gone.d.ts", "types-5.6/a.d.ts"];
  for (const [place, names] of [
    ...Object.entries(files),
    /** @type {const} */ ([outputs, stale]),
  ]) {
    for (const name of names) {
      await mkdir(dirname(join(place, name)), { recursive: true });
      await writeFile(join(place, name), "");
    }
  }
  assert.deepEqual(
    withoutSource(outputs, sources).sort(),
    stale.map((name) => join(outputs, name)),
  );
});
