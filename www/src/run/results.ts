import {
  stitch,
  type CallOptions,
  type DepthInput,
  type DepthOutput,
  type Output,
  type StitchOptions,
  type StitchResult,
  type StitchResultOf,
  type Warped,
} from "depthstitch";
import { imageTask, later, lodged, taken } from "../image-worker/client.js";
import type { Bytes, Held, Lodged, Pixels, Rgba } from "../image-worker/contents.js";
import { keyOf, type Job, type JobDepth } from "./job.js";
import { firstOutputs, laterOutputs, type Kept, type PairResult } from "./kept.js";

/** Size limit of the cache; results take tens of megabytes each. */
const cacheBytes = 400e6;

/** The latest results, the most recently used last. */
const cache = new Map<string, unknown>();

/** Pixels of both photos above which what not every view shows is made when it is first needed, to save memory. */
const mostAtOnce = 32e6;

/** Computes something later, with progress and Cancel. */
type ComputeLater = <T>(work: (call: CallOptions) => Promise<T>) => Promise<T>;

/**
 * The result of a job of two photos, computed unless it is cached. With `atOnce` all of it is made, however large the photos are;
 * otherwise `computeLater` makes what is missing.
 */
export async function resultOf(
  job: Job,
  call: CallOptions,
  computeLater: ComputeLater,
  atOnce = job.target.width * job.target.height + job.reference.width * job.reference.height <=
    mostAtOnce,
): Promise<PairResult> {
  const { result } = await remembered(keyOf(job), async () => {
    const outputs = atOnce ? [...firstOutputs, ...laterOutputs] : firstOutputs;
    const found = await kept(await stitched(job, { ...call, outputs, outputDepth: atOnce }));
    return atOnce ? (found as PairResult) : withLater(job, found, computeLater);
  });
  return result;
}

/** Stitches copies of a job's inputs. */
async function stitched<O extends Output>(job: Job, how: StitchOptions<O>) {
  const [target, reference, targetDepth, referenceDepth] = await Promise.all([
    taken(job.target.pixels),
    taken(job.reference.pixels),
    ownDepth(job.targetDepth),
    ownDepth(job.referenceDepth),
  ]);
  const inputs = { matches: job.matches?.slice(), targetDepth, referenceDepth, transfer: true };
  return stitch(target, reference, { ...job.options, ...inputs, ...how });
}

/** A result with what it lacks to be made when a view first needs it: by stitching once more, which gives the same bytes. */
function withLater(
  job: Job,
  result: Kept<StitchResultOf<(typeof firstOutputs)[number]>>,
  computeLater: ComputeLater,
): PairResult {
  let rest: Promise<Lodged<StitchResultOf<(typeof laterOutputs)[number]>>> | undefined;
  const part = <T extends Pixels>(
    sides: Omit<T, "data">,
    bytes: number,
    pick: (of: Awaited<NonNullable<typeof rest>>) => unknown,
  ) =>
    later<T>(sides, bytes * sides.width * sides.height, async () => {
      rest ??= computeLater(async (call) =>
        lodged(await stitched(job, { ...call, outputs: laterOutputs, outputDepth: true })),
      );
      rest.catch(() => (rest = undefined));
      return pick(await rest) as Held<T>;
    });
  const { width, height } = result.mosaic;
  const depthOf = (side: "target" | "reference") => {
    const { width, height } = job[side];
    return part<DepthOutput>({ width, height, kind: "inverse" }, 4, (of) => of[`${side}Depth`]);
  };
  return {
    ...result,
    warped: part<Rgba>({ width, height }, 4, (of) => of.warped),
    seam: part<Bytes>({ width, height }, 1, (of) => of.seam),
    ...(result.report.model !== "homography" && {
      targetDepth: depthOf("target"),
      referenceDepth: depthOf("reference"),
    }),
  } as PairResult;
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
