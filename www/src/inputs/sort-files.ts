import type { Case } from "./parse-files.js";
import { slotNames, type SlotName, type Slots } from "../state.js";

/** The assignment of files to slots. */
export interface Sorted {
  /** All photos without a case, also those that fit no slot. */
  readonly photos: readonly File[];
  readonly placed: { readonly [K in SlotName]?: File };
  /** Files that fit no slot. */
  readonly left: readonly File[];
}

const picture = /\.(png|jpe?g|webp|avif|gif|bmp|heic|heif)$/i;
const floats = /\.(npy|pfm)$/i;
const table = /\.(csv|txt)$/i;

export function isCaseFile(file: File): boolean {
  return /\.json$/i.test(file.name);
}

/**
 * Assigns files to slots by name: by the names in a case, if there is one; otherwise matches by extension, depth maps by
 * "depth" or "disp" in the name or by a format that only depth maps use, target and reference by those words. Two photos
 * (or depth maps) with other names are assigned in alphabetical order, target first; a single one is assigned to the slot
 * without a file of the user.
 */
export function sortFiles(files: readonly File[], theCase: Case | null, slots: Slots): Sorted {
  const placed: { [K in SlotName]?: File } = {};
  const rest = files
    .filter((file) => !isCaseFile(file))
    .sort((a, b) => a.name.localeCompare(b.name, "en", { numeric: true }));
  const take = (slot: SlotName, file: File | undefined) => {
    if (!file || placed[slot]) return;
    placed[slot] = file;
    rest.splice(rest.indexOf(file), 1);
  };

  if (theCase) {
    for (const slot of slotNames) {
      take(
        slot,
        rest.find((file) => file.name === theCase.files[slot]),
      );
    }
    // A case lists all of its files.
    return { photos: [], placed, left: rest };
  }

  take(
    "matches",
    rest.find((file) => table.test(file.name)),
  );
  const pictures = rest.filter((file) => picture.test(file.name) || file.type.startsWith("image/"));
  const isDepth = (file: File) => floats.test(file.name) || /depth|disp/i.test(file.name);
  const depths = rest.filter(
    (file) => isDepth(file) && (pictures.includes(file) || floats.test(file.name)),
  );
  const photos = pictures.filter((file) => !isDepth(file));
  const isFree = (slot: SlotName) => slots[slot]?.origin !== "own";
  place(depths, "targetDepth", "referenceDepth", isFree, take);
  place(photos, "target", "reference", isFree, take);
  return { photos, placed, left: rest };
}

function place(
  files: readonly File[],
  targetSlot: SlotName,
  referenceSlot: SlotName,
  isFree: (slot: SlotName) => boolean,
  take: (slot: SlotName, file: File | undefined) => void,
): void {
  const target = files.find((file) => /target|tgt/i.test(file.name));
  const reference = files.find((file) => file !== target && /reference|ref/i.test(file.name));
  const unnamed = files.filter((file) => file !== target && file !== reference);
  if (files.length === 1 && unnamed.length === 1 && !isFree(targetSlot) && isFree(referenceSlot)) {
    take(referenceSlot, unnamed[0]);
    return;
  }
  take(targetSlot, target ?? unnamed.shift());
  take(referenceSlot, reference ?? unnamed.shift());
}
