import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { isMainThread, parentPort, workerData } from "node:worker_threads";

import { CASE_FILE, loadPhoto } from "../cases/case.js";
import { many } from "../core.js";
import { stitchMany, type ImageOutput, type StitchManyResult } from "../index.js";
import { predictedBytes } from "./predicted.js";
import { onThread } from "./thread.js";

/** Time and memory of many photos. */
export interface ManyScale {
  readonly photos: number;
  /** How many of them are in the picture. */
  readonly used: number;
  /** Pixels of all photos, in millions. */
  readonly megapixels: number;
  /** Milliseconds of the call, and of its stages. */
  readonly ms: number;
  readonly times: StitchManyResult["times"];
  /** Seconds of processor time, the engine's own threads included: steadier than `ms` on a busy machine. */
  readonly processor: number;
  /** Bytes of wasm memory at its peak. */
  readonly memory: number;
  /** Bytes that the core predicts before it knows the canvas, and as that grows photo by photo. */
  readonly predicted: readonly number[];
}

/** Stitches the first `count` photos of the case in `folder` on a thread of its own, whose memory has never been larger. */
export async function measureMany(folder: string, count: number): Promise<ManyScale> {
  return onThread<Job, ManyScale>(import.meta.url, { folder, count });
}

interface Job {
  readonly folder: string;
  readonly count: number;
}

/** Milliseconds that the first `count` photos of the case in `folder` take in so many workers. */
export async function timeMany(folder: string, count: number, workers: 1 | 2): Promise<number> {
  const photos = await load(folder, count);
  const start = performance.now();
  await stitchMany(photos, { workers });
  return performance.now() - start;
}

async function load(folder: string, count: number): Promise<ImageOutput[]> {
  const { photos: files } = JSON.parse(await readFile(join(folder, CASE_FILE), "utf8")) as {
    photos: string[];
  };
  return Promise.all(
    files.slice(0, count).map(async (file) => (await loadPhoto(join(folder, file))).image),
  );
}

async function serve({ folder, count }: Job): Promise<ManyScale> {
  const photos = await load(folder, count);
  const before = process.cpuUsage();
  const start = performance.now();
  const result = await stitchMany(photos, { worker: false });
  const ms = performance.now() - start;
  const { user, system } = process.cpuUsage(before);
  const memory = many.call((raw) => raw.peakMemory());
  return {
    photos: photos.length,
    used: result.photos.filter(({ used }) => used).length,
    megapixels: photos.reduce((sum, { width, height }) => sum + width * height, 0) / 1e6,
    ms,
    times: result.times,
    processor: (user + system) / 1e6,
    memory,
    predicted: await predictedBytes((limit) => stitchMany(photos, limit)),
  };
}

if (!isMainThread) parentPort?.postMessage(await serve(workerData as Job));
