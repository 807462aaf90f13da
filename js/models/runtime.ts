// ONNX Runtime, imported when the first network is loaded. Networks run one at a time.
import { orAborted } from "./abort.js";
import { fetchBytes } from "./fetch.js";
import { missingPackage, modelError } from "./errors.js";
import { loaded } from "./loaded.js";
import { serialQueue } from "./queue.js";
import type { ModelCallOptions, RuntimeOptions, WasmPaths } from "./types.js";

/** The part of `onnxruntime-web` used here. Our types do not refer to its own, as it is an optional peer dependency. */
interface Runtime {
  env: { wasm: { wasmPaths?: WasmPaths; numThreads?: number } };
  Tensor: new (type: string, data: TensorData, dims: readonly number[]) => Tensor;
  InferenceSession: { create(model: Uint8Array, options: object): Promise<RawSession> };
}
interface RawSession {
  readonly inputNames: readonly string[];
  readonly outputNames: readonly string[];
  readonly inputMetadata: readonly { shape?: readonly (number | string)[] }[];
  run(feeds: Record<string, Tensor>): Promise<Record<string, Tensor>>;
  release(): Promise<void>;
}

export type TensorData = Float32Array | Uint8Array;

/** A tensor in row-major order. */
export interface Tensor {
  readonly data: TensorData;
  readonly dims: readonly number[];
}

/** A network that is ready to run. */
export interface Session {
  readonly inputs: readonly { name: string; dims: readonly (number | undefined)[] }[];
  /** Runs the network on `inputs`, in their order, and returns its first output. */
  run(inputs: readonly Tensor[]): Promise<Tensor>;
  dispose(): Promise<void>;
}

export interface SessionOptions extends RuntimeOptions, ModelCallOptions {
  device: "wasm" | "webgpu";
  cache: boolean;
}

/**
 * Fetches and initializes a network.
 *
 * @throws {StitchError} `model-load-failed`, `aborted`.
 */
export async function openSession(
  weights: string | URL | Uint8Array,
  options: SessionOptions,
): Promise<Session> {
  const { device, onProgress, signal } = options;
  // First, as without it the download would be in vain.
  const runtime = await orAborted(load(device), signal);
  const bytes =
    weights instanceof Uint8Array ? weights : await fetchBytes(weights, options.cache, options);
  onProgress?.({ stage: "prepare", fraction: 0 });
  configure(runtime.env.wasm, options);
  const creating = exclusively(() =>
    runtime.InferenceSession.create(bytes, {
      executionProviders: [device],
      // Errors only: the runtime warns about many harmless properties of networks.
      logSeverityLevel: 3,
    }),
  );
  const session = await loaded(
    creating,
    options,
    (session) => session.release(),
    (cause) => modelError(createMessage(weights, cause), cause),
  );
  return wrap(runtime, session);
}

function createMessage(weights: string | URL | Uint8Array, cause: unknown): string {
  // The runtime reports "no available backend found" if it does not find its own wasm.
  if (/backend|wasm/i.test(String(cause))) {
    return "ONNX Runtime could not be initialized: does wasmPaths point to its wasm files?";
  }
  const name = weights instanceof Uint8Array ? `the ${weights.length} bytes` : String(weights);
  return `${name} could not be loaded as a network`;
}

async function load(device: "wasm" | "webgpu"): Promise<Runtime> {
  // Literal imports, so that bundlers find them and pages download only the one they use. The assertions keep TypeScript
  // from resolving them, so that this package compiles without them.
  try {
    return device === "webgpu"
      ? ((await import("onnxruntime-web/webgpu" as string)) as Runtime)
      : ((await import("onnxruntime-web/wasm" as string)) as Runtime);
  } catch (cause) {
    throw missingPackage("onnxruntime-web", cause);
  }
}

/** Configures the runtime, which reads this once, when the first network is loaded. */
export function configure(
  wasm: { wasmPaths?: WasmPaths; numThreads?: number },
  { wasmPaths, threads = 1 }: RuntimeOptions,
): void {
  wasm.numThreads = threads;
  if (wasmPaths !== undefined) wasm.wasmPaths = wasmPaths;
}

/** Runs tasks one after another, as the runtime does not support concurrent calls. */
export const exclusively = serialQueue();

function wrap({ Tensor }: Runtime, session: RawSession): Session {
  return {
    inputs: session.inputNames.map((name, i) => ({
      name,
      dims: (session.inputMetadata[i]?.shape ?? []).map((side) =>
        typeof side === "number" && side > 0 ? side : undefined,
      ),
    })),
    async run(inputs) {
      const feeds = Object.fromEntries(
        inputs.map(({ data, dims }, i) => {
          const type = data instanceof Uint8Array ? "uint8" : "float32";
          return [session.inputNames[i] ?? String(i), new Tensor(type, data, dims)];
        }),
      );
      const outputs = await exclusively(() => session.run(feeds)).catch((cause: unknown) => {
        throw modelError("the network could not be run", cause);
      });
      const output = outputs[session.outputNames[0] ?? ""];
      if (!output) throw modelError("the network has no output");
      return output;
    },
    dispose: () => exclusively(() => session.release()),
  };
}
