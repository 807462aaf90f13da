import { isMainThread, parentPort, workerData } from "node:worker_threads";

import { loadCase, type Pair } from "../cases/case.js";
import { core } from "../core.js";
import { stitch, StitchError } from "../index.js";
import { inputs, timeStages, type Method } from "./stages.js";
import { onThread } from "./thread.js";

/** Time and memory of a stitch by image size. */
export interface Scale {
  readonly method: Method;
  /** Pixels of the target, in millions. */
  readonly megapixels: number;
  /** Median milliseconds of a stitch. */
  readonly ms: number;
  /** Bytes of wasm memory at its peak. */
  readonly memory: number;
  /** The same as the core predicts it. */
  readonly predicted: number;
}

/** Stitches the case in `folder` on a thread of its own: a fresh core whose memory has never been larger. */
export async function measureScale(folder: string, method: Method, runs: number): Promise<Scale> {
  return onThread<Job, Scale>(import.meta.url, { folder, method, runs });
}

interface Job {
  readonly folder: string;
  readonly method: Method;
  readonly runs: number;
}

async function serve({ folder, method, runs }: Job): Promise<Scale> {
  const pair = await loadCase(folder);
  const { width, height } = pair.target;
  const { stitch = NaN } = await timeStages(pair, method, runs, 1);
  return {
    method,
    megapixels: (width * height) / 1e6,
    ms: stitch,
    memory: core.call((raw) => raw.peakMemory()),
    predicted: await predictedMemory(pair, method),
  };
}

/** The bytes that the core refuses the job for: at once, or with the canvas' own as soon as that is known. */
async function predictedMemory(pair: Pair, method: Method): Promise<number> {
  let bytes = 1;
  for (;;) {
    const options = { ...inputs(pair, method), maxBytes: bytes, worker: false };
    try {
      await stitch(pair.target, pair.reference, options);
      return bytes;
    } catch (error) {
      if (!(error instanceof StitchError && error.code === "too-large")) throw error;
      bytes = error.details.bytes ?? NaN;
    }
  }
}

if (!isMainThread) parentPort?.postMessage(await serve(workerData as Job));
