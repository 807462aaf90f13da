/** Decoded files, and other arrays of pixels. */

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** A part of a picture. */
export interface Rect extends Size {
  readonly x: number;
  readonly y: number;
}

/** An array of pixels, row by row. */
export interface Pixels extends Size {
  readonly data:
    | Uint8ClampedArray<ArrayBuffer>
    | Uint8Array<ArrayBuffer>
    | Uint16Array<ArrayBuffer>
    | Float32Array<ArrayBuffer>;
}

export function isPixels(value: unknown): value is Pixels {
  return (
    typeof value === "object" && value !== null && "data" in value && ArrayBuffer.isView(value.data)
  );
}

export interface Rgba extends Size {
  readonly data: Uint8ClampedArray<ArrayBuffer>;
}
export interface Bytes extends Size {
  readonly data: Uint8Array<ArrayBuffer>;
}

/** What the main thread has of an array that the image worker holds. */
export type Held<T extends Pixels = Pixels> = Omit<T, "data"> & {
  readonly held: number;
  readonly bytes: number;
};
/** What the main thread keeps of a value whose large arrays the image worker holds. */
export type Lodged<T> = {
  [K in keyof T]: NonNullable<T[K]> extends Pixels
    ? Held<NonNullable<T[K]>> | Exclude<T[K], Pixels>
    : T[K];
};

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
