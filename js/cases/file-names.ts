/**
 * File names are bytes on Linux, and need not be UTF-8. In our strings bytes that are none stand as lone surrogates, U+DC80 to U+DCFF, as in
 * Python (PEP 383): functions of `node:path` keep them, and printed they are replacement characters.
 */

/** A character of UTF-8, with a character for each byte, or else a byte that is part of none. */
const CHARACTER =
  /[\x00-\x7f]|[\xc2-\xdf][\x80-\xbf]|\xe0[\xa0-\xbf][\x80-\xbf]|[\xe1-\xec\xee\xef][\x80-\xbf]{2}|\xed[\x80-\x9f][\x80-\xbf]|\xf0[\x90-\xbf][\x80-\xbf]{2}|[\xf1-\xf3][\x80-\xbf]{3}|\xf4[\x80-\x8f][\x80-\xbf]{2}|([\x80-\xff])/g;

/** The name that these bytes are. */
export function nameOf(bytes: Uint8Array): string {
  return Buffer.from(bytes)
    .toString("latin1")
    .replace(CHARACTER, (character: string, stray?: string) =>
      stray === undefined
        ? Buffer.from(character, "latin1").toString()
        : String.fromCharCode(0xdc00 + stray.charCodeAt(0)),
    );
}

/** A name as the functions of `node:fs` take it: as bytes if it is not UTF-8. */
export function systemPath(name: string): string | Buffer {
  const parts = name.split(/([\udc80-\udcff])/u);
  if (parts.length === 1) return name;
  return Buffer.concat(
    parts.map((part, i) =>
      i % 2 === 1 ? Buffer.of(part.charCodeAt(0) & 0xff) : Buffer.from(part),
    ),
  );
}
