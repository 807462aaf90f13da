import type { StitchError } from "../errors.js";
import { orAborted, throwIfAborted } from "./abort.js";
import type { ModelCallOptions } from "./types.js";

/**
 * The network that is being initialized, once it is. One that nobody will hold, as the call was aborted or `onProgress`
 * throws, is released.
 */
export async function loaded<T>(
  loading: Promise<T>,
  { onProgress, signal }: ModelCallOptions,
  release: (network: T) => Promise<unknown>,
  failure: (cause: unknown) => StitchError,
): Promise<T> {
  const network = await orAborted(loading, signal, (late) => void release(late)).catch(
    (cause: unknown) => {
      throwIfAborted(signal);
      throw failure(cause);
    },
  );
  try {
    onProgress?.({ stage: "prepare", fraction: 1 });
  } catch (error) {
    await release(network);
    throw error;
  }
  return network;
}
