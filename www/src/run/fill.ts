import type { Bytes, Held, Rgba } from "../image-worker/contents.js";
import { hold, taken } from "../image-worker/client.js";
import { runNetwork } from "../networks/client.js";
import type { NetworkProgress } from "../networks/requests.js";
import type { Settings } from "../state.js";

/** What a result of two photos and one of many have in common. */
interface WithVoids {
  readonly mosaic: Held<Rgba>;
  readonly voidMask: Held<Bytes>;
  readonly voids: number;
}

const cache = new WeakMap<WithVoids, Map<string, Held<Rgba>>>();

/** The mosaic with voids filled as the settings say: by the core, or by a network, whose output is cached. */
export async function filledMosaic(
  result: WithVoids,
  { fillMethod, fillAddress }: Settings,
  signal: AbortSignal,
  onProgress: (progress: NetworkProgress) => void,
): Promise<Held<Rgba>> {
  const { mosaic, voidMask, voids } = result;
  if (fillMethod === "core" || voids === 0) return mosaic;
  const filledBy = cache.get(result) ?? new Map<string, Held<Rgba>>();
  cache.set(result, filledBy);
  const key = `${fillMethod} ${fillAddress}`;
  const known = filledBy.get(key);
  if (known) return known;
  const [image, voidPixels] = await Promise.all([taken(mosaic), taken(voidMask)]);
  const args = { mosaic: image, voidMask: voidPixels, model: fillMethod, address: fillAddress };
  const filled = await hold(await runNetwork("fill", args, signal, onProgress));
  filledBy.set(key, filled);
  return filled;
}
