import { byId, make } from "../dom.js";
import type { Running, State, Store } from "../state.js";
import { isLoading } from "./run.js";
import { percent } from "../text/numbers.js";
import { stages, stageText } from "../text/report.js";

/** Shows progress: bars, the status line, and a list of stages in place of the first result. */
export function bindProgress(store: Store): void {
  const status = byId("status", HTMLElement);
  const fraction = byId("fraction", HTMLElement);
  const bars = byId("stages", HTMLElement);
  const waiting = byId("waiting", HTMLElement);
  let shown: readonly Running["stage"][] = [];
  /** The furthest stage so far, as some stages are run twice. */
  let furthest = -1;

  const draw = (state: State) => {
    const { running, status: idle, outcome } = state;
    const expected = running ? stagesOf(state) : shown;
    if (expected.join() !== shown.join()) {
      shown = expected;
      bars.replaceChildren(...shown.map(() => make("li")));
      waiting.replaceChildren(stepList(shown));
    }
    const at = running ? shown.indexOf(running.stage) : -1;
    furthest = running ? Math.max(furthest, at) : -1;
    const current = furthest;
    const steps = waiting.querySelectorAll("li");
    for (const [index, bar] of [...bars.children].entries()) {
      if (index === current && at < current) continue;
      const done = index < current ? 1 : index === at ? (running?.fraction ?? 0) : 0;
      for (const element of [bar, steps[index]]) {
        if (element instanceof HTMLElement) element.style.setProperty("--done", String(done));
      }
      steps[index]?.classList.toggle("now", index === current);
      steps[index]?.classList.toggle("done", index < current);
    }
    // Only stages are announced by screen readers, not every percent.
    const text = running
      ? `${running.text ?? stageText[running.stage].doing}…`
      : isLoading(state)
        ? "Loading the files…"
        : idle;
    if (status.textContent !== text) status.textContent = text;
    const detail = running?.detail ? `${running.detail} · ` : "";
    fraction.textContent = running
      ? detail + percent(Math.round(100 * running.fraction) / 100)
      : setProgress(state);
    bars.classList.toggle("idle", !running);
    waiting.hidden = outcome !== null || !running;
  };
  store.subscribe((state, before) => {
    if (
      state.running !== before.running ||
      state.status !== before.status ||
      state.loading !== before.loading ||
      state.set !== before.set ||
      state.outcome !== before.outcome ||
      state === before
    ) {
      draw(state);
    }
  });
  bindMessage(store);
}

/** How many photos of a set are read, while others are not. */
function setProgress(state: State): string {
  const { set } = state;
  if (!set || !isLoading(state)) return "";
  const read = set.photos.filter(({ content, problem }) => content ?? problem).length;
  return `${read} of ${set.photos.length}`;
}

function stepList(shown: readonly Running["stage"][]): HTMLElement {
  return make(
    "ol",
    { "aria-hidden": "true" },
    ...shown.map((stage) => make("li", {}, stageText[stage].name)),
  );
}

/** The stages expected for the inputs and settings. */
function stagesOf({
  slots,
  set,
  settings,
  running,
  networkDepths,
}: State): readonly Running["stage"][] {
  const { options, depthSource } = settings;
  if (set) {
    const never = new Set<Running["stage"]>(["model-depth", "measure"]);
    if (settings.fillMethod === "core") never.add("model-fill");
    return stages.filter((stage) => !never.has(stage) || running?.stage === stage);
  }
  const paper = options.mode === "paper";
  const hasDepth =
    depthSource === "files"
      ? Boolean(slots.targetDepth ?? slots.referenceDepth)
      : depthSource === "model" && networkDepths.size > 0;
  const expected: Partial<Record<Running["stage"], boolean>> = {
    "model-depth": running?.stage === "model-depth",
    detect: !slots.matches,
    match: !slots.matches,
    depth:
      !hasDepth && (options.withoutDepth ?? (paper ? "homography" : "two-view")) === "two-view",
    refine: (options.refinement ?? (paper ? "none" : "epipolar")) === "epipolar",
    "model-fill": settings.fillMethod !== "core",
  };
  // The current stage is shown in any case.
  return stages.filter((stage) => expected[stage] !== false || running?.stage === stage);
}

function bindMessage(store: Store): void {
  const box = byId("message", HTMLElement);
  store.subscribe(({ message }, before) => {
    if (message === before.message) return;
    box.classList.toggle("error", message?.tone === "error");
    box.replaceChildren(
      ...(message ? [make("strong", {}, message.title), make("p", {}, message.advice)] : []),
    );
    // What was pressed may be far below.
    if (message?.tone === "error") box.scrollIntoView({ block: "nearest" });
  });
}
