import { make } from "../dom.js";

/** Downloads a blob as a file. */
export function saveBlob(blob: Blob, name: string): void {
  const url = URL.createObjectURL(blob);
  make("a", { href: url, download: name }).click();
  // The browser reads the URL asynchronously; a minute is ample.
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}
