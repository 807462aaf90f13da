import { InputFileError } from "../input-file-error.js";
import { slotNames, type DepthSettings, type SlotName } from "../state.js";
import type { Files } from "./decode-slots.js";
import { readCase } from "./parse-files.js";

/** Fetches a case of two photos with all its files. */
export async function fetchCase(
  folder: URL,
  signal: AbortSignal,
): Promise<{ files: Files; depth: DepthSettings }> {
  const theCase = await readCase(await fetchFile(folder, "case.json", signal));
  if (!theCase) throw new InputFileError("It is not of two photos.");
  const files: { [K in SlotName]?: File } = {};
  await Promise.all(
    slotNames.map(async (slot) => {
      const name = theCase.files[slot];
      if (name !== undefined) files[slot] = await fetchFile(folder, name, signal);
    }),
  );
  return { files, depth: theCase.depth };
}

async function fetchFile(folder: URL, name: string, signal: AbortSignal): Promise<File> {
  const response = await fetch(new URL(name, folder), { signal });
  if (!response.ok)
    throw new InputFileError(`${name}: the server responded with status ${response.status}.`);
  const blob = await response.blob();
  return new File([blob], name, { type: blob.type });
}
