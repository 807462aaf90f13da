/** A file that cannot be used; the message says why and what would do, to the user. */
export class UnusableFile extends Error {
  override readonly name = "UnusableFile";
}
