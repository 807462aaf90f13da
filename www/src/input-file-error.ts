/** A file cannot be used. The message tells the user why, and what to choose instead. */
export class InputFileError extends Error {
  override readonly name = "InputFileError";
}
