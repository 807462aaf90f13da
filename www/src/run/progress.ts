import { byId, make } from "../dom.js";
import type { Running, State, Store } from "../state.js";
import { percent } from "../words/numbers.js";
import { stages, stageWords } from "../words/report.js";

/** Draws how far the work has come: bars, the status line, and a list of steps in place of the first picture. */
export function bindProgress(store: Store): void {
  const status = byId("status", HTMLElement);
  const fraction = byId("fraction", HTMLElement);
  const bars = byId("stages", HTMLElement);
  const waiting = byId("waiting", HTMLElement);
  let shown: readonly Running["stage"][] = [];
  /** How far it has come; a stage that is gone through again does not take the bars back. */
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
    // Only the stage is announced: a screen reader need not hear every percent.
    const words = running ? `${running.words ?? stageWords[running.stage].doing}…` : idle;
    if (status.textContent !== words) status.textContent = words;
    fraction.textContent = running ? percent(Math.round(100 * running.fraction) / 100) : "";
    bars.classList.toggle("idle", !running);
    waiting.hidden = outcome !== null || !running;
  };
  store.subscribe((state, before) => {
    if (
      state.running !== before.running ||
      state.status !== before.status ||
      state.outcome !== before.outcome ||
      state === before
    ) {
      draw(state);
    }
  });
  bindMessage(store);
}

function stepList(shown: readonly Running["stage"][]): HTMLElement {
  return make(
    "ol",
    { "aria-hidden": "true" },
    ...shown.map((stage) => make("li", {}, stageWords[stage].name)),
  );
}

/** The stages that this run will go through, as far as its inputs tell. */
function stagesOf({ slots, settings, running, modelDepths }: State): readonly Running["stage"][] {
  const { options, depthSource } = settings;
  const paper = options.mode === "paper";
  const hasDepth =
    depthSource === "files"
      ? Boolean(slots.targetDepth ?? slots.referenceDepth)
      : depthSource === "model" && modelDepths.size > 0;
  const left: Partial<Record<Running["stage"], boolean>> = {
    "model-depth": running?.stage === "model-depth",
    detect: !slots.matches,
    match: !slots.matches,
    depth:
      !hasDepth && (options.withoutDepth ?? (paper ? "homography" : "two-view")) === "two-view",
    refine: (options.refinement ?? (paper ? "none" : "epipolar")) === "epipolar",
    "model-fill": settings.filler !== "core",
  };
  // Whatever runs is shown, expected or not.
  return stages.filter((stage) => left[stage] !== false || running?.stage === stage);
}

function bindMessage(store: Store): void {
  const box = byId("message", HTMLElement);
  store.subscribe(({ message }, before) => {
    if (message === before.message) return;
    box.classList.toggle("error", message?.tone === "error");
    box.replaceChildren(
      ...(message ? [make("strong", {}, message.title), make("p", {}, message.advice)] : []),
    );
  });
}
