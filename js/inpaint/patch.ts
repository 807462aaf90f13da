import { modelError } from "../models/errors.js";
import { planes, resample } from "../models/resample.js";
import type { Session, Tensor, TensorData } from "../models/runtime.js";
import { dilate, prefill } from "./prefill.js";
import type { Box } from "./tiles.js";
import type { InpaintNetwork } from "./types.js";

/**
 * Inpaints one crop of the image. Returns three planes of the size of the crop, 0 to 255.
 *
 * @param data RGBA of the whole image, `stride` pixels wide
 * @param holes the pixels of the crop without a colour
 */
export async function inpaintPatch(
  session: Session,
  network: InpaintNetwork,
  data: Uint8ClampedArray,
  stride: number,
  crop: Box,
  holes: Uint8Array,
): Promise<Float32Array> {
  const { width, height } = crop;
  const masked = dilate(holes, width, height, network.dilation);
  const colours = new Float32Array(3 * width * height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const from = 4 * ((crop.y + y) * stride + crop.x + x);
      for (let c = 0; c < 3; c++) colours[(c * height + y) * width + x] = data[from + c] ?? 0;
    }
  }
  prefill(colours, masked, width, height);

  const [w, h] = sizeFor(session, crop);
  const same = w === width && h === height;
  const image = same ? colours : resample(planes(colours, width, height, 3), w, h);
  // A downsampled pixel that any part of a hole contributes to is a hole.
  const mask = same ? masked : resample(planes(masked, width, height, 1), w, h);
  const result = await session.run(
    inSessionOrder(session, [
      { data: toInput(image, network), dims: [1, 3, h, w] },
      { data: toMask(mask, network), dims: [1, 1, h, w] },
    ]),
  );
  if (result.data.length !== 3 * w * h) {
    const dims = result.dims.join(", ");
    throw modelError(`the network's output must be an image of ${w}×${h}, got [${dims}]`);
  }
  const inpainted = scaled(result.data, 255 / network.outputMax);
  return same ? inpainted : resample(planes(inpainted, w, h, 3), width, height);
}

/** The input size of the network: its own if fixed, otherwise that of the crop. */
function sizeFor(session: Session, crop: Box): [number, number] {
  const [, , height, width] = session.inputs[0]?.dims ?? [];
  return [width ?? crop.width, height ?? crop.height];
}

function toInput(values: Float32Array, { input }: InpaintNetwork): TensorData {
  if (input === "float32") return scaled(values, 1 / 255);
  return new Uint8Array(new Uint8ClampedArray(values).buffer);
}

function toMask(values: Uint8Array | Float32Array, { input, mask }: InpaintNetwork): TensorData {
  const out = input === "uint8" ? new Uint8Array(values.length) : new Float32Array(values.length);
  const most = input === "uint8" ? 255 : 1;
  const [hole, known] = mask === "hole" ? [most, 0] : [0, most];
  for (let i = 0; i < values.length; i++) out[i] = (values[i] ?? 0) > 0.001 ? hole : known;
  return out;
}

function scaled(values: TensorData, factor: number): Float32Array {
  const out = new Float32Array(values);
  for (let i = 0; i < out.length; i++) out[i] = (out[i] ?? 0) * factor;
  return out;
}

/** Image and mask in the order of the network's inputs; some have the mask first. */
function inSessionOrder(session: Session, [image, mask]: [Tensor, Tensor]): Tensor[] {
  return /mask/i.test(session.inputs[0]?.name ?? "") ? [mask, image] : [image, mask];
}
