import type { ImageOutput, StitchResult } from "depthstitch";
import { byId, find, make, onClick, setEnabled } from "./dom.js";
import { saveCanvas, saveText } from "./download.js";
import { count, milliseconds, percent, size } from "./number-words.js";
import {
  countSet,
  keyFigures,
  qualityRows,
  reportJson,
  reportParagraphs,
  stages,
  stageWords,
} from "./report-words.js";
import type { Outcome, State, Store } from "./state.js";
import { put } from "./thumbnails.js";

const downloads = ["download-mosaic", "download-warped", "download-report"] as const;

/** Binds everything under "Result" to the outcome of the last run that succeeded. */
export function bindResults(store: Store, version: string): void {
  const section = byId("results", HTMLElement);
  const mosaic = byId("mosaic", HTMLCanvasElement);
  const warped = byId("warped", HTMLCanvasElement);

  store.subscribe((state, before) => {
    section.setAttribute("aria-busy", String(state.running !== null));
    byId("result-source", HTMLElement).textContent = source(state);
    const { outcome } = state;
    if (!outcome || outcome === before.outcome) return;
    showPictures(outcome);
    showReport(outcome);
    for (const id of downloads) setEnabled(byId(id, HTMLButtonElement), true);
  });

  onClick(byId("download-mosaic", HTMLButtonElement), () => void saveCanvas(mosaic, "mosaic.png"));
  onClick(byId("download-warped", HTMLButtonElement), () => void saveCanvas(warped, "warped.png"));
  onClick(byId("download-report", HTMLButtonElement), () => {
    const { outcome } = store.state;
    if (outcome) saveText(reportJson(outcome, version), "report.json", "application/json");
  });
}

/** What the result was made from, and whether that is still what the inputs hold. */
function source({ outcome, slots, running }: State): string {
  if (!outcome) return "";
  const { target, reference } = outcome.slots;
  const names =
    target?.origin === "sample"
      ? "the sample"
      : `${target?.file ?? ""} onto ${reference?.file ?? ""}`;
  return outcome.slots === slots || running ? names : `${names} · the inputs have changed since`;
}

function showPictures({ result, slots }: Outcome): void {
  const { mosaic, warped, voidMask, offset } = result;
  show("mosaic", asImageData(mosaic));
  show("warped", asImageData(warped));
  show("voids", overlay(result));
  caption("mosaic-caption", size(mosaic));
  caption("warped-caption", "dashed: the reference");
  const voids = countSet(voidMask.data);
  caption(
    "voids-caption",
    voids === 0
      ? "none"
      : `${count(voids, "pixel", "pixels")}, ${percent(voids / voidMask.data.length)}`,
  );

  const outline = byId("reference-outline", HTMLElement);
  const reference = slots.reference?.content;
  outline.hidden = !reference;
  if (!reference) return;
  const place = (property: string, value: number, of: number) =>
    outline.style.setProperty(property, `${(100 * value) / of}%`);
  place("left", offset.x, warped.width);
  place("top", offset.y, warped.height);
  place("width", reference.width, warped.width);
  place("height", reference.height, warped.height);
}

function show(id: string, image: ImageData): void {
  const canvas = byId(id, HTMLCanvasElement);
  put(canvas, image);
  const fit = canvas.parentElement;
  fit?.style.setProperty("--ratio", String(image.width / image.height));
  fit?.classList.remove("empty");
}

function asImageData({ data, width, height }: ImageOutput): ImageData {
  return new ImageData(data, width, height);
}

/** The mosaic in faint gray with its voids in orange, which the gray cannot contain. */
function overlay({ mosaic, voidMask }: StitchResult): ImageData {
  const out = new ImageData(mosaic.width, mosaic.height);
  for (let i = 0; i < voidMask.data.length; i++) {
    const at = 4 * i;
    if (voidMask.data[i]) {
      out.data.set([240, 110, 20, 255], at);
      continue;
    }
    const [red = 0, green = 0, blue = 0, alpha = 0] = mosaic.data.subarray(at, at + 4);
    const gray = 110 + 0.4 * (0.299 * red + 0.587 * green + 0.114 * blue);
    out.data.fill(gray, at, at + 3);
    out.data[at + 3] = alpha;
  }
  return out;
}

function caption(id: string, words: string): void {
  byId(id, HTMLElement).textContent = words;
}

function showReport(outcome: Outcome): void {
  const { result } = outcome;
  const figures = byId("figures", HTMLElement);
  for (const [name, { value, under }] of Object.entries(keyFigures(result))) {
    find(figures, `[data-figure="${name}"]`, HTMLElement).textContent = value;
    find(figures, `[data-under="${name}"]`, HTMLElement).textContent = under;
  }

  showWarnings(result);
  byId("report-words", HTMLElement).replaceChildren(
    ...reportParagraphs(outcome).map((words) => make("p", {}, words)),
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
  const total = stages.reduce((sum, stage) => sum + times[stage], 0);
  const rows = stages.map((stage) => {
    const bar = make("div", { class: "bar" });
    bar.style.setProperty("--share", String(total > 0 ? times[stage] / total : 0));
    return row(stageWords[stage].name, [bar, milliseconds(times[stage])]);
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
