import type { InpaintNetwork } from "./types.js";

/** A network that can be selected by name. */
interface Published extends InpaintNetwork {
  /** At a fixed commit, so that the same file is loaded every time. */
  url: string;
}

/** The published networks. */
export const NETWORKS: Record<"migan" | "lama", Published> = {
  migan: {
    url: "https://huggingface.co/andraniksargsyan/migan/resolve/406830d0fa60666da0071c342ad2fbc8f30c5c64/migan_pipeline_v2.onnx",
    input: "uint8",
    mask: "known",
    outputMax: 255,
    tileSize: 512,
    dilation: 3,
  },
  lama: {
    url: "https://huggingface.co/Carve/LaMa-ONNX/resolve/c3c0c9e468934d62e79c329e35d82dd09ff8c444/lama_fp32.onnx",
    input: "float32",
    mask: "hole",
    outputMax: 255,
    tileSize: 512,
    dilation: 3,
  },
};
