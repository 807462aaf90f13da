import { decodePhoto, imageTaskAlone } from "../image-worker/client.js";
import {
  photoSlots,
  type Contents,
  type Loaded,
  type SlotName,
  type Slots,
  type State,
} from "../state.js";
import { readMatches } from "./parse-files.js";

export type Files = { readonly [K in SlotName]?: File };

/** The decoder of each slot. Each rejects with an {@link InputFileError}. */
const decoders: {
  readonly [K in SlotName]: (file: File, how: How) => Promise<Contents[K]>;
} = {
  target: (file, { limit, turns }) => decodePhoto(file, file.name, limit, turns),
  reference: (file, { limit, turns }) => decodePhoto(file, file.name, limit, turns),
  // The package's decoders keep their worker busy, unlike those of the browser, and cannot be stopped.
  targetDepth: (file, { signal }) => imageTaskAlone(signal, "decodeDepth", file, file.name),
  referenceDepth: (file, { signal }) => imageTaskAlone(signal, "decodeDepth", file, file.name),
  matches: (file) => readMatches(file),
};

interface How {
  readonly limit: number;
  readonly turns: number;
  readonly signal: AbortSignal;
}

/** Decodes the file of a slot. Returns the slot, or why decoding failed. */
export async function decodeSlot<K extends SlotName>(
  slot: K,
  file: File | undefined,
  origin: Loaded<unknown>["origin"],
  how: How,
): Promise<Partial<Slots> | string | null> {
  if (!file) return null;
  try {
    return { [slot]: { file, content: await decoders[slot](file, how), origin } };
  } catch (error) {
    return error instanceof Error ? error.message : String(error);
  }
}

/** How often the photo of a slot is turned: as before if it is decoded again. */
export function turnsOf({ slots }: State, slot: SlotName, files: Files): number {
  if (slot !== "target" && slot !== "reference") return 0;
  const loaded = slots[slot];
  return loaded && loaded.file === files[slot] ? loaded.content.turns : 0;
}

/** Those photos that have to be decoded again, so that both are in the larger of their colour spaces. */
export async function inOneColourSpace(
  slots: Slots,
  limit: number,
): Promise<Pick<Partial<Slots>, "target" | "reference">> {
  const wide = "display-p3";
  if (photoSlots.every((slot) => slots[slot]?.content.colourSpace !== wide)) return {};
  let again = {};
  for (const slot of photoSlots) {
    const loaded = slots[slot];
    if (!loaded || loaded.content.colourSpace === wide) continue;
    const { file, content } = loaded;
    const decoded = await decodePhoto(file, file.name, limit, content.turns, wide);
    again = { ...again, [slot]: { ...loaded, content: decoded } };
  }
  return again;
}
