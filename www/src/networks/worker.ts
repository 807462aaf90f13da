import type { DepthEstimator } from "depthstitch/depth";
import type { Inpainter } from "depthstitch/inpaint";
import type { NetworkProgress, NetworkReply, NetworkRequest, Requests } from "./requests.js";
import { messageOf } from "../message-of.js";

/** The part of `DedicatedWorkerGlobalScope` used here; TypeScript's DOM library declares windows only. */
interface WorkerScope {
  onmessage: ((event: MessageEvent<NetworkRequest>) => void) | null;
  postMessage(reply: NetworkReply, transfer: ArrayBuffer[]): void;
}

const scope = globalThis as unknown as WorkerScope;
scope.onmessage = ({ data }) => void work(data);

const onProgress = (progress: NetworkProgress) => scope.postMessage({ progress }, []);

async function work(request: NetworkRequest): Promise<void> {
  try {
    const result =
      request.name === "depth" ? await estimate(request.args) : await fill(request.args);
    scope.postMessage({ result }, [result.data.buffer]);
  } catch (error) {
    scope.postMessage({ message: messageOf(error) }, []);
  }
}

/** The network in memory, which is reused for the second photo. */
let loaded: { key: string; network: Promise<DepthEstimator | Inpainter> } | null = null;

async function network<T extends DepthEstimator | Inpainter>(
  key: string,
  load: () => Promise<T>,
): Promise<T> {
  if (loaded?.key !== key) {
    const before = loaded?.network;
    loaded = { key, network: load() };
    await (await before?.catch(() => null))?.dispose();
  }
  try {
    return (await loaded.network) as T;
  } catch (error) {
    loaded = null;
    throw error;
  }
}

/** Statistics of ImageNet, for colours from 0 to 1. */
const imagenet = { mean: [0.485, 0.456, 0.406], std: [0.229, 0.224, 0.225] } as const;
/** For networks with dynamic input size: a multiple of 14 and 32, the usual patch sizes. */
const inputSize = { width: 448, height: 448 };

async function estimate({ photo, model, host, onnx }: Requests["depth"]["args"]) {
  const { loadDepthModel, loadOnnxDepth } = await import("depthstitch/depth");
  const { address: weights, colours, output } = onnx;
  const values = colours === "imagenet" ? imagenet : {};
  const estimator =
    model === "onnx"
      ? await network(`depth ${weights} ${colours} ${output}`, () =>
          loadOnnxDepth({ weights, ...values, inputSize, output, onProgress }),
        )
      : await network(`depth ${model} ${host}`, () =>
          loadDepthModel({ ...(host && { host }), onProgress }),
        );
  const depth = await estimator.estimate(photo, { onProgress });
  return { ...depth, device: estimator.device };
}

async function fill({ mosaic, voidMask, model, address }: Requests["fill"]["args"]) {
  const { loadInpainter } = await import("depthstitch/inpaint");
  const inpainter = await network(`fill ${model} ${address}`, () =>
    loadInpainter({ model, ...(address && { weights: address }), onProgress }),
  );
  return inpainter.inpaint(mosaic, voidMask, { onProgress });
}
