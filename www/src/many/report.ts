import { byId, make } from "../dom.js";
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
  byId("pair-rows", HTMLElement).replaceChildren(...pairRows(outcome));
  byId("photo-rows", HTMLElement).replaceChildren(...photoRows(outcome));
}

function pairRows(outcome: ManyOutcome): HTMLTableRowElement[] {
  const name = (index: number) => `${index + 1} · ${outcome.photos[index]?.file.name ?? ""}`;
  return sortedPairs(outcome).map(({ photos, matches, inliers, linked }) =>
    row(photos.map(name).join(" – "), [String(matches), String(inliers), linked ? "yes" : "no"]),
  );
}

function photoRows(outcome: ManyOutcome): HTMLTableRowElement[] {
  return outcome.result.photos.map(({ used, error, focalLength }, index) =>
    row(`${index + 1} · ${outcome.photos[index]?.file.name ?? ""}`, [
      used ? "used" : whyLeftOut(outcome, index),
      focalLength === null ? "–" : String(Math.round(focalLength)),
      error === null ? "–" : pixels(error),
    ]),
  );
}

function row(name: string, cells: readonly string[]): HTMLTableRowElement {
  return make(
    "tr",
    {},
    make("th", { scope: "row" }, name),
    ...cells.map((cell) => make("td", {}, cell)),
  );
}
