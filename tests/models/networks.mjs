// Small networks with the interfaces of the large ones, whose output is known.
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { root } from "../../js/tools/shared.mjs";
import { onnx } from "./onnx-writer.mjs";

export const folder = join(root, "target", "models");

const MEAN = [0.485, 0.456, 0.406];
const STD = [0.229, 0.224, 0.225];
/** What the depth networks below multiply red, green and blue with. */
const WEIGHTS = [0.5, 0.3, 0.2];
/** What they add: each file of a model its own, so that a result tells which one it came from. */
export const BIAS = { model: 10, model_fp16: 20, model_quantized: 30 };

/** As Depth Anything: pixel_values [1, 3, height, width] to predicted_depth [1, height, width]. @param {number} bias */
function depthNetwork(bias) {
  return onnx({
    inputs: { pixel_values: { type: "float32", dims: [1, 3, "height", "width"] } },
    outputs: { predicted_depth: { type: "float32", dims: [1, "height", "width"] } },
    constants: {
      weights: { dims: [1, 3, 1, 1], data: Float32Array.from(WEIGHTS) },
      bias: { dims: [1], data: Float32Array.of(bias) },
      channel: { dims: [1], data: BigInt64Array.of(1n) },
    },
    nodes: [
      { op: "Conv", inputs: ["pixel_values", "weights", "bias"], outputs: ["sum"] },
      { op: "Relu", inputs: ["sum"], outputs: ["positive"] },
      { op: "Squeeze", inputs: ["positive", "channel"], outputs: ["predicted_depth"] },
    ],
  });
}

/** What they make of one colour. @param {number[]} rgb @param {number} bias */
export function depthOf(rgb, bias) {
  const parts = rgb.map((value, c) => {
    const normal = (value / 255 - (MEAN[c] ?? 0)) / (STD[c] ?? 1);
    return normal * (WEIGHTS[c] ?? 0);
  });
  return parts.reduce((sum, part) => sum + part, bias);
}

/** Takes away what {@link writeDepthModel} wrote: another test may look for a model that is not there. @param {string} id */
export function removeDepthModel(id) {
  rmSync(join(folder, ...id.split("/")), { recursive: true, force: true });
}

/** Writes a model in the library's own folder format below `target/models`. @param {string} id */
export function writeDepthModel(id) {
  const at = join(folder, ...id.split("/"));
  mkdirSync(join(at, "onnx"), { recursive: true });
  const config = {
    architectures: ["DepthAnythingForDepthEstimation"],
    model_type: "depth_anything",
    patch_size: 14,
  };
  const preprocessor = {
    do_normalize: true,
    do_rescale: true,
    do_resize: true,
    ensure_multiple_of: 14,
    image_mean: MEAN,
    image_processor_type: "DPTImageProcessor",
    image_std: STD,
    keep_aspect_ratio: true,
    resample: 3,
    rescale_factor: 1 / 255,
    size: { height: 56, width: 56 },
  };
  writeFileSync(join(at, "config.json"), JSON.stringify(config));
  writeFileSync(join(at, "preprocessor_config.json"), JSON.stringify(preprocessor));
  for (const [file, bias] of Object.entries(BIAS)) {
    writeFileSync(join(at, "onnx", `${file}.onnx`), depthNetwork(bias));
  }
}

/**
 * As LaMa: a picture of 0 to 1 and a mask with 1 for holes to a picture of 0 to 255, all of one fixed size. It fills holes
 * with the mean of what is known, and would not if picture or mask came in any other form.
 *
 * @param {number} side
 */
export function lamaLike(side) {
  const mean = (/** @type {string} */ from, /** @type {string} */ to) => ({
    op: "ReduceMean",
    inputs: [from],
    outputs: [to],
    attributes: { axes: [2, 3], keepdims: 1 },
  });
  return onnx({
    inputs: {
      image: { type: "float32", dims: [1, 3, side, side] },
      mask: { type: "float32", dims: [1, 1, side, side] },
    },
    outputs: { output: { type: "float32", dims: [1, 3, side, side] } },
    constants: {
      one: { dims: [1], data: Float32Array.of(1) },
      white: { dims: [1], data: Float32Array.of(255) },
    },
    nodes: [
      { op: "Sub", inputs: ["one", "mask"], outputs: ["known"] },
      { op: "Mul", inputs: ["image", "known"], outputs: ["seen"] },
      mean("seen", "sum"),
      mean("known", "count"),
      { op: "Div", inputs: ["sum", "count"], outputs: ["average"] },
      { op: "Mul", inputs: ["average", "mask"], outputs: ["filled"] },
      { op: "Add", inputs: ["seen", "filled"], outputs: ["unit"] },
      { op: "Mul", inputs: ["unit", "white"], outputs: ["output"] },
    ],
  });
}
