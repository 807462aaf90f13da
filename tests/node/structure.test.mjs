// No module imports itself through others.
import assert from "node:assert/strict";
import { readdirSync, readFileSync, statSync } from "node:fs";
import { dirname, join, relative } from "node:path";
import { test } from "node:test";
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
