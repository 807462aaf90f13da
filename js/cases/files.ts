import { readFile } from "node:fs/promises";

import { FileError, systemCode } from "./errors.js";
import { systemPath } from "./file-names.js";

/** Reads a file. @throws {FileError} `not-found`, `not-readable`. */
export async function readBytes(path: string): Promise<Uint8Array> {
  try {
    return await readFile(systemPath(path));
  } catch (error) {
    const code = systemCode(error);
    if (code === "ENOENT" || code === "ENOTDIR")
      throw new FileError("not-found", path, "no such file", { cause: error });
    const reason = code === "EISDIR" ? "is a folder" : `cannot be read (${code ?? String(error)})`;
    throw new FileError("not-readable", path, reason, { cause: error });
  }
}

/** Reads a UTF-8 text file, without its byte order mark. @throws {FileError} as {@link readBytes}. */
export async function readText(path: string): Promise<string> {
  return new TextDecoder().decode(await readBytes(path));
}
