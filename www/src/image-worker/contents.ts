/** Decoded files. */
import type { Held } from "./held.js";
import type { Rgba } from "./paint.js";

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** A photo with its orientation applied, downscaled to the limit. */
export interface Photo extends Size {
  readonly pixels: Held<Rgba>;
  readonly colourSpace: PredefinedColorSpace;
  /** How often the user turned it by 90° clockwise. */
  readonly turns: number;
  /** Size in the file, with its orientation and turns applied. */
  readonly original: Size;
  /** 35 mm equivalent focal length from EXIF data, if any. */
  readonly focalLength35: number | null;
  /** A small version for the thumbnail. */
  readonly preview: ImageBitmap;
  /** Equal for equal pixels, and for others in practice never. */
  readonly fingerprint: string;
}

/** A depth map as stored in its file. */
export interface DepthMap extends Size {
  readonly data: Uint8Array<ArrayBuffer> | Uint16Array<ArrayBuffer> | Float32Array<ArrayBuffer>;
}
