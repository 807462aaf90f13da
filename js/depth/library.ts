// The part of `@huggingface/transformers` used here, and its global configuration.
import { missingPackage } from "../models/errors.js";
import { serialQueue } from "../models/queue.js";
import type { WasmPaths } from "../models/types.js";
import type { Prediction } from "./estimator.js";

export interface Environment {
  remoteHost: string;
  remotePathTemplate: string;
  localModelPath: string;
  allowLocalModels: boolean;
  allowRemoteModels: boolean;
  useBrowserCache: boolean;
  useFSCache: boolean;
  useWasmCache: boolean;
  fetch: typeof fetch;
  backends: {
    onnx: {
      wasm?: { wasmPaths?: WasmPaths; numThreads?: number };
      /** `web` in browsers (wasm runtime), `node` in Node (native runtime). */
      versions?: { web?: string };
    };
  };
}

export interface Library {
  env: Environment;
  RawImage: new (data: ArrayLike<number>, width: number, height: number, channels: number) => Photo;
  AutoImageProcessor: Loader<(photo: Photo) => Promise<Record<string, unknown>>>;
  AutoModelForDepthEstimation: Loader<Network>;
}
interface Loader<T> {
  from_pretrained(id: string, options: object): Promise<T>;
}
export interface Photo {
  /** The image without alpha. */
  rgb(): Photo;
}
export interface Network {
  (inputs: Record<string, unknown>): Promise<{ predicted_depth?: Prediction }>;
  dispose(): Promise<unknown>;
}
/** Progress of a download, as the library reports it. */
export interface FileProgress {
  status: string;
  file?: string;
  loaded?: number;
  total?: number;
}

let imported: Promise<Library> | undefined;

export function loadLibrary(): Promise<Library> {
  imported ??= importLibrary().catch((cause: unknown) => {
    imported = undefined;
    throw cause;
  });
  return imported;
}

async function importLibrary(): Promise<Library> {
  try {
    // Its types do not compile under this package's settings, so the assertion keeps TypeScript from resolving them.
    const library = (await import("@huggingface/transformers" as string)) as Library;
    const { wasm } = library.env.backends.onnx;
    // The library would fetch the runtime from a public CDN; bundlers have put it next to the page's scripts.
    if (wasm && String(Object(wasm.wasmPaths).wasm).startsWith("https://cdn."))
      delete wasm.wasmPaths;
    return library;
  } catch (cause) {
    throw missingPackage("@huggingface/transformers", cause);
  }
}

const exclusively = serialQueue();

/**
 * Runs `work` with these settings of the library and restores the previous ones: the settings are global, and the program
 * may use the library for other models.
 */
export function withSettings<T>(
  env: Environment,
  settingsOf: () => Partial<Environment>,
  work: () => Promise<T>,
): Promise<T> {
  return exclusively(async () => {
    const settings = settingsOf();
    const before = Object.fromEntries(
      Object.keys(settings).map((name) => [name, env[name as keyof Environment]]),
    );
    Object.assign(env, settings);
    try {
      return await work();
    } finally {
      Object.assign(env, before);
    }
  });
}
