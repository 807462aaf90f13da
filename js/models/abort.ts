import { abortError } from "../errors.js";

export function throwIfAborted(signal: AbortSignal | undefined): void {
  if (signal?.aborted) throw abortError(signal);
}

/**
 * The outcome of `work`, or a rejection as soon as `signal` is aborted. The work itself goes on: `late` gets what comes of
 * it then, to be given back.
 */
export async function orAborted<T>(
  work: Promise<T>,
  signal: AbortSignal | undefined,
  late: (result: T) => void = () => undefined,
): Promise<T> {
  if (!signal) return work;
  throwIfAborted(signal);
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

/** Gives the page or program a turn: a chance to paint, to answer, to abort. */
export function pause(): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve));
}
