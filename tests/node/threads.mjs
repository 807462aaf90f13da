// The worker threads that the package starts.
import { stitch } from "depthstitch";
import { rejection, sample } from "./sample.mjs";

/** @typedef {import("node:worker_threads").Worker} Worker */

/** The workers started while `work` runs, which may look at them meanwhile. @param {(workers: Worker[]) => Promise<unknown>} work */
export async function started(work) {
  /** @type {Worker[]} */
  const workers = [];
  const remember = (/** @type {Worker} */ worker) => void workers.push(worker);
  await endAll();
  process.on("worker", remember);
  try {
    await work(workers);
  } finally {
    process.off("worker", remember);
  }
  return workers;
}

/** Ends the workers there are, as aborting does. */
async function endAll() {
  const { target, reference } = await sample();
  const controller = new AbortController();
  const aborted = rejection(stitch(target, reference, { signal: controller.signal }));
  controller.abort();
  await aborted;
}
