import { invalid } from "../errors.js";
import type { ImageInput } from "../types.js";
import { orAborted, throwIfAborted } from "../models/abort.js";
import * as check from "../models/check.js";
import { modelError } from "../models/errors.js";
import { configure, inTurn } from "../models/runtime.js";
import type { ModelCallOptions } from "../models/types.js";
import { estimator } from "./estimator.js";
import {
  type Environment,
  type FileProgress,
  type Library,
  loadLibrary,
  withSettings,
} from "./library.js";
import type { DepthEstimator, DepthModel, DepthModelOptions } from "./types.js";

/** Depth Anything V2 (Yang et al. 2024) as ONNX. Small is Apache-2.0, the larger two are for non-commercial use. */
const MODELS = {
  small: "onnx-community/depth-anything-v2-small",
  base: "onnx-community/depth-anything-v2-base",
  large: "onnx-community/depth-anything-v2-large",
} as const;

const names = "model device dtype host path local cache cacheDir".split(" ");

/**
 * Fetches and prepares a monocular depth network. Needs the package `@huggingface/transformers`.
 *
 * @throws {StitchError} `invalid-argument`, `model-load-failed`, `aborted`.
 */
export async function loadDepthModel(options: DepthModelOptions = {}): Promise<DepthEstimator> {
  check.known(options, [...names, ...check.callNames, ...check.runtimeNames]);
  const { id, revision = "main", output = "inverse" } = modelOf(options.model ?? "small");
  check.oneOf("output", output, "inverse", "metric");
  check.oneOf("device", options.device ?? "auto", "auto", "webgpu", "wasm", "cpu");
  const runtime = check.runtime(options);
  const { onProgress, signal } = check.call(options);
  throwIfAborted(signal);

  const library = await orAborted(loadLibrary(), signal);
  const { wasm } = library.env.backends.onnx;
  if (wasm) configure(wasm, runtime);
  const common = { revision, ...(options.cacheDir && { cache_dir: options.cacheDir }) };
  const report = fileReporter(onProgress);
  const load = async ({ device, dtype }: Choice) => {
    throwIfAborted(signal);
    const processor = await library.AutoImageProcessor.from_pretrained(id, common);
    const chosen = { ...common, device, dtype, progress_callback: report };
    const network = await library.AutoModelForDepthEstimation.from_pretrained(id, chosen);
    return { processor, network, device };
  };
  const [first, ...others] = await choices(options, library.env);
  const loading = withSettings(
    library.env,
    () => settingsOf(options, library.env, signal),
    // A GPU may be there and still be too small, or its driver broken.
    () => others.reduce((loaded, next) => loaded.catch(() => load(next)), load(first)),
  );
  const giveBack = (late: Awaited<typeof loading>) => void late.network.dispose();
  const { processor, network, device } = await orAborted(loading, signal, giveBack).catch(
    (cause: unknown) => {
      throwIfAborted(signal);
      throw modelError(`the depth model ${id} could not be loaded`, cause);
    },
  );
  onProgress?.({ stage: "prepare", fraction: 1 });

  return estimator({
    device,
    output,
    predict(photo, signal) {
      const running = inTurn(async () => {
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
      await inTurn(() => network.dispose());
    },
  });
}

function modelOf(model: NonNullable<DepthModelOptions["model"]>): DepthModel {
  if (typeof model === "object" && typeof model?.id === "string") return model;
  const id = Object.hasOwn(MODELS, String(model)) && MODELS[model as keyof typeof MODELS];
  if (id) return { id };
  throw invalid(`model must be "small", "base", "large" or { id }, got ${String(model)}`);
}

function rgb({ RawImage }: Library, { data, width, height }: ImageInput) {
  return new RawImage(data, width, height, 4).rgb();
}

interface Choice {
  device: DepthEstimator["device"];
  dtype: string;
}

/** The devices to try, each with the type of weights that is smallest there without loss to speak of. */
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

/** The browser's GPU; a browser may know of WebGPU and still have none to give. */
async function gpuAdapter() {
  interface Gpu {
    requestAdapter(): Promise<{ features: { has(name: string): boolean } } | null>;
  }
  const { gpu } = (globalThis.navigator ?? {}) as { gpu?: Gpu };
  return (await gpu?.requestAdapter().catch(() => null)) ?? undefined;
}

function settingsOf(
  { host, path, local, cache = true }: DepthModelOptions,
  { fetch }: Environment,
  signal: AbortSignal | undefined,
): Partial<Environment> {
  return {
    ...(host !== undefined && { remoteHost: String(host) }),
    ...(path !== undefined && { remotePathTemplate: path }),
    ...(local !== undefined && { localModelPath: local }),
    allowLocalModels: local !== undefined,
    allowRemoteModels: local === undefined,
    // In Node the runtime reads networks from disk, so there they are always kept.
    ...(!cache && { useBrowserCache: false }),
    // As a blob, the runtime's script would break a page's content security policy.
    useWasmCache: false,
    fetch: (input, init) =>
      fetch(input, { ...init, ...(signal && { signal }) }).catch((cause: unknown) => {
        throw new Error(`${String(input)} could not be fetched`, { cause });
      }),
  };
}

/** Tells of the network's files together; those of settings are small and come first. */
function fileReporter(onProgress: ModelCallOptions["onProgress"]) {
  const files = new Map<string, { loaded: number; total: number }>();
  return ({ status, file = "", loaded = 0, total = 0 }: FileProgress): void => {
    if (status !== "progress" || !/\.onnx/.test(file)) return;
    files.set(file, { loaded, total });
    const sum = (of: "loaded" | "total") => [...files.values()].reduce((n, f) => n + f[of], 0);
    const all = { loaded: sum("loaded"), total: sum("total") };
    onProgress?.({ stage: "download", fraction: all.total && all.loaded / all.total, ...all });
    if (all.loaded === all.total) onProgress?.({ stage: "prepare", fraction: 0 });
  };
}
