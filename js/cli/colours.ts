import type { Photo } from "../cases/case.js";
import { convertColours } from "../codecs.js";
import { StitchError, type ImageOutput } from "../index.js";

/** Photos whose colours mean the same. */
export interface MatchedColours {
  readonly images: readonly ImageOutput[];
  /** The profile of the colours of all; null for sRGB. */
  readonly colourProfile: Uint8Array | null;
  /** The camera data of each. */
  readonly exif: readonly (Uint8Array | null)[];
  readonly warnings: readonly string[];
}

/**
 * Brings decoded photos into the colour space of one of them, `reference`. Those with its profile, byte for byte, stay as they are. A photo whose
 * profile is damaged is taken as it is, with a warning.
 */
export async function matchColours(
  files: readonly string[],
  photos: readonly Pick<Photo, "image" | "metadata">[],
  reference: number,
): Promise<MatchedColours> {
  const colourProfile = photos[reference]?.metadata.colourProfile ?? null;
  const warnings: string[] = [];
  const matched: ImageOutput[] = [];
  for (const [i, { image, metadata }] of photos.entries()) {
    const own = metadata.colourProfile;
    if (sameBytes(own, colourProfile)) {
      matched.push(image);
      continue;
    }
    try {
      matched.push(await convertColours(image, own, colourProfile));
    } catch (error) {
      if (!(error instanceof StitchError) || error.code !== "decode-failed") throw error;
      warnings.push(`colour-profile: ${files[i]}: colours are taken as they are: ${error.message}`);
      matched.push(image);
    }
  }
  const exif = photos.map(({ metadata }) => metadata.exif);
  return { images: matched, colourProfile, exif, warnings };
}

function sameBytes(a: Uint8Array | null, b: Uint8Array | null): boolean {
  if (a === null || b === null) return a === b;
  return a.length === b.length && a.every((value, i) => value === b[i]);
}
