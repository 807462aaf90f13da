/** The weights of a network: a URL or the bytes. */
export type Weights = string | URL | ArrayBuffer | Uint8Array;

/** Progress of loading or running a network. */
export interface ModelProgress {
  /** Downloading the weights, initializing the network, or running it. */
  stage: "download" | "prepare" | "run";
  /** Completed fraction of the stage, 0 to 1; 0 while the size of a download is unknown. */
  fraction: number;
  /** Bytes downloaded so far. */
  loaded?: number;
  /** Size of the download in bytes; 0 if unknown. */
  total?: number;
}

/** Options of calls that load or run a network. */
export interface ModelCallOptions {
  /** Called as work progresses. An exception thrown here rejects the call. */
  onProgress?: ((progress: ModelProgress) => void) | undefined;
  /**
   * Aborts a download at once. A network running on this thread cannot be interrupted: the call rejects when the network
   * yields, and the result is discarded.
   */
  signal?: AbortSignal | undefined;
}

/** Location of ONNX Runtime's wasm: the URL of a folder, with a trailing slash, or of the two files. */
export type WasmPaths = string | { mjs?: string | URL; wasm?: string | URL };

/** Configuration of ONNX Runtime. It is global: the first values remain in effect. */
export interface RuntimeOptions {
  /**
   * Location of the runtime's wasm. By default where your bundler put it, or next to the runtime's script; never another
   * host.
   */
  wasmPaths?: WasmPaths | undefined;
  /** Threads of the wasm backend (default 1). More than one requires a cross-origin isolated page. */
  threads?: number | undefined;
}
