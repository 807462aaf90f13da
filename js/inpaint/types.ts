import type { ImageInput, ImageOutput, Mask } from "../types.js";
import type { ModelCallOptions, RuntimeOptions, Weights } from "../models/types.js";

/**
 * The interface of an inpainting network, which takes an image [1, 3, height, width] and a mask [1, 1, height, width] and
 * returns an image.
 */
export interface InpaintNetwork {
  /** Data type and range of image and mask: `"uint8"`, 0 to 255, or `"float32"`, 0 to 1. */
  input: "uint8" | "float32";
  /** Which pixels have the maximum value in the mask; all others are 0. */
  mask: "known" | "hole";
  /** Maximum of the output range: 255 or 1. */
  outputMax: 255 | 1;
  /** Side in pixels of the square images that the network was trained on. */
  tileSize: number;
  /**
   * Dilation of the mask in pixels, as colours at the borders of voids are unreliable. The larger it is, the less the
   * result fits its surroundings.
   */
  dilation: number;
}

/** Options of `loadInpainter`. */
export interface InpainterOptions extends ModelCallOptions, RuntimeOptions {
  /**
   * `"migan"` (default): MI-GAN (Sargsyan et al. 2023), 28 MB, the pipeline published by its authors. `"lama"`: LaMa
   * (Suvorov et al. 2022), 208 MB, exported by Carve. Or another network, which requires `weights`.
   */
  model?: "migan" | "lama" | InpaintNetwork | undefined;
  /** URL or bytes of the weights (default: where they were published, at a fixed commit). */
  weights?: Weights | undefined;
  /** Dilation of the mask in pixels (default: that of the model, 3 for both). */
  dilation?: number | undefined;
  /** Default `"wasm"`. */
  device?: "wasm" | "webgpu" | undefined;
  /** Whether browsers cache downloads (default `true`). */
  cache?: boolean | undefined;
}

/** An inpainting network that is ready to run. */
export interface Inpainter {
  readonly device: "wasm" | "webgpu";
  /**
   * Returns a copy of the image in which the pixels of `voidMask` are inpainted and opaque; all other bytes are unchanged.
   * Voids are processed in tiles, so that a small void in a large image is filled at full resolution. Transparent pixels
   * outside the mask are ignored.
   *
   * @throws {StitchError} `invalid-argument`, `size-mismatch`, `model-load-failed` if the network cannot be run,
   * `aborted`.
   */
  inpaint(mosaic: ImageInput, voidMask: Mask, options?: ModelCallOptions): Promise<ImageOutput>;
  /** Releases the network, which cannot be used afterwards. */
  dispose(): Promise<void>;
}
