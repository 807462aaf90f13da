// `npm run pack`: the npm package as a file. It is packed from a copy, whose README links to the repository: npm shows the README
// without the files that it links to.
import { cpSync, existsSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { basename, join } from "node:path";
import { isMain, npm, root } from "./shared.mjs";

const staged = join(root, "target", "npm-package");

/**
 * A document of the repository's root with absolute links, to the files of a released version.
 *
 * @param {string} markdown
 * @param {string} version
 */
export function withAbsoluteLinks(markdown, version) {
  return markdown.replaceAll(/(!?)(\[[^\]]*\])\(([^)\s]+)\)/g, (link, image, text, address) => {
    if (/^(?:[a-z]+:|#)/i.test(address)) return link;
    const [path = "", anchor] = address.split("#");
    const file = join(root, path);
    if (!existsSync(file)) throw new Error(`a link leads to ${path}, which does not exist`);
    const kind = statSync(file).isDirectory() ? "tree" : "blob";
    const base = image
      ? `https://raw.githubusercontent.com/${repository()}/v${version}`
      : `https://github.com/${repository()}/${kind}/v${version}`;
    return `${image}${text}(${base}/${path}${anchor ? `#${anchor}` : ""})`;
  });
}

/** Owner and name of the repository on GitHub. */
function repository() {
  const name = /github\.com\/([\w-]+\/[\w-]+)\.git$/.exec(manifest().repository.url)?.[1];
  if (!name) throw new Error("package.json names no repository on GitHub");
  return name;
}

/** @returns {{ version: string, repository: { url: string } }} */
function manifest() {
  return JSON.parse(readFileSync(join(root, "package.json"), "utf8"));
}

/** Copies what is packed to `target/npm-package`, and returns that folder. The package must have been built. */
export function stage() {
  rmSync(staged, { recursive: true, force: true });
  const unpublished = [join(root, "dist", "bench"), join(root, "dist", "eval")];
  cpSync(join(root, "dist"), join(staged, "dist"), {
    recursive: true,
    filter: (file) => !unpublished.includes(file),
  });
  for (const file of ["package.json", "LICENSE"]) cpSync(join(root, file), join(staged, file));
  const readme = readFileSync(join(root, "README.md"), "utf8");
  writeFileSync(join(staged, "README.md"), withAbsoluteLinks(readme, manifest().version));
  return staged;
}

/** Packs the package, which must have been built, into a folder; the file's path. */
export function pack(folder = root) {
  npm(["pack", stage(), "--ignore-scripts", "--silent", "--pack-destination", folder]);
  return join(folder, `depthstitch-${manifest().version}.tgz`);
}

if (isMain(import.meta.url)) console.log(basename(pack()));
