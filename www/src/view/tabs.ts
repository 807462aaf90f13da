import { blend } from "depthstitch";
import { byId, make } from "../dom.js";
import { jobFor } from "../run/methods.js";
import { resultOf } from "../run/results.js";
import type { Runner } from "../run/run.js";
import type { Outcome, Store } from "../state.js";
import { gainView, mosaicView, seamView, voidsView, warpView } from "./canvas-views.js";
import { blinkView, compareView } from "./compare-views.js";
import { depthView, matchesView } from "./pair-views.js";
import type { Desk, Opened, View } from "./view.js";
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

/** Binds the tabs and what they show to the outcome; returns what opens a view by its name. */
export function bindTabs(
  store: Store,
  runner: Runner,
  askForDepth: () => void,
): (id: string) => void {
  const list = byId("tabs", HTMLElement);
  const stage = byId("stage", HTMLElement);
  const caption = byId("view-caption", HTMLElement);
  const controls = byId("view-controls", HTMLElement);
  const viewer = new Viewer();
  const tabs = views.map(makeTab);
  for (const group of ["result", "steps"] as const) {
    const own = tabs.filter((_, i) => views[i]?.group === group);
    list.append(make("div", { class: `group ${group}`, role: "presentation" }, ...own));
  }

  let current = 0;
  let opened: Opened | null = null;
  /** The newest opening; an older one that ends later is forgotten. */
  let latest = Symbol();
  const desk: Desk = {
    redraw: () => viewer.redraw(),
    askForDepth,
    async resultBy(method, outcome) {
      const result = await runner.other((call) => resultOf(jobFor(method, outcome), call));
      if (!result) throw new Error("It was not computed.");
      return result;
    },
    async averaged({ result, job: { reference, options } }) {
      const plain = { ...options, seam: "none", blending: "average" } as const;
      const blended = await runner.other((call) => blend(result, reference, { ...plain, ...call }));
      if (!blended) throw new Error("It was not computed.");
      return blended.mosaic;
    },
  };

  const open = async (outcome: Outcome) => {
    const token = (latest = Symbol());
    opened?.close?.();
    opened = null;
    const view = views[current] ?? mosaicView;
    caption.textContent = "…";
    controls.replaceChildren();
    try {
      const next = await view.open(outcome, desk);
      if (latest !== token) return next.close?.();
      opened = next;
      viewer.show(next.scene);
      caption.textContent = next.caption;
      controls.replaceChildren(...(next.controls ?? []));
    } catch (error) {
      if (latest !== token) return;
      caption.textContent = error instanceof Error ? error.message : String(error);
    }
  };

  const select = (index: number, focus: boolean) => {
    current = index;
    for (const [i, tab] of tabs.entries()) {
      tab.setAttribute("aria-selected", String(i === index));
      tab.tabIndex = i === index ? 0 : -1;
    }
    const tab = tabs[index];
    if (tab) {
      stage.setAttribute("aria-labelledby", tab.id);
      if (focus) tab.focus();
      tab.scrollIntoView({ block: "nearest", inline: "nearest" });
    }
    const { outcome } = store.state;
    if (outcome) void open(outcome);
  };

  for (const [index, tab] of tabs.entries()) {
    tab.addEventListener("click", () => select(index, false));
    tab.addEventListener("keydown", (event) => {
      const usable = tabs.flatMap((other, i) => (other.hidden ? [] : [i]));
      const at = usable.indexOf(index);
      const goal: Readonly<Record<string, number | undefined>> = {
        ArrowRight: usable[(at + 1) % usable.length],
        ArrowLeft: usable[(at + usable.length - 1) % usable.length],
        Home: usable[0],
        End: usable.at(-1),
      };
      const next = goal[event.key];
      if (next === undefined) return;
      event.preventDefault();
      select(next, true);
    });
  }
  select(0, false);

  store.subscribe(({ outcome }, before) => {
    if (outcome === before.outcome) return;
    if (!outcome) {
      opened?.close?.();
      opened = null;
      latest = Symbol();
      viewer.show(null);
      caption.textContent = "";
      controls.replaceChildren();
      return;
    }
    for (const [i, view] of views.entries()) {
      const tab = tabs[i];
      if (tab) tab.hidden = view.has?.(outcome) === false;
    }
    // Another size of canvas makes an old place in it meaningless.
    if (outcome.job.reference !== before.outcome?.job.reference) viewer.reset();
    // What compares is recomputed for a new result only when it is asked for.
    const gone = tabs[current]?.hidden === true || views[current] === compareView;
    if (gone) select(0, false);
    else void open(outcome);
  });
  return (id) => {
    select(
      Math.max(
        0,
        views.findIndex((view) => view.id === id),
      ),
      true,
    );
  };
}

function makeTab({ id, label }: View): HTMLButtonElement {
  return make(
    "button",
    { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": "stage" },
    label,
  );
}
