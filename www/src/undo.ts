import { byId, make } from "./dom.js";
import type { State, Store } from "./state.js";

/** Shows what can be undone, with its buttons. */
export function bindUndo(store: Store): void {
  const text = byId("undo-text", HTMLElement);
  const actions = byId("undo-actions", HTMLElement);
  store.subscribe(({ undo }, before) => {
    if (undo === before.undo) return;
    text.textContent = undo?.text ?? "";
    actions.replaceChildren(
      ...(undo?.choices ?? []).map(({ label, run }) => {
        const button = make("button", { type: "button" }, label);
        button.addEventListener("click", () => {
          store.set({ undo: null });
          run();
          // The button is gone; the focus goes to where it came from, or to what has come back.
          byId("undo", HTMLElement).focus();
        });
        return button;
      }),
    );
  });
}

/** What to change to come back to the photos and the result of an earlier state, with the settings chosen since. */
export function cameBack(before: State, { settings: now, saved: latest }: State): Partial<State> {
  const { slots, set, problems, networkDepths, outcome, status } = before;
  // The result may have been saved since.
  const saved = latest === outcome ? latest : before.saved;
  const { depthSource, depth, ...others } = before.settings;
  const chosen = Object.entries(others).some(
    ([name, value]) => now[name as keyof typeof others] !== value,
  );
  const settings = chosen ? { ...now, depthSource, depth } : before.settings;
  return { slots, set, problems, settings, networkDepths, outcome, saved, status, message: null };
}
