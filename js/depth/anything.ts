import { callback } from "../callback.js";
import { unexpected } from "../describe.js";
import { invalid } from "../errors.js";
import type { ImageInput } from "../types.js";
import { orAborted, throwIfAborted } from "../models/abort.js";
import * as check from "../models/check.js";
import { modelError } from "../models/errors.js";
import { loaded } from "../models/loaded.js";
import { configure, exclusively } from "../models/runtime.js";
import type { ModelCallOptions, ModelProgress } from "../models/types.js";
import { estimator } from "./estimator.js";
import {
  type Environment,
  type FileProgress,
  type Library,
  loadLibrary,
  withSettings,
} from "./library.js";
import type { DepthEstimator, DepthModel, DepthModelOptions } from "./types.js";

/** Depth Anything V2 (Yang et al. 2024), the size licensed under Apache-2.0, as ONNX, at a fixed commit. */
const MODELS: Readonly<Record<"small", DepthModel>> = {
  small: {
    id: "onnx-community/depth-anything-v2-small",
    revision: "4472b7362082ad9968fee890ca0f1e5aca36b93d",
  },
};

const names = "model device dtype host path local cache cacheDir".split(" ");

/**
 * Downloads and initializes a monocular depth network. Requires the package `@huggingface/transformers`.
 *
 * @throws {StitchError} `invalid-argument`, `model-load-failed`, `aborted`.
 */
export async function loadDepthModel(options: DepthModelOptions = {}): Promise<DepthEstimator> {
  const { id, revision, output, runtime, onProgress, signal, ...given } = check.read(() =>
    checked(options),
  );
  throwIfAborted(signal);

  const library = await orAborted(loadLibrary(), signal);
  const { wasm } = library.env.backends.onnx;
  if (wasm) configure(wasm, runtime);
  const common = { revision, ...(given.cacheDir && { cache_dir: given.cacheDir }) };
  const told = callback((progress: ModelProgress) => onProgress?.(progress));
  // The library fails if it throws.
  const report = fileReporter((progress) => {
    told.call(progress);
    told.rethrow();
  });
  const load = async ({ device, dtype }: Choice) => {
    throwIfAborted(signal);
    told.rethrow();
    const processor = await library.AutoImageProcessor.from_pretrained(id, common);
    const chosen = { ...common, device, dtype, progress_callback: report };
    const network = await library.AutoModelForDepthEstimation.from_pretrained(id, chosen);
    return { processor, network, device };
  };
  const [first, ...others] = await choices(given, library.env);
  const loading = withSettings(
    library.env,
    () => settingsOf(given, library.env, signal),
    // A GPU may have too little memory, or a broken driver.
    () => others.reduce((loading, next) => loading.catch(() => load(next)), load(first)),
  );
  const { processor, network, device } = await loaded(
    loading,
    { onProgress, signal },
    ({ network }) => network.dispose(),
    (cause) => {
      told.rethrow();
      return modelError(`the depth model ${id} could not be loaded`, cause);
    },
  );

  return estimator({
    device,
    output,
    predict(photo, signal) {
      const running = exclusively(async () => {
        throwIfAborted(signal);
        const inputs = await processor(rgb(library, photo));
        const { predicted_depth: depth } = await network(inputs);
        if (!depth) throw modelError(`${id} has no output named predicted_depth`);
        return depth;
      });
      return orAborted(running, signal).catch((cause: unknown) => {
        throwIfAborted(signal);
        throw modelError(`the depth model ${id} could not be run`, cause);
      });
    },
    async dispose() {
      await exclusively(() => network.dispose());
    },
  });
}

function checked(options: DepthModelOptions) {
  check.known(options, [...names, ...check.callNames, ...check.runtimeNames]);
  const { id, revision, output = "inverse" } = modelOf(options);
  const { device = "auto", dtype, host, path, local, cache = true, cacheDir } = options;
  return {
    id,
    revision,
    ...optionalTexts({ dtype, path, local, cacheDir }),
    host: host === undefined ? undefined : check.address("host", host),
    cache: check.boolean("cache", cache),
    output: check.oneOf("model.output", output, "inverse", "metric"),
    device: check.oneOf("device", device, "auto", "webgpu", "wasm", "cpu"),
    runtime: check.runtime(options),
    ...check.call(options),
  };
}

