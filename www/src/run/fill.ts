import type { StitchResult } from "depthstitch";
import { runNetwork } from "../networks/client.js";
import type { NetworkProgress } from "../networks/requests.js";
import type { Settings } from "../state.js";

const kept = new WeakMap<StitchResult, Map<string, StitchResult["mosaic"]>>();

/** The mosaic with its voids filled as the settings say: by the core already, or by a network now, once. */
export async function filledMosaic(
  result: StitchResult,
  { filler, fillAddress }: Settings,
  signal: AbortSignal,
  onProgress: (progress: NetworkProgress) => void,
): Promise<StitchResult["mosaic"]> {
  const { mosaic, voidMask } = result;
  if (filler === "core" || !voidMask.data.includes(255)) return mosaic;
  const known = kept.get(result) ?? new Map<string, StitchResult["mosaic"]>();
  kept.set(result, known);
  const key = `${filler} ${fillAddress}`;
  const args = { mosaic, voidMask, model: filler, address: fillAddress };
  const filled = known.get(key) ?? (await runNetwork("fill", args, signal, onProgress));
  known.set(key, filled);
  return filled;
}
