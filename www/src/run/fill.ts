import type { Bytes, Held, Rgba } from "../image-worker/contents.js";
import { hold, taken } from "../image-worker/client.js";
import { NetworkError, runNetwork } from "../networks/client.js";
import type { NetworkProgress } from "../networks/requests.js";
import { lastingMessage, type Message, type Settings, type Store } from "../state.js";
import { errorMessage } from "../text/errors.js";
import { fillStatus } from "../text/networks.js";

/** What a result of two photos and one of many have in common. */
interface WithVoids {
  readonly mosaic: Held<Rgba>;
  readonly voidMask: Held<Bytes>;
  readonly voids: number;
}

/** A mosaic to be shown, and the settings that it was made with. */
interface Filled {
  readonly mosaic: Held<Rgba>;
  readonly settings: Settings;
  readonly message: Message | null;
}

const cache = new WeakMap<WithVoids, Map<string, Held<Rgba>>>();

/** Fills the voids of a mosaic as the settings say. If a network fails, they are as the core has filled them. */
export async function filledMosaic(
  store: Store,
  result: WithVoids,
  settings: Settings,
  signal: AbortSignal,
): Promise<Filled> {
  const report = (progress: NetworkProgress) =>
    store.set({
      running: { stage: "model-fill", fraction: progress.fraction, text: fillStatus(progress) },
    });
  try {
    const mosaic = await filledBySettings(result, settings, signal, report);
    return { mosaic, settings, message: lastingMessage(store.state) };
  } catch (error) {
    if (!(error instanceof NetworkError)) throw error;
    return {
      mosaic: result.mosaic,
      settings: { ...settings, fillMethod: "core" },
      message: errorMessage(error),
    };
  }
}

/** The mosaic filled by the core, or by a network, whose output is cached. */
async function filledBySettings(
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
