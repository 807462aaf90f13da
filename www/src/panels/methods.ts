import { byId, find, make, onClick, setEnabled, showOn } from "../dom.js";
import { isDegenerate, jobFor, methods, type Method } from "../run/methods.js";
import type { PairResult } from "../run/kept.js";
import { resultOf } from "../run/results.js";
import type { Runner } from "../run/run.js";
import type { Outcome, Store } from "../state.js";
import { smallBitmap } from "../view/bitmaps.js";
import { comparison, qualityText } from "../view/compare-views.js";
import { messageOf } from "../message-of.js";

/** Twice the width of the widest card, for high-density screens. */
const width = 560;
/** What a card says until its method is computed. */
const waiting = "…";

/** Binds the comparison of methods: a mosaic with quality measures for each, and the result itself last. */
export function bindMethods(store: Store, runner: Runner, openView: (id: string) => void): void {
  const button = byId("methods-run", HTMLButtonElement);
  const list = byId("methods", HTMLElement);

  const compare = (method: Method) => {
    comparison.method = method.id;
    openView("compare");
    byId("results", HTMLElement).scrollIntoView({ block: "start" });
  };
  onClick(button, () => {
    const { outcome } = store.state;
    if (outcome?.kind !== "pair") return;
    const offered = methods.filter((method) => !isDegenerate(method, outcome));
    const cards = offered.map((method) => makeCard(method.label, method.hint));
    const own = makeCard("depthstitch", "the result above");
    list.replaceChildren(...cards, own);
    fillCard(own, outcome.result, outcome).catch((error: unknown) => fail(own, error));
    const computed = runner.compute(async (call) => {
      for (const [index, method] of offered.entries()) {
        const card = cards[index];
        if (!card || store.state.outcome !== outcome) return;
        try {
          const job = jobFor(method, outcome);
          await fillCard(card, await resultOf(job, call, runner.computeLater, true), outcome);
          const open = make("button", { type: "button" }, "Before and after");
          open.append(make("span", { class: "visually-hidden" }, ` with ${method.label}`));
          open.addEventListener("click", () => compare(method));
          card.append(open);
        } catch (error) {
          if (call.signal?.aborted) throw error;
          // A method that fails on these photos is part of the comparison.
          fail(card, error);
        }
      }
    });
    void computed.then(() => {
      for (const card of cards) {
        const words = agreementOf(card);
        if (words.textContent === waiting) words.textContent = "Not computed.";
      }
    });
  });
  store.subscribe(({ outcome, running }, before) => {
    setEnabled(button, outcome?.kind === "pair" && !running);
    if (outcome !== before.outcome) list.replaceChildren();
  });
}

function makeCard(label: string, hint: string): HTMLLIElement {
  return make(
    "li",
    { class: "method" },
    make("canvas", { width: "4", height: "3", role: "img", "aria-label": `Result of: ${label}` }),
    make("h3", {}, label),
    make("p", { class: "muted" }, hint),
    make("p", { class: "agreement" }, waiting),
  );
}

function agreementOf(card: HTMLElement): HTMLElement {
  return find(card, ".agreement", HTMLElement);
}

function fail(card: HTMLElement, error: unknown): void {
  agreementOf(card).textContent = messageOf(error);
}

async function fillCard(card: HTMLElement, result: PairResult, outcome: Outcome): Promise<void> {
  const bitmap = await smallBitmap(result.warped, outcome, width);
  showOn(find(card, "canvas", HTMLCanvasElement), bitmap);
  bitmap.close();
  agreementOf(card).textContent = qualityText(result);
}
