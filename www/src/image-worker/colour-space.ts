/**
 * The colour space in which a photo is kept: that of its file, as far as canvases have it. Browsers convert what they draw, so a photo of any
 * profile looks right in both; sRGB only lacks the most saturated colours of the others.
 *
 * @param head the beginning of the file
 */
export async function colourSpaceOf(head: ArrayBuffer): Promise<PredefinedColorSpace> {
  if (!hasDisplayP3()) return "srgb";
  const profile = embeddedProfile(head) ?? (await profileInPng(head));
  return profile && !hasPrimariesOfSrgb(profile) ? "display-p3" : "srgb";
}

/** Whether canvases have the larger colour space. Browsers without it ignore or refuse what asks for it. */
function hasDisplayP3(): boolean {
  try {
    return new ImageData(1, 1, { colorSpace: "display-p3" }).colorSpace === "display-p3";
  } catch {
    return false;
  }
}

/** The ICC profile that a file has as it is, such as a JPEG, WebP, AVIF or HEIC. */
function embeddedProfile(head: ArrayBuffer): DataView | null {
  // The signature of all profiles, at byte 36 of each.
  const start = latin1(head).indexOf("acsp") - 36;
  return start < 0 ? null : new DataView(head, start);
}

/** The ICC profile of a PNG, which is compressed. */
async function profileInPng(head: ArrayBuffer): Promise<DataView | null> {
  const text = latin1(head);
  const chunk = text.startsWith("PNG", 1) ? text.indexOf("iCCP") : -1;
  if (chunk < 0) return null;
  // A name that ends with a zero, a byte for the method of compression, and the profile.
  const data = text.indexOf("\0", chunk + 4) + 2;
  const end = chunk + 4 + new DataView(head).getUint32(chunk - 4);
  try {
    const stream = new Blob([head.slice(data, end)]).stream();
    const inflated = stream.pipeThrough(new DecompressionStream("deflate"));
    return new DataView(await new Response(inflated).arrayBuffer());
  } catch {
    return null;
  }
}

/** X and Y of red and green in sRGB, as profiles have them (adapted to D50). */
const primariesOfSrgb = { rXYZ: [0.4361, 0.2225], gXYZ: [0.3851, 0.7169] } as const;

function hasPrimariesOfSrgb(profile: DataView): boolean {
  try {
    return Object.entries(primariesOfSrgb).every(([tag, expected]) => {
      const at = tagOf(profile, tag);
      return expected.every(
        (value, i) => Math.abs(profile.getInt32(at + 8 + 4 * i) / 65536 - value) < 0.01,
      );
    });
  } catch (error) {
    if (error instanceof RangeError) return false;
    throw error;
  }
}

/** Where the data of a tag are. @throws {RangeError} if the profile has no such tag */
function tagOf(profile: DataView, wanted: string): number {
  for (let i = 0, count = profile.getUint32(128); i < count; i++) {
    const entry = 132 + 12 * i;
    const name = String.fromCharCode(...[0, 1, 2, 3].map((byte) => profile.getUint8(entry + byte)));
    if (name === wanted) return profile.getUint32(entry + 4);
  }
  throw new RangeError(`no ${wanted}`);
}

function latin1(bytes: ArrayBuffer): string {
  return new TextDecoder("latin1").decode(bytes);
}
