import type { StitchResult, Warning } from "depthstitch";
import { byId, find, make } from "../dom.js";
import { manyParagraphs, usedCount } from "../many/report-text.js";
import { showManyReport } from "../many/report.js";
import { isShown } from "../run/run.js";
import type { ManyOutcome, Outcome, State, Store } from "../state.js";
import { count, milliseconds, seconds } from "../text/numbers.js";
import { keyFigures, qualityRows, reportParagraphs, stages, stageText } from "../text/report.js";
import { tableRow } from "./table-row.js";

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

/** The inputs of the result, and whether others are chosen now. */
function source(state: State): string {
  const { outcome, running, settings } = state;
  if (!outcome) return "";
  const names = sourceOf(outcome);
  if (running) return names;
  if (!isShown(state)) return `${names} · the inputs have changed since`;
  return outcome.settings === settings ? names : `${names} · made with other settings`;
}

function sourceOf(outcome: Outcome | ManyOutcome): string {
  if (outcome.kind === "many") {
    const { photos, result } = outcome;
    const seen = `seen from ${photos[result.reference]?.file.name ?? ""}`;
    return `${usedCount(outcome)} of ${photos.length} photos, ${seen}`;
  }
  const { target, reference } = outcome.slots;
  return target?.origin === "sample"
    ? "of the example"
    : `${target?.file.name ?? ""} onto ${reference?.file.name ?? ""}`;
}

function showReport(outcome: Outcome | ManyOutcome): void {
  const { result } = outcome;
  showWarnings(outcome.kind === "many" ? outcome.result.warnings : outcome.result.report.warnings);
  byId("report-summary", HTMLElement).textContent = `computed in ${seconds(outcome.elapsed)}`;
  const paragraphs = outcome.kind === "many" ? manyParagraphs(outcome) : reportParagraphs(outcome);
  byId("report-text", HTMLElement).replaceChildren(
    ...paragraphs.map((text) => make("p", {}, text)),
  );
  if (outcome.kind === "many") showManyReport(outcome);
  else showPairReport(outcome);
  showTimes(result.times);
}

function showPairReport({ result }: Outcome): void {
  const figures = byId("figures", HTMLElement);
  for (const [name, { value, under }] of Object.entries(keyFigures(result))) {
    find(figures, `[data-figure="${name}"]`, HTMLElement).textContent = value;
    find(figures, `[data-under="${name}"]`, HTMLElement).textContent = under;
  }
  byId("quality-rows", HTMLElement).replaceChildren(
    ...qualityRows(result).map(([name = "", ...cells]) => tableRow(name, cells)),
  );
}

function showWarnings(warnings: readonly Warning[]): void {
  const box = byId("warnings", HTMLElement);
  const link = byId("warnings-link", HTMLAnchorElement);
  box.hidden = link.hidden = warnings.length === 0;
  link.textContent = count(warnings.length, "warning", "warnings");
  find(box, "ul", HTMLElement).replaceChildren(
    ...warnings.map(({ message }) => make("li", {}, message)),
  );
}

function showTimes(times: StitchResult["times"]): void {
  const run = stages.flatMap((stage) => {
    const time = stage in times ? times[stage as keyof typeof times] : undefined;
    return time === undefined ? [] : [{ stage, time }];
  });
  const total = run.reduce((sum, { time }) => sum + time, 0);
  const rows = run.map(({ stage, time }) => {
    const bar = make("div", { class: "bar" });
    bar.style.setProperty("--share", String(total > 0 ? time / total : 0));
    return tableRow(stageText[stage].name, [bar, milliseconds(time)]);
  });
  const sum = tableRow("All stages", ["", milliseconds(total)]);
  sum.className = "total";
  byId("time-rows", HTMLElement).replaceChildren(...rows, sum);
}
