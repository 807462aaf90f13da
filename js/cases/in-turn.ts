import { setImmediate } from "node:timers/promises";

/** What whoever reads files is told, and can say. */
export interface Reading {
  readonly signal?: AbortSignal;
  /** Called before a file is read. */
  readonly onFile?: (path: string) => void;
}

/**
 * A function that reads one file after another. Decoding keeps the thread busy, so between two files it lets signals through and stops if it is
 * told to.
 */
export function inTurn({ signal, onFile }: Reading) {
  let last: Promise<unknown> = Promise.resolve();
  return <T>(path: string, load: (path: string) => Promise<T>): Promise<T> => {
    const next = last.then(async () => {
      await setImmediate();
      signal?.throwIfAborted();
      onFile?.(path);
      return load(path);
    });
    last = next;
    return next;
  };
}
