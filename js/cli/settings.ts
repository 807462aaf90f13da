import type { Options } from "../index.js";
import { OPTIONS, OPTION_LIST, type OptionName, type OptionSpec } from "../options.js";
import { parseDecimal } from "../cases/number.js";
import { UsageError } from "./usage.js";

/** The names of all options of `stitch`, in the order of the help. */
export const SETTING_NAMES: readonly OptionName[] = OPTION_LIST.map(([name]) => name);

/** Whether `name` is an option of `stitch`, spelled as in JavaScript. */
export function isSettingName(name: string): name is OptionName {
  return Object.hasOwn(OPTIONS, name);
}

/**
 * Sets the option `name` from text.
 *
 * @throws UsageError for text of the wrong type. Ranges are checked by the core.
 */
export function applySetting(
  to: Partial<Options>,
  name: OptionName,
  text: string,
  label: string,
): void {
  try {
    Object.assign(to, { [name]: parseOption(OPTIONS[name], text) });
  } catch (error) {
    if (error instanceof UsageError) throw new UsageError(`${label} must be ${error.message}`);
    throw error;
  }
}

function parseOption(spec: OptionSpec, text: string): string | number | boolean {
  switch (spec.type) {
    case "boolean":
      return parseChoice(text, ["on", "off"]) === "on";
    case "choice":
      return parseChoice(text, Object.keys(spec.choices));
    default:
      if (text === spec.keyword) return text;
      return parseNumber(text, spec.keyword ? `a number or "${spec.keyword}"` : "a number");
  }
}

/** What stands for the value of an option in the help. */
export function placeholder(spec: OptionSpec): string {
  switch (spec.type) {
    case "boolean":
      return "on|off";
    case "choice":
      return Object.keys(spec.choices).join("|");
    default:
      return spec.keyword ? `N|${spec.keyword}` : "N";
  }
}

/** `maxTrials` as a flag: `max-trials`. */
export function flagName(name: string): string {
  return name.replaceAll(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`);
}

/** The decimal number in `text`. */
export function parseNumber(text: string, expected = "a number"): number {
  const value = parseDecimal(text);
  if (value === undefined) throw new UsageError(`${expected}, got ${JSON.stringify(text)}`);
  return value;
}

/** The element of `words` that equals `text`. */
export function parseChoice<const T extends string>(text: string, words: readonly T[]): T {
  const found = words.find((word) => word === text);
  if (found === undefined)
    throw new UsageError(`one of ${words.join(", ")}, got ${JSON.stringify(text)}`);
  return found;
}
