// Options that choose among a few values.
import { describe } from "./describe.js";
import { invalid } from "./errors.js";
import type { Output } from "./types.js";

/** The values of the option `workers`. */
export const WORKERS = [1, 2, 4, "auto"] as const;
export type Workers = (typeof WORKERS)[number];

/** The names in the option `outputs`. */
const OUTPUTS = Object.keys({
  mosaic: 0,
  voidMask: 0,
  seam: 0,
  warped: 0,
  footprint: 0,
  confidence: 0,
  projectedReference: 0,
} satisfies Record<Output, 0>) as Output[];

/** The pictures and masks that a result should contain. */
export function outputs(value: unknown): readonly Output[] {
  if (!Array.isArray(value)) throw invalid(`outputs must be an array, got ${describe(value)}`);
  return value.map((name: unknown, i) => {
    const known = OUTPUTS.find((output) => output === name);
    if (known !== undefined) return known;
    const names = OUTPUTS.map((output) => JSON.stringify(output)).join(", ");
    throw invalid(`outputs[${i}] must be one of ${names}, got ${describe(name)}`);
  });
}

/** How many workers a call may take. */
export function numberOfWorkers(value: unknown): Workers {
  const found = WORKERS.find((workers) => workers === value);
  if (found !== undefined) return found;
  const got = typeof value === "number" ? value : describe(value);
  throw invalid(
    `workers must be 1, 2, 4 or "auto", got ${got}`,
    typeof value === "number" ? { value } : {},
  );
}
