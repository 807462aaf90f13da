import type { InputLoader } from "./load-inputs.js";

/** Loads pasted images and files as if they had been dropped. */
export function bindPaste(loader: InputLoader): void {
  document.addEventListener("paste", (event) => {
    const files = [...(event.clipboardData?.files ?? [])];
    if (files.length === 0) return;
    event.preventDefault();
    void loader.loadMany(files);
  });
}