/** Those that are given, all of them strings. */
function optionalTexts<T extends object>(values: T): T {
  for (const [name, value] of Object.entries(values)) {
    if (value !== undefined) check.text(name, value);
  }
  return values;
}

function modelOf({ model = "small", host, local }: DepthModelOptions): DepthModel {
  if (model === "small") return MODELS.small;
  if (typeof model !== "object" || typeof model?.id !== "string")
    throw unexpected('model must be "small" or { id, revision }', model);
  if (model.revision === undefined && host === undefined && local === undefined)
    throw invalid("model.revision must be given for downloads from the Hugging Face Hub");
  return { ...model, revision: check.text("model.revision", model.revision ?? "main") };
}

function rgb({ RawImage }: Library, { data, width, height }: ImageInput) {
  return new RawImage(data, width, height, 4).rgb();
}

interface Choice {
  device: DepthEstimator["device"];
  dtype: string;
}

/** The devices to try, each with the smallest data type that hardly costs accuracy there. */
async function choices(
  { device = "auto", dtype }: DepthModelOptions,
  env: Environment,
): Promise<[Choice, ...Choice[]]> {
  const wasm: Choice = { device: "wasm", dtype: dtype ?? "q8" };
  const cpu: Choice = { device: "cpu", dtype: dtype ?? "fp32" };
  if (device === "wasm") return [wasm];
  if (device === "cpu") return [cpu];
  const adapter = await gpuAdapter();
  const half = adapter?.features.has("shader-f16") ? "fp16" : "fp32";
  const webgpu: Choice = { device: "webgpu", dtype: dtype ?? half };
  if (device === "webgpu") return [webgpu];
  if (env.backends.onnx.versions?.web === undefined) return [cpu];
  return adapter ? [webgpu, wasm] : [wasm];
}

/** The browser's GPU adapter; browsers with WebGPU may still have none. */
async function gpuAdapter() {
  interface Gpu {
    requestAdapter(): Promise<{ features: { has(name: string): boolean } } | null>;
  }
  const { gpu } = (globalThis.navigator ?? {}) as { gpu?: Gpu };
  return (await gpu?.requestAdapter().catch(() => null)) ?? undefined;
}

function settingsOf(
  { host, path, local, cache }: DepthModelOptions,
  { fetch }: Environment,
  signal: AbortSignal | undefined,
): Partial<Environment> {
  return {
    ...(host !== undefined && { remoteHost: String(host) }),
    ...(path !== undefined && { remotePathTemplate: path }),
    ...(local !== undefined && { localModelPath: local }),
    allowLocalModels: local !== undefined,
    allowRemoteModels: local === undefined,
    // In Node the runtime reads networks from disk, so they are always cached.
    ...(!cache && { useBrowserCache: false }),
    // A blob URL of the runtime's script would violate strict content security policies.
    useWasmCache: false,
    fetch: (input, init) =>
      fetch(input, { ...init, ...(signal && { signal }) }).catch((cause: unknown) => {
        throw new Error(`${String(input)} could not be fetched`, { cause });
      }),
  };
}

/** Reports the progress of all weight files together; configuration files are small and come first. */
function fileReporter(onProgress: NonNullable<ModelCallOptions["onProgress"]>) {
  const files = new Map<string, { loaded: number; total: number }>();
  return ({ status, file = "", loaded = 0, total = 0 }: FileProgress): void => {
    if (status !== "progress" || !/\.onnx/.test(file)) return;
    files.set(file, { loaded, total });
    const sum = (of: "loaded" | "total") => [...files.values()].reduce((n, f) => n + f[of], 0);
    const all = { loaded: sum("loaded"), total: sum("total") };
    onProgress({ stage: "download", fraction: all.total && all.loaded / all.total, ...all });
    if (all.loaded === all.total) onProgress({ stage: "prepare", fraction: 0 });
  };
}
