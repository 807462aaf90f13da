import type { ImageOutput, Mask } from "depthstitch";
import { runNetwork } from "../networks/client.js";
import type { NetworkProgress } from "../networks/requests.js";
import type { Settings } from "../state.js";

/** What a result of two photos and one of many have in common. */
interface WithVoids {
  readonly mosaic: ImageOutput;
  readonly voidMask: Mask;
}

const cache = new WeakMap<WithVoids, Map<string, ImageOutput>>();

/** The mosaic with voids filled as the settings say: by the core, or by a network, whose output is cached. */
export async function filledMosaic(
  result: WithVoids,
  { fillMethod, fillAddress }: Settings,
  signal: AbortSignal,
  onProgress: (progress: NetworkProgress) => void,
): Promise<ImageOutput> {
  const { mosaic, voidMask } = result;
  if (fillMethod === "core" || !voidMask.data.includes(255)) return mosaic;
  const filledBy = cache.get(result) ?? new Map<string, ImageOutput>();
  cache.set(result, filledBy);
  const key = `${fillMethod} ${fillAddress}`;
  const args = { mosaic, voidMask, model: fillMethod, address: fillAddress };
  const filled = filledBy.get(key) ?? (await runNetwork("fill", args, signal, onProgress));
  filledBy.set(key, filled);
  return filled;
}
