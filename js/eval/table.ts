import type { Row } from "./evaluate.js";
import { MEASURES, MEASURE_NAMES, type Group, type Values } from "./measures.js";
import { milliseconds, type Mean } from "./summarise.js";

/** Columns are at least this wide. */
const COLUMN = 7;

/** The lines of a table of these groups of measures whose first column is `width` wide. */
export function tableLines(
  width: number,
  groups: ReadonlySet<Group>,
): {
  readonly header: string;
  readonly row: (row: Row) => string;
  readonly mean: (mean: Mean) => string;
} {
  const shown = MEASURE_NAMES.filter((name) => groups.has(MEASURES[name].group));
  const headings = [...shown.flatMap((name) => [...MEASURES[name].headings]), "ms"];
  const line = (name: string, cells: readonly string[], note: string): string => {
    const aligned = headings.map((heading, i) =>
      (cells[i] ?? "").padStart(Math.max(heading.length, COLUMN)),
    );
    return `${[name.padEnd(width), ...aligned].join("  ")}  ${note}`.trimEnd();
  };
  /** `extra` digits for the mean of counts. */
  const cells = (values: Values, ms: number | null, extra: number): string[] => [
    ...shown.flatMap((name) => {
      const { headings, digits } = MEASURES[name];
      const value = values[name];
      const numbers = typeof value === "object" ? (value ?? headings.map(() => null)) : [value];
      return numbers.map((number) => fixed(number, digits === 0 ? extra : digits));
    }),
    fixed(ms, 0),
  ];
  return {
    header: line("case", headings, ""),
    row: (row) => {
      const note = row.failed === undefined ? row.warnings.join(" ") : `FAILED ${row.failed}`;
      return line(row.case, cells(row, milliseconds(row), 0), note);
    },
    mean: (mean) => {
      const fewer = shown.flatMap((name) => {
        const count = mean.fewer[name];
        return count === undefined ? [] : [`; ${MEASURES[name].headings[0]} of ${count}`];
      });
      const note = `${mean.stitched} of ${mean.total} stitched${fewer.join("")}`;
      return line(mean.name, cells(mean, mean.milliseconds, 1), note);
    },
  };
}

function fixed(value: number | null, digits: number): string {
  return value === null ? "-" : value.toFixed(digits);
}
