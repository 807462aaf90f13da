// Reads two photos, stitches them in a worker, and hashes the result, in any environment.
import { stitch } from "depthstitch";
import { decodeDepth, decodeImage } from "depthstitch/codecs";

/**
 * @param {(name: string) => Promise<ArrayBuffer>} read
 * @returns {Promise<string>} SHA-256 of the mosaic and of the forward model
 */
export async function digest(read) {
  /** @param {string} name */
  const text = async (name) => new TextDecoder().decode(await read(name));
  const about = JSON.parse(await text("case.json"));
  const { kind, invalid } = about.depth;
  const rows = (await text(about.matches)).trim().split("\n").slice(1);
  const result = await stitch(
    await decodeImage(await read(about.target)),
    await decodeImage(await read(about.reference)),
    {
      matches: Float32Array.from(rows.flatMap((row) => row.split(",").map(Number))),
      targetDepth: { ...(await decodeDepth(await read(about.target_depth))), kind, invalid },
      referenceDepth: { ...(await decodeDepth(await read(about.reference_depth))), kind, invalid },
      transfer: true,
    },
  );
  const { mosaic, forward } = result;
  const all = new Blob([
    mosaic.data,
    new Uint8Array(forward.h.buffer),
    new Uint8Array(forward.e.buffer),
  ]);
  const hash = await crypto.subtle.digest("SHA-256", await all.arrayBuffer());
  return Array.from(new Uint8Array(hash), (byte) => byte.toString(16).padStart(2, "0")).join("");
}
