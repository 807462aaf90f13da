// The table of options as Rust, as TypeScript and as a document.

/** @typedef {import("../../dist/options.js").OptionSpec} OptionSpec */
/** @typedef {readonly (readonly [name: string, spec: OptionSpec])[]} List */

const WIDTH = 120;

/** `src/wasm/specs.rs`: what the core checks. @param {List} list */
export function specsOf(list) {
  const constants = list.map(([name, spec]) => {
    const { expected, min, max, choices } = rustParts(spec);
    const constant = name.replaceAll(/[A-Z]/g, (letter) => `_${letter}`).toUpperCase();
    const fields = `name: "${name}", expected: "${expected}", min: ${min}, max: ${max}, choices: &[${choices}]`;
    // As rustfmt lays it out.
    const head = `pub(super) const ${constant}: Spec =`;
    const literal = `Spec { ${fields} };`;
    if (head.length + 1 + literal.length <= WIDTH) return `${head} ${literal}`;
    if (4 + literal.length <= WIDTH) return `${head}\n    ${literal}`;
    const rows = fields.split(/, (?=\w+: )/).map((field) => `    ${field},\n`);
    return `pub(super) const ${constant}: Spec = Spec {\n${rows.join("")}};`;
  });
  return `//! Generated from \`js/options.ts\` by \`npm run generate\`.

/// What is known about one option.
pub(super) struct Spec {
    /// As JavaScript spells it.
    pub name: &'static str,
    /// What is accepted, for messages.
    pub expected: &'static str,
    /// The smallest number accepted.
    pub min: f64,
    /// The largest number accepted.
    pub max: f64,
    /// The words accepted.
    pub choices: &'static [&'static str],
}

${constants.join("\n")}
`;
}

/** @param {OptionSpec} spec */
function rustParts(spec) {
  if (spec.type === "boolean")
    return { expected: "true or false", min: "0.0", max: "0.0", choices: "" };
  if (spec.type === "choice") {
    const names = Object.keys(spec.choices);
    const quoted = names.map((name) => `'${name}'`);
    const expected = `${quoted.slice(0, -1).join(", ")} or ${quoted.at(-1)}`;
    return { expected, min: "0.0", max: "0.0", choices: names.map((n) => `"${n}"`).join(", ") };
  }
  const { min, max, exclusiveMin, exclusiveMax, keyword } = spec;
  const number = (/** @type {number} */ value) => `${value}.0`;
  return {
    expected: rangeText(spec, (word) => `'${word}'`),
    min: exclusiveMin ? `${number(min)}_f64.next_up()`.replace(".0_", "_") : number(min),
    max:
      max === undefined
        ? "f64::MAX"
        : exclusiveMax
          ? `${number(max)}_f64.next_down()`.replace(".0_", "_")
          : number(max),
    choices: keyword === undefined ? "" : `"${keyword}"`,
  };
}

/**
 * A range in words.
 *
 * @param {Extract<OptionSpec, { min: number }>} spec
 * @param {(word: string) => string} quote
 */
function rangeText({ type, min, max, exclusiveMin, exclusiveMax, keyword }, quote) {
  const kind = type === "integer" ? "an integer" : "a number";
  const or = keyword === undefined ? "" : `, or ${quote(keyword)}`;
  if (max === undefined) return `${kind} ${exclusiveMin ? "above" : "of at least"} ${min}${or}`;
  if (exclusiveMin && exclusiveMax) return `${kind} between ${min} and ${max}, exclusive${or}`;
  if (exclusiveMin) return `${kind} above ${min}, at most ${max}${or}`;
  return `${kind} from ${min} to ${max}${or}`;
}

/** The interface \`Options\`. @param {List} list */
export function interfaceOf(list) {
  const fields = list.map(([name, spec]) => {
    const unit = "unit" in spec && spec.unit ? ` Unit: ${spec.unit}.` : "";
    const paper = spec.paper === undefined ? "" : ` (${spec.paper} with mode "paper")`;
    const range = "min" in spec ? ` Range: ${rangeText(spec, (word) => `"${word}"`)}.` : "";
    const text = `${spec.description}${unit}${range} Default: ${spec.default}${paper}.`;
    return `${comment(text)}\n  ${name}: ${typeOf(spec)};`;
  });
  return `export interface Options {\n${fields.join("\n")}\n}`;
}

/** @param {OptionSpec} spec */
function typeOf(spec) {
  if (spec.type === "boolean") return "boolean";
  if (spec.type === "choice")
    return Object.keys(spec.choices)
      .map((choice) => `"${choice}"`)
      .join(" | ");
  return spec.keyword === undefined ? "number" : `number | "${spec.keyword}"`;
}

/** @param {string} text */
function comment(text) {
  const line = `  /** ${text} */`;
  if (line.length <= 100) return line;
  const lines = [""];
  for (const word of text.split(" ")) {
    const last = lines.at(-1) ?? "";
    if (last.length + word.length > 94) lines.push(word);
    else lines[lines.length - 1] = last === "" ? word : `${last} ${word}`;
  }
  return `  /**\n${lines.map((text) => `   * ${text}\n`).join("")}   */`;
}

const HEADINGS = {
  preset: "Preset",
  matching: "Feature matching",
  geometry: "Geometry",
  warping: "Depth and warping",
  compositing: "Compositing",
};

/** \`docs/options.md\`. @param {List} list */
export function optionsDocument(list) {
  const sections = Object.entries(HEADINGS).map(([group, heading]) => {
    const rows = list.filter(([, spec]) => spec.group === group).map(row);
    return `## ${heading}

| option | default | \`mode: "paper"\` | range | description |
|---|---|---|---|---|
${rows.join("\n")}
`;
  });
  return `<!-- Generated from js/options.ts by \`npm run generate\`. -->

# Options

All options are optional. \`await defaultOptions()\` returns them with their defaults, \`await defaultOptions("paper")\`
with those of the published method. \`depthstitch/options\` exports this table as data. On the command line
\`maxTrials: 500\` is \`--max-trials 500\`.

${sections.join("\n")}`;
}

/** @param {readonly [string, OptionSpec]} entry */
function row([name, spec]) {
  const value = (/** @type {unknown} */ value) => `\`${JSON.stringify(value)}\``;
  const paper = spec.paper === undefined ? "" : value(spec.paper);
  const unit = "unit" in spec && spec.unit ? ` (${spec.unit})` : "";
  const cells = [`\`${name}\``, value(spec.default), paper, range(spec) + unit, spec.description];
  return `| ${cells.join(" | ")} |`;
}

/** @param {OptionSpec} spec */
function range(spec) {
  if (spec.type === "boolean") return "`true`, `false`";
  if (spec.type === "choice")
    return Object.keys(spec.choices)
      .map((choice) => `\`"${choice}"\``)
      .join(", ");
  return rangeText(spec, (word) => `\`"${word}"\``);
}
