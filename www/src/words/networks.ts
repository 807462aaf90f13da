import type { NetworkProgress } from "../networks/requests.js";
import { bytes } from "./numbers.js";

/** What the status says while a depth network is fetched and run. */
export function depthWords(progress: NetworkProgress, which: string): string {
  return progress.stage === "run"
    ? `Looking at the depth of ${which}`
    : loading("the depth network", progress);
}

/** What the status says while a filling network is fetched and run. */
export function fillWords(progress: NetworkProgress): string {
  return progress.stage === "run"
    ? "Inventing what neither photo saw"
    : loading("the network", progress);
}

function loading(what: string, { stage, loaded, total }: NetworkProgress): string {
  if (stage === "prepare") return `Preparing ${what}`;
  const amount = loaded === undefined ? "" : total ? `, ${bytes(total)}` : "";
  return `Downloading ${what}${amount}`;
}
