import { StitchError } from "../index.js";

/** The bytes that a call is refused for, first with `maxBytes` of 1, then with what it asked for: as it gets to know what it needs. */
export async function predictedBytes(
  call: (limit: { maxBytes: number; worker: false }) => Promise<unknown>,
): Promise<number[]> {
  const predicted: number[] = [];
  for (;;) {
    try {
      await call({ maxBytes: predicted.at(-1) ?? 1, worker: false });
      return predicted;
    } catch (error) {
      if (!(error instanceof StitchError && error.code === "too-large")) throw error;
      predicted.push(error.details.bytes ?? NaN);
    }
  }
}
