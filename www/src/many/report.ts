import { byId, make } from "../dom.js";
import { tableRow } from "../panels/table-row.js";
import type { ManyOutcome } from "../state.js";
import { pixels } from "../text/numbers.js";
import { manyFigures, sortedPairs, whyLeftOut } from "./report-text.js";

/** Shows the key figures, the table of pairs and that of photos. */
export function showManyReport(outcome: ManyOutcome): void {
  byId("many-figures", HTMLElement).replaceChildren(
    ...manyFigures(outcome).map(([name, value, under]) =>
      make(
        "div",
        {},
        make("dt", {}, name),
        make("dd", { class: "value" }, value),
        make("dd", { class: "under" }, under),
      ),
    ),
  );
  const { pairs } = outcome.result;
  const linked = pairs.filter((pair) => pair.linked).length;
  byId("pairs-summary", HTMLElement).textContent =
    `${linked} of ${pairs.length} have enough points in common`;
  byId("pairs", HTMLElement).replaceChildren(
    table(
      "Pairs that were compared",
      ["Photos", "Matches", "Inliers", "Enough"],
      pairRows(outcome),
    ),
  );
  byId("photos-table", HTMLElement).replaceChildren(
    table("Photos", ["Photo", "State", "Focal length, px", "Error"], photoRows(outcome)),
  );
}

type Row = readonly [name: string, ...cells: string[]];

function pairRows(outcome: ManyOutcome): Row[] {
  return sortedPairs(outcome).map(({ photos, matches, inliers, linked }) => [
    photos.map((index) => photoName(outcome, index)).join(" – "),
    String(matches),
    String(inliers),
    linked ? "yes" : "no",
  ]);
}

function photoRows(outcome: ManyOutcome): Row[] {
  return outcome.result.photos.map(({ used, error, focalLength }, index) => [
    photoName(outcome, index),
    used ? "used" : whyLeftOut(outcome, index),
    focalLength === null ? "–" : String(Math.round(focalLength)),
    error === null ? "–" : pixels(error),
  ]);
}

function photoName({ photos }: ManyOutcome, index: number): string {
  return `${index + 1} · ${photos[index]?.file.name ?? ""}`;
}

function table(caption: string, columns: readonly string[], rows: readonly Row[]): HTMLElement {
  const head = columns.map((name) => make("th", { scope: "col" }, name));
  const body = rows.map(([name, ...cells]) => tableRow(name, cells));
  return make(
    "table",
    { class: "numbers" },
    make("caption", {}, caption),
    make("thead", {}, make("tr", {}, ...head)),
    make("tbody", {}, ...body),
  );
}
