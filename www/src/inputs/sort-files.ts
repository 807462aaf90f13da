import type { Case } from "./case-file.js";
import type { SlotName, Slots } from "../state.js";

/** Where the files of a drop belong. */
export interface Sorted {
  readonly placed: { readonly [K in SlotName]?: File };
  /** Files that belong nowhere. */
  readonly left: readonly File[];
}

const picture = /\.(png|jpe?g|webp|avif|gif|bmp|heic|heif)$/i;
const floats = /\.(npy|pfm)$/i;
const table = /\.(csv|txt)$/i;

export function isCaseFile(file: File): boolean {
  return /\.json$/i.test(file.name);
}

/**
 * Places files by name: a case's own names first; then matches by extension, depth maps by `depth` or `disparity` in the
 * name or by a format that only they have, target and reference by those words. Two photos (or depth maps) whose names say nothing are taken in the order
 * of their names, target first; a single one goes where none of the user's own is yet.
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
    for (const slot of caseSlots) {
      take(
        slot,
        rest.find((file) => file.name === theCase.files[slot]),
      );
    }
    // A case says itself whether it has depth.
    return { placed, left: rest };
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
  return { placed, left: rest };
}

const caseSlots: readonly SlotName[] = [
  "target",
  "reference",
  "targetDepth",
  "referenceDepth",
  "matches",
];

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
