import { abortError } from "../errors.js";

export function throwIfAborted(signal: AbortSignal | undefined): void {
  if (signal?.aborted) throw abortError(signal);
}

/**
 * Settles with `work`, or rejects as soon as `signal` is aborted. The work itself continues; its result is then passed to
 * `late`, which should release it.
 */
export async function orAborted<T>(
  work: Promise<T>,
  signal: AbortSignal | undefined,
  late: (result: T) => void = () => undefined,
): Promise<T> {
  if (!signal) return work;
  if (signal.aborted) {
    work.then(late, () => undefined);
    throw abortError(signal);
  }
  let abandon: () => void = () => undefined;
  const aborted = new Promise<never>((_, reject) => {
    abandon = () => reject(abortError(signal));
    signal.addEventListener("abort", abandon);
  });
  try {
    return await Promise.race([work, aborted]);
  } catch (error) {
    if (signal.aborted) work.then(late, () => undefined);
    throw signal.aborted ? abortError(signal) : error;
  } finally {
    signal.removeEventListener("abort", abandon);
  }
}

/** Yields to the event loop, so that the page can paint, respond and abort. */
export function pause(): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve));
}
