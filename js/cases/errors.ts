/** What is wrong with a file. The codes are stable. */
export type FileErrorCode =
  | "not-found"
  | "not-readable"
  | "not-writable"
  | "invalid-case"
  | "invalid-matches"
  | "invalid-npy"
  | "decode-failed"
  | "too-large";

/** A file is missing or damaged, or does not have the expected format. The message starts with its path. */
export class FileError extends Error {
  override readonly name = "FileError";

  readonly code: FileErrorCode;
  readonly path: string;

  constructor(code: FileErrorCode, path: string, reason: string, options?: { cause?: unknown }) {
    super(`${path}: ${reason}`, options);
    this.code = code;
    this.path = path;
  }
}

/** The `code` of a system error (`ENOENT`, …), if it has one. */
export function systemCode(error: unknown): string | undefined {
  if (!(error instanceof Error) || !("code" in error)) return undefined;
  return typeof error.code === "string" ? error.code : undefined;
}
