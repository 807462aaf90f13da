import { FileError, parseCase, parseMatches } from "depthstitch/cases";
import { InputFileError } from "../input-file-error.js";
import type { DepthSettings, SlotName } from "../state.js";

/** A case: the names of its files and the meaning of its depth values. */
export interface Case {
  readonly files: { readonly [K in SlotName]?: string };
  readonly depth: DepthSettings;
}

/**
 * Reads a `case.json`. The scale of its depth is ignored, as the geometry is the same for any scale. One that lists `photos`
 * is of more than two, which need no case: null.
 */
export async function readCase(file: File): Promise<Case | null> {
  const text = await file.text();
  if (/"photos"\s*:\s*\[/.test(text) && !/"target"\s*:/.test(text)) return null;
  const { target, reference, matches, depth } = asInputError(file, parseCase, text);
  return {
    files: {
      target,
      reference,
      ...(matches !== null && { matches }),
      ...(depth?.target && { targetDepth: depth.target }),
      ...(depth?.reference && { referenceDepth: depth.reference }),
    },
    depth: { kind: depth?.kind ?? "inverse", invalid: depth?.invalid ?? null },
  };
}

/** Reads matches from a CSV file. */
export async function readMatches(file: File): Promise<Float32Array> {
  const { name, type, size } = file;
  if (size === 0) throw new InputFileError(`${name} is empty.`);
  if (type.startsWith("image/")) {
    throw new InputFileError(
      `${name} is an image. Choose a CSV file with the header xt,yt,xr,yr, followed by one match per line.`,
    );
  }
  const matches = asInputError(file, parseMatches, await file.text());
  if (matches.length === 0) throw new InputFileError(`${name} contains no matches.`);
  return matches;
}

/** Parses a file. @throws {InputFileError} */
function asInputError<T>(
  { name }: File,
  parse: (text: string, path: string) => T,
  text: string,
): T {
  try {
    return parse(text, name);
  } catch (error) {
    throw error instanceof FileError ? new InputFileError(`${error.message}.`) : error;
  }
}
