import { stitch, type CallOptions, type StitchResult } from "depthstitch";
import { keyOf, type Job } from "./job.js";

/** Results take tens of megabytes each, so only the latest are kept. */
const keptBytes = 400e6;

const kept = new Map<string, StitchResult>();

/** The result of a job, computed unless it is still known. */
export async function resultOf(job: Job, call: CallOptions): Promise<StitchResult> {
  const key = keyOf(job);
  const { target, reference, options, ...inputs } = job;
  const result =
    kept.get(key) ??
    (await stitch(target, reference, { ...options, ...inputs, ...call, outputDepth: true }));
  // The latest come last.
  kept.delete(key);
  kept.set(key, result);
  forgetOldest();
  return result;
}

export function isKnown(job: Job): boolean {
  return kept.has(keyOf(job));
}

function forgetOldest(): void {
  let bytes = 0;
  for (const [key, result] of [...kept].reverse()) {
    bytes += bytesOf(result);
    if (bytes > keptBytes && kept.size > 1) kept.delete(key);
  }
}

function bytesOf(value: unknown): number {
  if (ArrayBuffer.isView(value)) return value.byteLength;
  if (typeof value !== "object" || value === null) return 0;
  return Object.values(value).reduce((sum: number, part) => sum + bytesOf(part), 0);
}
