import type { StitchResult } from "depthstitch";
import { byId, find, make } from "../dom.js";
import type { Outcome, State, Store } from "../state.js";
import { count, milliseconds, seconds } from "../text/numbers.js";
import { keyFigures, qualityRows, reportParagraphs, stages, stageText } from "../text/report.js";

/** Binds key figures, warnings and report to the outcome. */
export function bindReport(store: Store): void {
  const section = byId("results", HTMLElement);
  store.subscribe((state, before) => {
    section.setAttribute("aria-busy", String(state.running !== null));
    byId("result-source", HTMLElement).textContent = source(state);
    const { outcome } = state;
    if (outcome && outcome !== before.outcome) showReport(outcome);
  });
}

/** The inputs of the result, and whether they have changed since. */
function source({ outcome, slots, running, settings }: State): string {
  if (!outcome) return "";
  const { target, reference } = outcome.slots;
  const names =
    target?.origin === "sample"
      ? "of the example"
      : `${target?.file.name ?? ""} onto ${reference?.file.name ?? ""}`;
  if (running) return names;
  if (outcome.slots !== slots) return `${names} · the inputs have changed since`;
  return outcome.settings === settings ? names : `${names} · the settings have changed since`;
}

function showReport(outcome: Outcome): void {
  const { result } = outcome;
  const figures = byId("figures", HTMLElement);
  for (const [name, { value, under }] of Object.entries(keyFigures(result))) {
    find(figures, `[data-figure="${name}"]`, HTMLElement).textContent = value;
    find(figures, `[data-under="${name}"]`, HTMLElement).textContent = under;
  }
  showWarnings(result);
  byId("report-summary", HTMLElement).textContent = `computed in ${seconds(outcome.elapsed)}`;
  byId("report-text", HTMLElement).replaceChildren(
    ...reportParagraphs(outcome).map((text) => make("p", {}, text)),
  );
  byId("quality-rows", HTMLElement).replaceChildren(
    ...qualityRows(result).map(([name = "", ...cells]) => row(name, cells)),
  );
  showTimes(result);
}

function showWarnings({ report }: StitchResult): void {
  const box = byId("warnings", HTMLElement);
  const link = byId("warnings-link", HTMLAnchorElement);
  box.hidden = link.hidden = report.warnings.length === 0;
  link.textContent = count(report.warnings.length, "warning", "warnings");
  find(box, "ul", HTMLElement).replaceChildren(
    ...report.warnings.map(({ message }) => make("li", {}, message)),
  );
}

function showTimes({ times }: StitchResult): void {
  const run = stages.flatMap((stage) => {
    const time = stage in times ? times[stage as keyof typeof times] : undefined;
    return time === undefined ? [] : [{ stage, time }];
  });
  const total = run.reduce((sum, { time }) => sum + time, 0);
  const rows = run.map(({ stage, time }) => {
    const bar = make("div", { class: "bar" });
    bar.style.setProperty("--share", String(total > 0 ? time / total : 0));
    return row(stageText[stage].name, [bar, milliseconds(time)]);
  });
  const sum = row("All stages", ["", milliseconds(total)]);
  sum.className = "total";
  byId("time-rows", HTMLElement).replaceChildren(...rows, sum);
}

function row(name: string, cells: readonly (string | Node)[]): HTMLTableRowElement {
  return make(
    "tr",
    {},
    make("th", { scope: "row" }, name),
    ...cells.map((cell) => make("td", {}, cell)),
  );
}
