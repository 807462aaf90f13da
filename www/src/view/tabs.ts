import { blend, type CallOptions } from "depthstitch";
import { byId, make } from "../dom.js";
import { jobFor } from "../run/methods.js";
import { resultOf } from "../run/results.js";
import type { Runner } from "../run/run.js";
import type { Outcome, Store } from "../state.js";
import { gainView, mosaicView, seamView, voidsView, warpView } from "./canvas-views.js";
import { blinkView, compareView } from "./compare-views.js";
import { depthView, matchesView } from "./pair-views.js";
import type { ViewContext, Opened, View } from "./view-types.js";
import { Viewer } from "./viewer.js";

const views: readonly View[] = [
  mosaicView,
  compareView,
  blinkView,
  matchesView,
  depthView,
  warpView,
  gainView,
  seamView,
  voidsView,
];

/** Binds the tabs and their views to the outcome. Returns a function that opens a view by its id. */
export function bindTabs(
  store: Store,
  runner: Runner,
  offerDepth: () => void,
): (id: string) => void {
  const tabs = new Tabs(store, runner, offerDepth);
  store.subscribe(({ outcome }, before) => {
    if (outcome !== before.outcome) tabs.update(outcome, before.outcome);
  });
  return (id) => {
    const index = views.findIndex((view) => view.id === id);
    tabs.select(Math.max(0, index), true);
  };
}

/** The tabs and the view that is shown. */
class Tabs {
  readonly #store: Store;
  readonly #stage = byId("stage", HTMLElement);
  readonly #caption = byId("view-caption", HTMLElement);
  readonly #controls = byId("view-controls", HTMLElement);
  readonly #viewer = new Viewer();
  readonly #context: ViewContext;
  readonly #tabs = views.map(makeTab);
  #current = 0;
  #opened: Opened | null = null;
  /** The latest view opened; results of earlier ones are discarded. */
  #latest = Symbol();

  constructor(store: Store, runner: Runner, offerDepth: () => void) {
    this.#store = store;
    this.#context = viewContext(this.#viewer, runner, offerDepth);
    const list = byId("tabs", HTMLElement);
    for (const group of ["result", "steps"] as const) {
      const members = this.#tabs.filter((_, i) => views[i]?.group === group);
      list.append(make("div", { class: `group ${group}`, role: "presentation" }, ...members));
    }
    for (const [index, tab] of this.#tabs.entries()) {
      tab.addEventListener("click", () => this.select(index, false));
      tab.addEventListener("keydown", (event) => {
        const next = tabAfter(this.#tabs, index, event.key);
        if (next === undefined) return;
        event.preventDefault();
        this.select(next, true);
      });
    }
    this.select(0, false);
  }

  select(index: number, focus: boolean): void {
    this.#current = index;
    for (const [i, tab] of this.#tabs.entries()) {
      tab.setAttribute("aria-selected", String(i === index));
      tab.tabIndex = i === index ? 0 : -1;
    }
    const tab = this.#tabs[index];
    if (tab) {
      this.#stage.setAttribute("aria-labelledby", tab.id);
      if (focus) tab.focus();
      tab.scrollIntoView({ block: "nearest", inline: "nearest" });
    }
    const { outcome } = this.#store.state;
    if (outcome) void this.#open(outcome);
  }

  update(outcome: Outcome | null, before: Outcome | null): void {
    if (!outcome) return this.#clear();
    for (const [i, view] of views.entries()) {
      const tab = this.#tabs[i];
      if (tab) tab.hidden = view.isAvailable?.(outcome) === false;
    }
    // The viewport is meaningless for other photos.
    if (outcome.job.reference !== before?.job.reference) this.#viewer.reset();
    // Comparisons are computed for a new result only on demand.
    const isHidden = this.#tabs[this.#current]?.hidden === true;
    if (isHidden || views[this.#current] === compareView) this.select(0, false);
    else void this.#open(outcome);
  }

  async #open(outcome: Outcome): Promise<void> {
    const token = (this.#latest = Symbol());
    this.#opened?.close?.();
    this.#opened = null;
    const view = views[this.#current] ?? mosaicView;
    this.#caption.textContent = "…";
    this.#controls.replaceChildren();
    try {
      const next = await view.open(outcome, this.#context);
      if (this.#latest !== token) return next.close?.();
      this.#opened = next;
      this.#viewer.show(next.scene);
      this.#caption.textContent = next.caption;
      this.#controls.replaceChildren(...(next.controls ?? []));
    } catch (error) {
      if (this.#latest !== token) return;
      this.#caption.textContent = error instanceof Error ? error.message : String(error);
    }
  }

  #clear(): void {
    this.#opened?.close?.();
    this.#opened = null;
    this.#latest = Symbol();
    this.#viewer.show(null);
    this.#caption.textContent = "";
    this.#controls.replaceChildren();
  }
}

/** What the views can use. */
function viewContext(viewer: Viewer, runner: Runner, offerDepth: () => void): ViewContext {
  const computed = async <T>(work: (call: CallOptions) => Promise<T>): Promise<T> => {
    const value = await runner.compute(work);
    if (value === undefined) throw new Error("The computation failed.");
    return value;
  };
  return {
    redraw: () => viewer.redraw(),
    offerDepth,
    resultBy: (method, outcome) => computed((call) => resultOf(jobFor(method, outcome), call)),
    async averaged({ result, job: { reference, options } }) {
      const plain = { ...options, seam: "none", blending: "average" } as const;
      const blended = await computed((call) => blend(result, reference, { ...plain, ...call }));
      return blended.mosaic;
    },
  };
}

/** The index of the tab that a key moves to, as in the ARIA tabs pattern. */
function tabAfter(
  tabs: readonly HTMLButtonElement[],
  index: number,
  key: string,
): number | undefined {
  const shown = tabs.flatMap((tab, i) => (tab.hidden ? [] : [i]));
  const at = shown.indexOf(index);
  switch (key) {
    case "ArrowRight":
      return shown[(at + 1) % shown.length];
    case "ArrowLeft":
      return shown[(at + shown.length - 1) % shown.length];
    case "Home":
      return shown[0];
    case "End":
      return shown.at(-1);
    default:
      return undefined;
  }
}

function makeTab({ id, label }: View): HTMLButtonElement {
  return make(
    "button",
    { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": "stage" },
    label,
  );
}
