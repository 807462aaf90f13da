import { photoSlots, type State, type Store } from "./state.js";

/** Asks before the page is left with a result of the user's own photos that was not saved. */
export function bindLeaving(store: Store): void {
  window.addEventListener("beforeunload", (event) => {
    if (isUnsaved(store.state)) event.preventDefault();
  });
}

function isUnsaved({ outcome, saved }: State): boolean {
  if (!outcome || outcome === saved) return false;
  return (
    outcome.kind === "many" || photoSlots.some((slot) => outcome.slots[slot]?.origin === "own")
  );
}
