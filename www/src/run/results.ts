import { stitch, type CallOptions, type StitchResult } from "depthstitch";
import { keyOf, type Job } from "./job.js";

/** Size limit of the cache; results take tens of megabytes each. */
const cacheBytes = 400e6;

/** The latest results, the most recently used last. */
const cache = new Map<string, unknown>();

/** The result of a job of two photos, computed unless it is cached. */
export async function resultOf(job: Job, call: CallOptions): Promise<StitchResult> {
  const { target, reference, options, ...inputs } = job;
  const { result } = await remembered(keyOf(job), () =>
    stitch(target, reference, { ...options, ...inputs, ...call, outputDepth: true }),
  );
  return result;
}

/** What is cached by this key, which is of equal jobs only, or else computed. */
export async function remembered<T>(
  key: string,
  compute: () => Promise<T>,
): Promise<{ result: T; cached: boolean }> {
  const cached = cache.has(key);
  const result = cached ? (cache.get(key) as T) : await compute();
  cache.delete(key);
  cache.set(key, result);
  evictOldest();
  return { result, cached };
}

/** Whether the result of a job of two photos is cached. */
export function isCached(job: Job): boolean {
  return cache.has(keyOf(job));
}

function evictOldest(): void {
  let bytes = 0;
  for (const [key, result] of [...cache].reverse()) {
    bytes += bytesOf(result);
    if (bytes > cacheBytes && cache.size > 1) cache.delete(key);
  }
}

function bytesOf(value: unknown): number {
  if (ArrayBuffer.isView(value)) return value.byteLength;
  if (typeof value !== "object" || value === null) return 0;
  return Object.values(value).reduce((sum: number, part) => sum + bytesOf(part), 0);
}
