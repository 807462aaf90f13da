import type { NetworkProgress } from "../networks/requests.js";
import { bytes } from "./numbers.js";

/** Status text while a depth network is fetched and run. */
export function depthStatus(progress: NetworkProgress, which: string): string {
  return progress.stage === "run"
    ? `Estimating the depth of ${which}`
    : loading("the depth network", progress);
}

/** Status text while an inpainting network is fetched and run. */
export function fillStatus(progress: NetworkProgress): string {
  return progress.stage === "run" ? "Inpainting gaps" : loading("the inpainting network", progress);
}

function loading(what: string, { stage, loaded, total }: NetworkProgress): string {
  if (stage === "prepare") return `Initializing ${what}`;
  const amount = loaded === undefined ? "" : total ? `, ${bytes(total)}` : "";
  return `Downloading ${what}${amount}`;
}
