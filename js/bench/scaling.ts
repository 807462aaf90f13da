import { isMainThread, parentPort, workerData } from "node:worker_threads";

import { loadCase } from "../cases/case.js";
import { core } from "../core.js";
import { stitch, type StitchOptions } from "../index.js";
import { predictedBytes } from "./predicted.js";
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
  const { stitch: ms = NaN } = await timeStages(pair, method, runs, 1);
  const memory = core.call((raw) => raw.peakMemory());
  const ask = (limit: StitchOptions) =>
    stitch(pair.target, pair.reference, { ...inputs(pair, method), ...limit });
  const predicted = (await predictedBytes(ask)).at(-1) ?? NaN;
  return {
    method,
    megapixels: (width * height) / 1e6,
    ms,
    memory,
    predicted,
  };
}

if (!isMainThread) parentPort?.postMessage(await serve(workerData as Job));
