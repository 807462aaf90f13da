// `node js/tools/release.mjs v1.2.3`: fails unless everything that names a version names this one. Without a tag it compares them with
// package.json, and the changelog may call the version unreleased.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { isMain, root } from "./shared.mjs";

/** @param {string} file */
const text = (file) => readFileSync(join(root, file), "utf8");

/** The files that name the version, with what they say. @returns {Map<string, string | undefined>} */
export function versions() {
  const lock = JSON.parse(text("package-lock.json"));
  const examples = ["node", "vite", "html"].map((name) => `examples/${name}/package.json`);
  return new Map([
    ["package.json", JSON.parse(text("package.json")).version],
    ["package-lock.json", lock.version],
    ["package-lock.json, packages", lock.packages[""].version],
    ["Cargo.toml", /^\[package\]\n(?:.+\n)*?version = "(.+)"$/m.exec(text("Cargo.toml"))?.[1]],
    ["Cargo.lock", /^name = "depthstitch"\nversion = "(.+)"$/m.exec(text("Cargo.lock"))?.[1]],
    ["CHANGELOG.md", newest(text("CHANGELOG.md")).version],
    ...examples.map(
      (file) => /** @type {const} */ ([file, JSON.parse(text(file)).dependencies.depthstitch]),
    ),
  ]);
}

/** The newest version of a changelog, and its date. @param {string} changelog */
export function newest(changelog) {
  const heading = /^## (\S+) \((unreleased|\d{4}-\d\d-\d\d)\)$/m.exec(changelog);
  return { version: heading?.[1], date: heading?.[2] };
}

/**
 * What is wrong with the versions.
 *
 * @param {Map<string, string | undefined>} found
 * @param {string} [tag] of the release, if one is being made
 * @param {string} [date] in the changelog
 */
export function problems(found, tag, date) {
  const wanted = tag === undefined ? found.get("package.json") : tag.replace(/^v/, "");
  const semantic = /^(?:0|[1-9]\d*)\.(?:0|[1-9]\d*)\.(?:0|[1-9]\d*)(?:-[0-9A-Za-z.-]+)?$/;
  const wrong = [...found].filter(([, version]) => version !== wanted);
  const list = wrong.map(
    ([file, version]) => `${file} says ${version ?? "nothing"}, not ${wanted}`,
  );
  if (!semantic.test(wanted ?? "")) list.push(`${wanted} is not a semantic version`);
  if (tag !== undefined && !tag.startsWith("v")) list.push(`the tag ${tag} does not begin with v`);
  if (tag !== undefined && date === "unreleased") {
    list.push(`CHANGELOG.md calls ${wanted} unreleased: it needs the date`);
  }
  return list;
}

if (isMain(import.meta.url)) {
  const [tag] = process.argv.slice(2);
  const { version, date } = newest(text("CHANGELOG.md"));
  const wrong = problems(versions(), tag, date);
  for (const line of wrong) console.error(line);
  if (wrong.length > 0) process.exitCode = 1;
  else console.log(`Everything says ${version}.`);
}
