/**
 * The table of all stitching options: type, range, default, unit and description of each, once.
 *
 * The `Options` type, the checks of the core, `docs/options.md`, the help of the command line and the fields of the
 * page are made from it. After a change run `npm run generate`, and read the new option in `src/wasm/options.rs`.
 */

import type { OptionSpec } from "./option-spec.js";
import { compositing } from "./options/compositing.js";
import { geometry } from "./options/geometry.js";
import { matching } from "./options/matching.js";
import { warping } from "./options/warping.js";

export type * from "./option-spec.js";

/** Every option, in the order of the pipeline. */
export const OPTIONS = {
  mode: {
    group: "preset",
    type: "choice",
    choices: { default: "depthstitch", paper: "as published" },
    default: "default",
    paper: "paper",
    label: "Method",
    description:
      'Selects the defaults of all other options: this package\'s own, or with "paper" those of the published method.',
  },

  ...matching,
  ...geometry,
  ...warping,
  ...compositing,
} as const satisfies Readonly<Record<string, OptionSpec>>;

/** The name of an option. */
export type OptionName = keyof typeof OPTIONS;

/** All options with their names, in the order of the table. */
export const OPTION_LIST = Object.entries(OPTIONS) as readonly (readonly [
  OptionName,
  OptionSpec,
])[];
