/** Decoded files, as the page holds them. */

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** A photo, upright and at the size at which it is used. */
export interface Photo extends Size {
  readonly data: Uint8ClampedArray<ArrayBuffer>;
  /** Its size in the file, upright. */
  readonly original: Size;
  /** Its focal length as if it were on 35 mm film, where the file says so. */
  readonly focalLength35: number | null;
  /** The same photo, small, to be looked at. */
  readonly preview: ImageBitmap;
}

/** A depth map as its file has it; what its values mean is said elsewhere. */
export interface DepthMap extends Size {
  readonly data: Uint8Array<ArrayBuffer> | Uint16Array<ArrayBuffer> | Float32Array<ArrayBuffer>;
}
