// The part of `@huggingface/transformers` that is used here, and how it is told where models come from.
import { missingPackage } from "../models/errors.js";
import { turns } from "../models/turns.js";
import type { WasmPaths } from "../models/types.js";

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
      /** `web` in browsers, where the runtime is wasm; `node` in Node, where it is native. */
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
  /** The same without alpha. */
  rgb(): Photo;
}
export interface Network {
  (inputs: Record<string, unknown>): Promise<{ predicted_depth?: Prediction }>;
  dispose(): Promise<unknown>;
}
export interface Prediction {
  readonly data: ArrayLike<number>;
  readonly dims: readonly number[];
}
/** What the library tells of a file under way. */
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
    // Its types do not compile under this package's settings, so TypeScript is kept from looking them up.
    const library = (await import("@huggingface/transformers" as string)) as Library;
    const { wasm } = library.env.backends.onnx;
    // The library would fetch the runtime from a public host; the bundler has put it next to the page's own scripts.
    if (wasm && String(Object(wasm.wasmPaths).wasm).startsWith("https://cdn."))
      delete wasm.wasmPaths;
    return library;
  } catch (cause) {
    throw missingPackage("@huggingface/transformers", cause);
  }
}

const oneByOne = turns();

/**
 * Does `work` while the library's settings, which are one for the whole program, are these, and puts back what they
 * were before: the program may use the library for other models.
 */
export function withSettings<T>(
  env: Environment,
  settingsOf: () => Partial<Environment>,
  work: () => Promise<T>,
): Promise<T> {
  return oneByOne(async () => {
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
