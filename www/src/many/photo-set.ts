import type { Photo } from "../image-worker/contents.js";
import type { Loaded, Slots } from "../slots.js";

/** The limit that holds for two photos by default. */
export const defaultLimit = 2048;
/** The most that `stitchMany` takes. */
const mostPhotos = 30;

/** A photo of a set, from the moment its file was chosen. */
export interface SetPhoto {
  /** Stays the same while the photo is in the set, so that what is decoded finds its place. */
  readonly id: number;
  readonly file: File;
  readonly origin: Loaded<unknown>["origin"];
  /** Null until it is decoded. */
  readonly content: Photo | null;
  /** The size limit that it was decoded with. */
  readonly limit: number;
  /** Why it could not be decoded. */
  readonly problem: string | null;
}

/** Three photos or more, in the order in which they were chosen. */
export interface PhotoSet {
  readonly photos: readonly SetPhoto[];
  /** Longer side in pixels to which they are to be downscaled; 0 for no limit. */
  readonly limit: number;
  /** Id of the photo that the user chose as reference; null for the one in the middle. */
  readonly reference: number | null;
  /** The two photos that were there before, with their depth maps and matches, for the way back. */
  readonly pair: Slots;
}

let last = 0;

export function setPhoto(
  file: File,
  origin: SetPhoto["origin"],
  content: Photo | null = null,
  limit = 0,
): SetPhoto {
  return { id: ++last, file, origin, content, limit, problem: null };
}

/** The size limit of a set: that of the settings, or less for many photos unless the user has chosen one. */
export function limitOf(count: number, chosen: number): number {
  if (chosen !== defaultLimit || count <= 10) return chosen;
  return count <= 20 ? 1536 : 1280;
}

/** The colour space of a set: the larger one if any photo has it. */
export function coloursOfSet({ photos }: PhotoSet): PredefinedColorSpace {
  const wide = photos.some(({ content }) => content?.colourSpace === "display-p3");
  return wide ? "display-p3" : "srgb";
}

/** Whether a photo of a set is to be decoded, for the first time, at another size, or in another colour space. */
export function isDue({ content, limit, problem }: SetPhoto, set: PhotoSet): boolean {
  if (!content) return problem === null;
  if (content.colourSpace !== coloursOfSet(set)) return true;
  return limit !== set.limit && !hasSize(content, set.limit);
}

/** Whether a photo has the size that it is given by a limit of its longer side; 0 for no limit. */
export function hasSize({ original, width }: Photo, limit: number): boolean {
  const scale = limit > 0 ? limit / Math.max(original.width, original.height) : 1;
  return width === Math.max(1, Math.round(original.width * Math.min(1, scale)));
}

/** The photos that are stitched: decoded, each picture once, thirty at most. */
export function usablePhotos(set: PhotoSet): SetPhoto[] {
  const unused = whyUnused(set);
  return set.photos.filter(({ id, content }) => content !== null && !unused.has(id));
}

/** Whether a photo is still to be decoded. */
export function isReading(set: PhotoSet): boolean {
  const unused = whyUnused(set);
  return set.photos.some((photo) => isDue(photo, set) && !unused.has(photo.id));
}

/** Why photos of the set are not stitched, by their id: what can be told before stitching. */
export function whyUnused({ photos }: PhotoSet): ReadonlyMap<number, string> {
  const why = new Map<number, string>();
  const seen = new Map<string, SetPhoto>();
  let count = 0;
  for (const photo of photos) {
    const { id, content, problem } = photo;
    const same = content && seen.get(content.fingerprint);
    if (problem !== null) why.set(id, problem);
    else if (same) why.set(id, `Not used: it is the same picture as ${same.file.name}.`);
    else if (count === mostPhotos) {
      why.set(
        id,
        `Not used: at most ${mostPhotos} photos can be stitched. Remove another one to use it.`,
      );
    } else {
      count++;
      if (content) seen.set(content.fingerprint, photo);
    }
  }
  return why;
}
