import { make } from "../dom.js";

/** A row of a table, which its first cell names. */
export function tableRow(name: string, cells: readonly (string | Node)[]): HTMLTableRowElement {
  return make(
    "tr",
    {},
    make("th", { scope: "row" }, name),
    ...cells.map((cell) => make("td", {}, cell)),
  );
}
