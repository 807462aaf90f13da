// Options that choose among a few values.
import { unexpected } from "./describe.js";
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
  if (!Array.isArray(value)) throw unexpected("outputs must be an array", value);
  // Unlike `map` it calls for holes, too.
  return Array.from(value, (name: unknown, i) => {
    const known = OUTPUTS.find((output) => output === name);
    if (known !== undefined) return known;
    const names = OUTPUTS.map((output) => JSON.stringify(output)).join(", ");
    throw unexpected(`outputs[${i}] must be one of ${names}`, name);
  });
}

/** How many workers a call may take. */
export function numberOfWorkers(value: unknown): Workers {
  const found = WORKERS.find((workers) => workers === value);
  if (found !== undefined) return found;
  throw unexpected('workers must be 1, 2, 4 or "auto"', value);
}
