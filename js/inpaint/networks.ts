import type { InpaintNetwork } from "./types.js";

/** A network that is known by name. */
interface Published extends InpaintNetwork {
  address: string;
}

export const NETWORKS: Record<"migan" | "lama", Published> = {
  migan: {
    address: "https://huggingface.co/andraniksargsyan/migan/resolve/main/migan_pipeline_v2.onnx",
    input: "uint8",
    mask: "known",
    white: 255,
    side: 512,
    grow: 3,
  },
  lama: {
    address: "https://huggingface.co/Carve/LaMa-ONNX/resolve/main/lama_fp32.onnx",
    input: "float32",
    mask: "hole",
    white: 255,
    side: 512,
    grow: 3,
  },
};
