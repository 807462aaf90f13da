import { blend, type CallOptions } from "depthstitch";
import { byId, make } from "../dom.js";
import { graphView } from "../many/graph-view.js";
import { manyMosaicView, manySeamView } from "../many/views.js";
import { jobFor } from "../run/methods.js";
import { taken } from "../image-worker/client.js";
import { isCached, resultOf, warpedOf } from "../run/results.js";
import type { Runner } from "../run/run.js";
import type { ManyOutcome, Outcome, Store } from "../state.js";
import { shownReference } from "./bitmaps.js";
import { gainView, mosaicView, seamView, voidsView, warpView } from "./canvas-views.js";
import { blinkView, compareView } from "./compare-views.js";
import { depthView, matchesView } from "./pair-views.js";
import type { ViewContext, Opened, View } from "./view-types.js";
import { Viewer } from "./viewer.js";
import { messageOf } from "../message-of.js";

/** Views of two photos. */
const pairViews: readonly View[] = [
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
/** Views of more. One with the id of another shares its tab. */
const manyViews: readonly View<ManyOutcome>[] = [
  manyMosaicView,
  graphView,
  manySeamView,
  voidsView,
];
/** All tabs, in their order. */
const tabViews = [
  ...pairViews.slice(0, 3),
  ...manyViews.filter(({ id }) => !pairViews.some((view) => view.id === id)),
  ...pairViews.slice(3),
] as const;

/** Milliseconds after which a view that takes longer is no longer shown in place of the next. */
const patience = 150;

/** Binds the tabs and their views to the outcome. Returns a function that opens a view by its id. */
export function bindTabs(
  store: Store,
  runner: Runner,
  offerDepth: () => void,
): (id: string) => void {
  const tabs = new Tabs(store, runner, offerDepth);
  store.subscribe(({ outcome, set }, before) => {
    if (outcome !== before.outcome || (!outcome && !set !== !before.set)) {
      tabs.update(outcome, before.outcome);
    }
  });
  return (id) => tabs.select(id, true);
}

/** The tabs and the view that is shown. */
class Tabs {
  readonly #store: Store;
  readonly #stage = byId("stage", HTMLElement);
  readonly #caption = byId("view-caption", HTMLElement);
  readonly #controls = byId("view-controls", HTMLElement);
  readonly #viewer = new Viewer();
  readonly #context: Omit<ViewContext, "fail">;
  readonly #tabs = new Map(tabViews.map((view) => [view.id, makeTab(view)]));
  #current = mosaicView.id;
  /** The view whose scene is drawn. */
  #drawn = "";
  #opened: Opened | null = null;
  #latest: symbol | null = null;

  constructor(store: Store, runner: Runner, offerDepth: () => void) {
    this.#store = store;
    this.#context = viewContext(this.#viewer, runner, offerDepth);
    const list = byId("tabs", HTMLElement);
    for (const group of ["result", "steps"] as const) {
      const members = tabViews.flatMap((view) =>
        view.group === group ? (this.#tabs.get(view.id) ?? []) : [],
      );
      list.append(make("div", { class: `group ${group}`, role: "presentation" }, ...members));
    }
    for (const [id, tab] of this.#tabs) {
      tab.addEventListener("click", () => this.select(id, false));
      tab.addEventListener("keydown", (event) => {
        const next = tabAfter(this.#tabs, id, event.key);
        if (next === undefined) return;
        event.preventDefault();
        this.select(next, true);
      });
    }
    this.update(store.state.outcome, null);
    this.select(this.#current, false);
  }

  select(selected: string, focus: boolean): void {
    this.#current = selected;
    for (const [id, tab] of this.#tabs) {
      tab.setAttribute("aria-selected", String(id === selected));
      tab.tabIndex = id === selected ? 0 : -1;
    }
    const tab = this.#tabs.get(selected);
    if (tab) {
      this.#stage.setAttribute("aria-labelledby", tab.id);
      if (focus) tab.focus();
      tab.scrollIntoView({ block: "nearest", inline: "nearest" });
    }
    const { outcome } = this.#store.state;
    if (outcome) void this.#open(outcome);
  }

  update(outcome: Outcome | ManyOutcome | null, before: Outcome | ManyOutcome | null): void {
    const shown = outcome ? available(outcome) : this.#expected();
    for (const [id, tab] of this.#tabs) tab.hidden = !shown.has(id);
    if (!outcome) return this.#clear();
    // The viewport is meaningless for other photos.
    if (referenceOf(outcome) !== (before && referenceOf(before))) this.#viewer.reset();
    // Comparisons are computed for a new result only on demand.
    const stays = shown.has(this.#current) && this.#current !== compareView.id;
    if (stays) void this.#open(outcome);
    else this.select(mosaicView.id, false);
  }

  async #open(outcome: Outcome | ManyOutcome): Promise<void> {
    const token = (this.#latest = Symbol());
    this.#opened?.close?.();
    this.#opened = null;
    const id = this.#current;
    const open = available(outcome).get(id);
    if (!open) return;
    this.#caption.textContent = "…";
    this.#controls.replaceChildren();
    // What is drawn of another view would be taken for this one.
    const clear = () => {
      if (this.#latest !== token || this.#drawn === id) return;
      this.#viewer.show(null);
      this.#caption.textContent = "Computing…";
    };
    const waiting = window.setTimeout(clear, patience);
    const fail = (error: unknown) => {
      if (this.#latest !== token) return;
      clear();
      this.#caption.textContent = messageOf(error);
    };
    try {
      const next = await open({ ...this.#context, fail });
      if (this.#latest !== token) return next.close?.();
      this.#opened = next;
      this.#drawn = id;
      this.#viewer.show(next.scene);
      this.#caption.textContent = next.caption;
      this.#controls.replaceChildren(...(next.controls ?? []));
    } catch (error) {
      fail(error);
    } finally {
      clearTimeout(waiting);
    }
  }

  /** The ids of the views that the first result will have. */
  #expected(): ReadonlySet<string> {
    const views: readonly Pick<View, "id">[] = this.#store.state.set ? manyViews : pairViews;
    return new Set(views.map(({ id }) => id));
  }

  #clear(): void {
    this.#opened?.close?.();
    this.#opened = null;
    this.#drawn = "";
    this.#latest = Symbol();
    this.#viewer.show(null);
    this.#caption.textContent = "";
    this.#controls.replaceChildren();
  }
}

/** The views that an outcome has, by their ids. */
function available(
  outcome: Outcome | ManyOutcome,
): ReadonlyMap<string, (view: ViewContext) => Promise<Opened>> {
  const of = <O extends Outcome | ManyOutcome>(views: readonly View<O>[], outcome: O) =>
    new Map(
      views
        .filter((view) => view.isAvailable?.(outcome) !== false)
        .map((view) => [view.id, (context: ViewContext) => view.open(outcome, context)]),
    );
  return outcome.kind === "many" ? of(manyViews, outcome) : of(pairViews, outcome);
}

/** The photo in whose coordinates the result is. */
function referenceOf(outcome: Outcome | ManyOutcome): object | null | undefined {
  return outcome.kind === "many"
    ? outcome.photos[outcome.result.reference]?.content
    : outcome.job.reference;
}

/** What the views can use. */
function viewContext(
  viewer: Viewer,
  runner: Runner,
  offerDepth: () => void,
): Omit<ViewContext, "fail"> {
  return {
    redraw: () => viewer.redraw(),
    offerDepth,
    resultBy(method, outcome) {
      const job = jobFor(method, outcome);
      const result = (call: CallOptions) => resultOf(job, call, runner.computeLater);
      // The status would speak of work that is done.
      return isCached(job) ? result({}) : runner.computed(result);
    },
    async averaged(outcome) {
      const { result, job } = outcome;
      const plain = { ...job.options, seam: "none", blending: "average" } as const;
      const blended = await runner.computed(async (call) => {
        const reference = await taken(shownReference(outcome));
        return blend(await warpedOf(result), reference, { ...plain, ...call, transfer: true });
      });
      return blended.mosaic;
    },
  };
}

/** The id of the tab that a key moves to, as in the ARIA tabs pattern. */
function tabAfter(
  tabs: ReadonlyMap<string, HTMLButtonElement>,
  id: string,
  key: string,
): string | undefined {
  const shown = [...tabs].flatMap(([id, tab]) => (tab.hidden ? [] : [id]));
  const at = shown.indexOf(id);
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

function makeTab({ id, label }: Pick<View, "id" | "label">): HTMLButtonElement {
  return make(
    "button",
    { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": "stage" },
    label,
  );
}
