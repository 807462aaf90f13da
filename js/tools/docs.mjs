// `npm run docs`: the API's reference as a static site in target/reference, from the published types. Warnings are errors.
import { existsSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { isMain, root } from "./shared.mjs";

const out = join(root, "target", "reference");

/** Entry points of the package that have types, by name. @returns {Map<string, string>} */
function entryPoints() {
  const { name, exports } = JSON.parse(readFileSync(join(root, "package.json"), "utf8"));
  /** @type {[string, { types?: string }][]} */
  const all = Object.entries(exports);
  // The worker is run and exports nothing; files of wasm are given to `init`.
  const typed = all.filter(([entry, { types }]) => types && !/^\.\/worker$|\.wasm$/.test(entry));
  return new Map(
    typed.map(([entry, { types = "" }]) => [name + entry.slice(1), join(root, types)]),
  );
}

/** Writes the reference; its folder. */
export async function writeReference() {
  const { Application } = await import("typedoc");
  const entries = entryPoints();
  for (const file of entries.values()) {
    if (!existsSync(file)) throw new Error(`${file} is missing: run \`npm run build\` first`);
  }
  const app = await Application.bootstrap({
    name: "depthstitch",
    entryPoints: [...entries.values()],
    tsconfig: join(root, "tsconfig.reference.json"),
    readme: "none",
    // The types are generated: their lines are of no use to readers.
    disableSources: true,
    includeVersion: true,
    navigationLinks: { Repository: "https://github.com/depthstitch/depthstitch" },
    treatWarningsAsErrors: true,
    validation: { notExported: true, invalidLink: true, rewrittenLink: true, notDocumented: false },
    // What the constructor of errors takes; callers receive errors and make none.
    intentionallyNotExported: ["ErrorRecord"],
  });
  const project = await app.convert();
  if (!project) throw new Error("the types could not be read");
  app.validate(project);
  for (const module of project.children ?? []) module.name = nameOf(module.name, entries);
  await app.generateDocs(project, out);
  const { errorCount, warningCount } = app.logger;
  if (errorCount + warningCount > 0) throw new Error("the reference has errors or warnings");
  return out;
}

/** The name by which a module is imported. @param {string} path @param {Map<string, string>} entries */
function nameOf(path, entries) {
  for (const [name, file] of entries) {
    const module = file.slice(join(root, "dist").length + 1).replace(/\.d\.ts$/, "");
    if ([module, dirname(module)].includes(path)) return name;
  }
  throw new Error(`${path} is no entry point`);
}

if (isMain(import.meta.url)) console.log(await writeReference());
