import {
  stitch,
  type CallOptions,
  type DepthInput,
  type StitchResult,
  type Warped,
} from "depthstitch";
import { imageTask, lodged, taken } from "../image-worker/client.js";
import { keyOf, type Job, type JobDepth } from "./job.js";
import { shownOutputs, type Kept, type PairResult } from "./kept.js";

/** Size limit of the cache; results take tens of megabytes each. */
const cacheBytes = 400e6;

/** The latest results, the most recently used last. */
const cache = new Map<string, unknown>();

/** The result of a job of two photos, computed unless it is cached. */
export async function resultOf(job: Job, call: CallOptions): Promise<PairResult> {
  const { result } = await remembered(keyOf(job), async () => {
    const [target, reference, targetDepth, referenceDepth] = await Promise.all([
      taken(job.target.pixels),
      taken(job.reference.pixels),
      ownDepth(job.targetDepth),
      ownDepth(job.referenceDepth),
    ]);
    // All of it is given away.
    const inputs = { matches: job.matches?.slice(), targetDepth, referenceDepth, transfer: true };
    const { options } = job;
    const outputs = { outputs: shownOutputs, outputDepth: true };
    return kept(await stitch(target, reference, { ...options, ...inputs, ...call, ...outputs }));
  });
  return result;
}

/** Hands the large arrays of a result over to the image worker. */
export async function kept<R extends { readonly voidMask: StitchResult["voidMask"] }>(
  result: R,
): Promise<Kept<R>> {
  const held = await lodged(result);
  const voids = await imageTask("countSet", held.voidMask as Kept<StitchResult>["voidMask"]);
  return { ...held, voids };
}

/** The first photo of a result as it was warped, to be averaged with the second one: for that its footprint is where either shows. */
export async function warpedOf({ offset, clipped, ...result }: PairResult): Promise<Warped> {
  const [warped, footprint] = await Promise.all([taken(result.warped), taken(result.seam)]);
  return { warped, footprint, offset, clipped };
}

/** A depth map to be given away. */
async function ownDepth(map: JobDepth | undefined): Promise<DepthInput | undefined> {
  if (!map || !("held" in map)) return map && { ...map, data: map.data.slice() };
  return taken(map);
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
  if ("held" in value && "bytes" in value) return Number(value.bytes);
  return Object.values(value).reduce((sum: number, part) => sum + bytesOf(part), 0);
}
