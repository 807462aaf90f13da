/**
 * Whether a JPEG, PNG or WebP file ends before its picture does. Firefox and WebKit take such a file, and fill what is missing with gray.
 * Other formats are left to the browser.
 */
export function isTruncated(bytes: Uint8Array<ArrayBuffer>): boolean {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const starts = (text: string, at = 0) =>
    bytes.length >= at + text.length &&
    [...text].every((character, i) => bytes[at + i] === character.charCodeAt(0));
  if (starts("\x89PNG")) return !pngEnds(view);
  if (starts("\xff\xd8")) return !jpegEnds(view, bytes);
  return starts("RIFF") && starts("WEBP", 8) && bytes.length < 8 + view.getUint32(4, true);
}

/** Whether the chunks lead to that which is the last. */
function pngEnds(view: DataView): boolean {
  for (let at = 8; at + 12 <= view.byteLength; at += 12 + view.getUint32(at)) {
    if (view.getUint32(at + 4) === 0x49454e44) return true;
  }
  return false;
}

/** Whether the marker segments and scans lead to the end-of-image marker (ITU T.81, annex B). */
function jpegEnds(view: DataView, bytes: Uint8Array): boolean {
  for (let at = 2; ;) {
    at = bytes.indexOf(0xff, at);
    if (at < 0 || at + 2 > bytes.length) return false;
    const marker = bytes[at + 1] ?? 0;
    if (marker === 0xd9) return true;
    // Within a scan: a data byte, a fill byte, or a restart marker.
    if (marker === 0 || (marker >= 0xd0 && marker <= 0xd7)) at += 2;
    else if (marker === 0xff) at += 1;
    else if (at + 4 > bytes.length) return false;
    else at += 2 + view.getUint16(at + 2);
  }
}
