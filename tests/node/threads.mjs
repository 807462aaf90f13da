// The worker threads that the package starts.
import assert from "node:assert/strict";
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

/**
 * Checks that a call by two workers rejects when one of them dies amid the tasks of this name: the one that performs the call
 * (0), or the other (1).
 *
 * @param {0 | 1} which
 * @param {string} task
 * @param {(onProgress: () => void) => Promise<unknown>} call
 */
export async function assertRejectsAtDeath(which, task, call) {
  await started(async (workers) => {
    let watched = false;
    const watch = () => {
      if (watched) return;
      watched = true;
      workers[0]?.on("message", (reply) => {
        if (reply.call?.name !== task) return;
        // The other one has got this task, or has one already. One that was started for it is known in the next tick.
        process.nextTick(() => void workers[which]?.terminate());
      });
    };
    const error = await rejection(call(watch));
    // The other one may have been about to start.
    assert.match(error.code, /^(internal|load-failed)$/);
    assert.match(error.message, /worker/);
  });
}

/** Ends the workers there are, as aborting does. */
async function endAll() {
  const { target, reference } = await sample();
  const controller = new AbortController();
  const aborted = rejection(stitch(target, reference, { signal: controller.signal }));
  controller.abort();
  await aborted;
}
