/** What a command makes. */
export interface Produced {
  /** The bytes of every output by path. */
  readonly contents: ReadonlyMap<string, Uint8Array>;
  /** Each one a code and a sentence. */
  readonly warnings: readonly string[];
  /** One line. */
  readonly summary: string;
}
