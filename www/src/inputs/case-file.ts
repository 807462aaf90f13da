import type { DepthSettings, SlotName } from "../state.js";
import { UnusableFile } from "../unusable-file.js";

/** A case: the names of its files and what its depth values mean. */
export interface Case {
  readonly name: string;
  readonly files: { readonly [K in SlotName]?: string };
  readonly depth: DepthSettings;
}

const keys: readonly (readonly [SlotName, string])[] = [
  ["target", "target"],
  ["reference", "reference"],
  ["targetDepth", "target_depth"],
  ["referenceDepth", "reference_depth"],
  ["matches", "matches"],
];

/**
 * Reads a `case.json`. `depth.scale` is not needed: the geometry is the same for any scale of depth.
 *
 * @throws {UnusableFile} naming what is missing
 */
export function parseCase(text: string, file: string): Case {
  const root = record(parse(text, file));
  if (!root) throw new UnusableFile(`${file} is not a case: it holds no object.`);
  const files: { [K in SlotName]?: string } = {};
  for (const [slot, key] of keys) {
    const value = root[key];
    if (typeof value === "string") files[slot] = value;
  }
  if (files.target === undefined || files.reference === undefined) {
    throw new UnusableFile(`${file} is not a case: it names no “target” and “reference”.`);
  }
  const depth = record(root["depth"]);
  if (!depth) {
    delete files.targetDepth;
    delete files.referenceDepth;
  }
  const name = root["name"];
  return {
    name: typeof name === "string" ? name : file,
    files,
    depth: depth ? settings(depth, file) : { kind: "inverse", invalid: null },
  };
}

function settings(depth: Readonly<Record<string, unknown>>, file: string): DepthSettings {
  const kind = depth["kind"];
  if (kind !== "inverse" && kind !== "metric") {
    throw new UnusableFile(`${file}: depth.kind must be “inverse” or “metric”.`);
  }
  const invalid = depth["invalid"] ?? null;
  if (invalid !== null && typeof invalid !== "number") {
    throw new UnusableFile(`${file}: depth.invalid must be a number or null.`);
  }
  return { kind, invalid };
}

function parse(text: string, file: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    throw new UnusableFile(`${file} is not valid JSON.`);
  }
}

function record(value: unknown): Readonly<Record<string, unknown>> | null {
  return typeof value === "object" && value !== null && !Array.isArray(value)
    ? Object.fromEntries(Object.entries(value))
    : null;
}
