import type { ImageInput, ImageOutput, Mask } from "../types.js";
import type { ModelCallOptions, RuntimeOptions, Weights } from "../models/types.js";

/**
 * What an inpainting network takes and gives: a picture [1, 3, height, width] and a mask [1, 1, height, width] in, a
 * picture out.
 */
export interface InpaintNetwork {
  /** `"uint8"` 0 to 255, or `"float32"` 0 to 1, for picture and mask. */
  input: "uint8" | "float32";
  /** What the largest value of the mask marks; the other pixels are 0. */
  mask: "known" | "hole";
  /** White in the network's output: 255 or 1. */
  white: 255 | 1;
  /** Side in pixels of the square that the network was trained for; one that takes no other size says so itself. */
  side: number;
  /**
   * Pixels around a hole that the network does not get to see, as borders of voids are ragged and mixed. Each costs: what is
   * invented fits what it cannot see the less.
   */
  grow: number;
}

export interface InpainterOptions extends ModelCallOptions, RuntimeOptions {
  /**
   * `"migan"` (default): MI-GAN (Sargsyan et al. 2023), 28 MB, as the pipeline its authors published. `"lama"`: LaMa
   * (Suvorov et al. 2022), 208 MB, as exported by Carve. Or another network, whose `weights` have to be given.
   */
  model?: "migan" | "lama" | InpaintNetwork | undefined;
  /** The network's address, or its bytes, if not where the authors published it. */
  weights?: Weights | undefined;
  /** Pixels around a hole that the network does not get to see; by default as the model says (3 for both). */
  grow?: number | undefined;
  /** Default `"wasm"`. */
  device?: "wasm" | "webgpu" | undefined;
  /** Whether the browser keeps what was downloaded (default `true`). */
  cache?: boolean | undefined;
}

/** An inpainting network, ready to fill. */
export interface Inpainter {
  readonly device: "wasm" | "webgpu";
  /**
   * A copy of the picture with the pixels of `voidMask` invented and opaque; all others keep their bytes. It is done in
   * tiles around the voids, so that a small void in a large picture is filled at full resolution. Pixels without a picture
   * (alpha 0) outside the mask are not looked at.
   *
   * @throws {StitchError} `invalid-argument`, `size-mismatch`, `model-load-failed` where the network cannot be run,
   * `aborted`.
   */
  inpaint(mosaic: ImageInput, voidMask: Mask, options?: ModelCallOptions): Promise<ImageOutput>;
  /** Gives the network's memory back. It cannot be used afterwards. */
  dispose(): Promise<void>;
}
