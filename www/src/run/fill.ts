import type { StitchResult } from "depthstitch";
import { runNetwork } from "../networks/client.js";
import type { NetworkProgress } from "../networks/requests.js";
import type { Settings } from "../state.js";

const cache = new WeakMap<StitchResult, Map<string, StitchResult["mosaic"]>>();

/** The mosaic with voids filled as the settings say: by the core, or by a network, whose output is cached. */
export async function filledMosaic(
  result: StitchResult,
  { fillMethod, fillAddress }: Settings,
  signal: AbortSignal,
  onProgress: (progress: NetworkProgress) => void,
): Promise<StitchResult["mosaic"]> {
  const { mosaic, voidMask } = result;
  if (fillMethod === "core" || !voidMask.data.includes(255)) return mosaic;
  const filledBy = cache.get(result) ?? new Map<string, StitchResult["mosaic"]>();
  cache.set(result, filledBy);
  const key = `${fillMethod} ${fillAddress}`;
  const args = { mosaic, voidMask, model: fillMethod, address: fillAddress };
  const filled = filledBy.get(key) ?? (await runNetwork("fill", args, signal, onProgress));
  filledBy.set(key, filled);
  return filled;
}
