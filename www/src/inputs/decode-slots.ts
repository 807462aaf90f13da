import { decodePhoto, imageTaskAlone } from "../image-worker/client.js";
import type { Photo } from "../image-worker/contents.js";
import {
  photoSlots,
  type Contents,
  type Loaded,
  type PhotoSlot,
  type SlotName,
  type Slots,
  type State,
} from "../state.js";
import { messageOf } from "../message-of.js";

/** The parsers of cases and matches, which most do without. */
export const parsers = () => import("./parse-files.js");

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
  matches: async (file) => (await parsers()).readMatches(file),
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
    return messageOf(error);
  }
}

/** How often the photo of a slot is turned: as before if it is decoded again. */
export function turnsOf({ slots }: State, slot: SlotName, files: Files): number {
  if (slot !== "target" && slot !== "reference") return 0;
  const loaded = slots[slot];
  return loaded && loaded.file === files[slot] ? loaded.content.turns : 0;
}

/**
 * Those photos that have to be decoded again, so that both are in the larger of their colour spaces; or why that failed, as a file may have
 * been moved since. `present` gives the photos, which may be turned or replaced meanwhile.
 */
export async function inOneColourSpace(
  present: () => Slots,
  limit: number,
): Promise<{ readonly [K in PhotoSlot]?: Loaded<Photo> | string }> {
  const slots = present();
  const wide = "display-p3";
  if (photoSlots.every((slot) => slots[slot]?.content.colourSpace !== wide)) return {};
  let again = {};
  for (const slot of photoSlots) {
    const before = slots[slot];
    if (!before || before.content.colourSpace === wide) continue;
    const { file, content } = before;
    const after = await decodePhoto(file, file.name, limit, content.turns, wide).then(
      (content) => ({ ...before, content }),
      (error: unknown) => `${file.name} could not be read again: ${messageOf(error)}`,
    );
    again = { ...again, [slot]: after };
  }
  const now = present();
  const changed = photoSlots.some((slot) => now[slot] !== slots[slot]);
  return changed ? inOneColourSpace(present, limit) : again;
}
