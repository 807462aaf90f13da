// docs/api.md: every export of every entry point, as its published declarations describe it. The declarations are read by
// oxc, the parser inside Vite.
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { parseSync } from "vite";
import { root } from "./shared.mjs";

/** The entry points of the package, and what they are for. */
const ENTRIES = [
  ["depthstitch", "index.d.ts"],
  ["depthstitch/codecs", "codecs.d.ts"],
  ["depthstitch/depth", "depth/index.d.ts"],
  ["depthstitch/inpaint", "inpaint/index.d.ts"],
  ["depthstitch/cases", "cases/index.d.ts"],
  ["depthstitch/options", "options.d.ts"],
];

/**
 * @typedef {object} Entry
 * @property {string} name
 * @property {string} comment its documentation, without asterisks
 * @property {string} code its declaration
 * @property {boolean} isType
 */

/** The document. */
export function apiDocument() {
  /** @type {Map<string, string>} where a declaration has been described already */
  const described = new Map();
  const sections = ENTRIES.map(([name = "", file = ""]) => {
    const path = join(root, "dist", file);
    const all = [...exportsOf(path).values()];
    const first = all.filter(({ code }) => !described.has(code));
    const again = all.filter(({ code }) => described.has(code));
    const from = again.map(({ name, code }) => `\`${name}\` of \`${described.get(code)}\``);
    for (const { code } of first) described.set(code, name);
    const values = first.filter(({ isType }) => !isType);
    const types = first.filter(({ isType }) => isType);
    return [
      `## \`${name}\`\n`,
      headComment(path),
      ...values.map(describe),
      ...types.map(describe),
      from.length > 0 ? `Exports as well: ${from.join(", ")}.\n` : "",
    ]
      .filter(Boolean)
      .join("\n");
  });
  return `<!-- Generated from the published types by \`npm run generate\`. -->

# API

Pixel centres are integers, the origin is at the top left, x points right, y points down. \`target\` is warped onto
\`reference\`. Options are in [options.md](options.md).

${sections.join("\n")}`;
}

/** @param {Entry} entry */
function describe({ name, comment, code }) {
  const { text, tags } = parts(comment);
  // The options have a document of their own.
  const shown = name === "Options" || name === "OPTIONS" ? "" : `\n\`\`\`ts\n${code}\n\`\`\`\n`;
  return `### \`${name}\`\n\n${[text, tags].filter(Boolean).join("\n\n")}\n${shown}`;
}

/** A comment's text and what it says about errors. @param {string} comment */
function parts(comment) {
  const linked = comment.replaceAll(/\{@link (\w+)\}/g, "`$1`");
  const [text = "", ...tags] = linked.split(/^@/m);
  const throws = tags
    .filter((tag) => tag.startsWith("throws"))
    .map((tag) => tag.replace(/^throws\s+\{(\w+)\}\s*/, "Throws `$1`: ").replace(/: $/, "."));
  return { text: text.trim(), tags: throws.map((tag) => tag.trim()).join("\n") };
}

/** Everything that a module exports, by name. @param {string} path @returns {Map<string, Entry>} */
function exportsOf(path) {
  const { source, body, commentBefore } = parse(path);
  /** @type {Map<string, Entry>} */
  const found = new Map();
  for (const node of body) {
    const from =
      node.source && exportsOf(join(dirname(path), node.source.value.replace(/\.js$/, ".d.ts")));
    if (node.type === "ExportAllDeclaration") {
      for (const [name, entry] of from ?? []) found.set(name, entry);
    } else if (node.type === "ExportNamedDeclaration" && node.declaration) {
      const { id, type, declarations } = node.declaration;
      const name = id?.name ?? declarations?.[0]?.id.name;
      const code = source.slice(node.start, node.end).replace(/^export (declare )?/, "");
      const isType = /Interface|TypeAlias/.test(type);
      found.set(name, { name, comment: commentBefore(node.start), code, isType });
    } else if (node.type === "ExportNamedDeclaration") {
      for (const { local, exported } of node.specifiers) {
        const entry = from?.get(local.name);
        if (!entry)
          throw new Error(`${path}: ${local.name} is not exported by ${node.source?.value}`);
        found.set(exported.name, { ...entry, name: exported.name });
      }
    }
  }
  return found;
}

/** The comment at the head of a module, which describes the whole entry point. @param {string} path */
function headComment(path) {
  const { source } = parse(path);
  const head = /^\/\*\*[^]*?\*\//.exec(source)?.[0] ?? "";
  return head && !source.slice(head.length).startsWith("\nexport")
    ? `${parts(clean(head)).text}\n`
    : "";
}

/** @param {string} path */
function parse(path) {
  const source = readFileSync(path, "utf8");
  const { program, comments, errors } = parseSync(path, source);
  if (errors.length > 0) throw new Error(`${path}: ${errors[0]?.message}`);
  const body = /** @type {any[]} */ (program.body);
  const commentBefore = (/** @type {number} */ start) => {
    const last = comments.filter(({ end }) => end <= start).at(-1);
    if (!last || source.slice(last.end, start).trim() !== "") return "";
    return clean(source.slice(last.start, last.end));
  };
  return { source, body, commentBefore };
}

/** A comment without its asterisks. @param {string} comment */
function clean(comment) {
  return comment
    .replace(/^\/\*\*\s?/, "")
    .replace(/\s*\*\/$/, "")
    .replaceAll(/^\s*\* ?/gm, "");
}
