// ONNX Runtime: loaded when a network is first asked for, one network at a time.
import { orAborted } from "./abort.js";
import { fetchBytes } from "./fetch.js";
import { missingPackage, modelError } from "./errors.js";
import { turns } from "./turns.js";
import type { ModelCallOptions, RuntimeOptions, WasmPaths } from "./types.js";

/** The part of `onnxruntime-web` that is used here. Its own types are not in ours, as the package may be missing. */
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

/** Numbers in the order of a network: `dims` from the slowest to the fastest. */
export interface Tensor {
  readonly data: TensorData;
  readonly dims: readonly number[];
}

/** A network ready to run. */
export interface Session {
  readonly inputs: readonly { name: string; dims: readonly (number | undefined)[] }[];
  /** The first output for these inputs, in the order of `inputs`. */
  run(inputs: readonly Tensor[]): Promise<Tensor>;
  dispose(): Promise<void>;
}

export interface SessionOptions extends RuntimeOptions, ModelCallOptions {
  device: "wasm" | "webgpu";
  cache: boolean;
}

/**
 * Fetches a network and prepares it.
 *
 * @throws {StitchError} `model-load-failed`, `aborted`.
 */
export async function openSession(
  weights: string | URL | Uint8Array,
  options: SessionOptions,
): Promise<Session> {
  const { device, onProgress, signal } = options;
  const bytes =
    weights instanceof Uint8Array ? weights : await fetchBytes(weights, options.cache, options);
  onProgress?.({ stage: "prepare", fraction: 0 });
  const runtime = await orAborted(load(device), signal);
  configure(runtime.env.wasm, options);
  const preparing = inTurn(() =>
    runtime.InferenceSession.create(bytes, {
      executionProviders: [device],
      // Errors only: the runtime warns about every harmless oddity of a network.
      logSeverityLevel: 3,
    }),
  );
  const session = await orAborted(preparing, signal, (late) => void late.release()).catch(
    (cause: unknown) => {
      if (signal?.aborted) throw cause;
      throw modelError(prepareMessage(weights, cause), cause);
    },
  );
  onProgress?.({ stage: "prepare", fraction: 1 });
  return wrap(runtime, session);
}

function prepareMessage(weights: string | URL | Uint8Array, cause: unknown): string {
  // The runtime says "no available backend found" when its own wasm is not where it looked.
  if (/backend|wasm/i.test(String(cause))) {
    return "ONNX Runtime could not start; is its wasm where wasmPaths says?";
  }
  const name = weights instanceof Uint8Array ? `the ${weights.length} bytes` : String(weights);
  return `${name} could not be prepared as a network`;
}

async function load(device: "wasm" | "webgpu"): Promise<Runtime> {
  // Two literal imports: bundlers find them, and a page downloads only the one that it uses. TypeScript does not look
  // them up, so that the package can be built without them.
  try {
    return device === "webgpu"
      ? ((await import("onnxruntime-web/webgpu" as string)) as Runtime)
      : ((await import("onnxruntime-web/wasm" as string)) as Runtime);
  } catch (cause) {
    throw missingPackage("onnxruntime-web", cause);
  }
}

/** Sets the runtime up. It reads this when its first network is prepared, and never again. */
export function configure(
  wasm: { wasmPaths?: WasmPaths; numThreads?: number },
  { wasmPaths, threads = 1 }: RuntimeOptions,
): void {
  wasm.numThreads = threads;
  if (wasmPaths !== undefined) wasm.wasmPaths = wasmPaths;
}

/** The runtime cannot do two things at once. */
export const inTurn = turns();

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
      const outputs = await inTurn(() => session.run(feeds)).catch((cause: unknown) => {
        throw modelError("the network could not be run", cause);
      });
      const output = outputs[session.outputNames[0] ?? ""];
      if (!output) throw modelError("the network has no output");
      return output;
    },
    dispose: () => inTurn(() => session.release()),
  };
}
