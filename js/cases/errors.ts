/** What can be wrong with a file, as opposed to what is in the picture. Stable, for programs. */
export type FileErrorCode =
  | "not-found"
  | "not-readable"
  | "not-writable"
  | "invalid-case"
  | "invalid-matches"
  | "invalid-npy"
  | "decode-failed"
  | "too-large";

/** A file that is missing, damaged or not what it should be. The message starts with its path. */
export class FileError extends Error {
  override readonly name = "FileError";

  constructor(
    readonly code: FileErrorCode,
    readonly path: string,
    reason: string,
    options?: ErrorOptions,
  ) {
    super(`${path}: ${reason}`, options);
  }
}

/** The `code` of an error of the operating system (`ENOENT`, …), if it has one. */
export function systemCode(error: unknown): string | undefined {
  if (!(error instanceof Error) || !("code" in error)) return undefined;
  return typeof error.code === "string" ? error.code : undefined;
}
