import type { Store } from "../state.js";

/** Binds radio buttons of one name to a setting. */
export function radios(name: string, store: Store, key: "depthSource" | "fillMethod"): void {
  const buttons = [...document.querySelectorAll<HTMLInputElement>(`input[name="${name}"]`)];
  for (const button of buttons) {
    button.addEventListener("change", () => store.change({ [key]: button.value }));
  }
  store.subscribe(({ settings }) => {
    for (const button of buttons) button.checked = button.value === settings[key];
  });
}
