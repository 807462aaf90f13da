/** Properties of an image read from its first bytes, before it is decoded. */
export interface PhotoHeader {
  readonly format: "jpeg" | "png" | "heic" | "other";
  /** As stored, without orientation; `null` if unknown without decoding. */
  readonly size: { readonly width: number; readonly height: number } | null;
}

/** The frame header of a JPEG may follow a large embedded preview. */
export const headerBytes = 1 << 20;

export function readHeader(bytes: ArrayBuffer): PhotoHeader {
  const view = new DataView(bytes);
  if (startsWith(view, [0x89, 0x50, 0x4e, 0x47]) && view.byteLength >= 24) {
    return { format: "png", size: { width: view.getUint32(16), height: view.getUint32(20) } };
  }
  if (startsWith(view, [0xff, 0xd8])) return { format: "jpeg", size: jpegSize(view) };
  // ISO base media: the brand after "ftyp" identifies the format.
  const brand = view.byteLength >= 12 ? text(view, 4, 8) : "";
  const heic = /^ftyp(hei[cmsx]|hev[cmsx]|mif1|msf1)/.test(brand);
  return { format: heic ? "heic" : "other", size: null };
}

function jpegSize(view: DataView): PhotoHeader["size"] {
  let at = 2;
  while (at + 9 <= view.byteLength) {
    if (view.getUint8(at) !== 0xff) return null;
    const marker = view.getUint8(at + 1);
    // Start of frame: C0 to CF, except tables (C4, CC) and a reserved marker (C8).
    if (marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker)) {
      return { width: view.getUint16(at + 7), height: view.getUint16(at + 5) };
    }
    at += marker === 0xff ? 1 : 2 + view.getUint16(at + 2);
  }
  return null;
}

function startsWith(view: DataView, bytes: readonly number[]): boolean {
  return view.byteLength >= bytes.length && bytes.every((byte, i) => view.getUint8(i) === byte);
}

function text(view: DataView, at: number, length: number): string {
  return String.fromCharCode(...new Uint8Array(view.buffer, at, length));
}
