// The rendered pair of photos that the tests stitch.
import { readFile } from "node:fs/promises";
import { StitchError } from "depthstitch";
import { decodeDepth, decodeImage } from "depthstitch/codecs";

const folder = new URL("../../target/sample-small/", import.meta.url);

/** @param {string} name */
const file = (name) => readFile(new URL(name, folder));

/**
 * Both photos, their depth and the matches between them, read afresh: a test may give the arrays away.
 *
 * @returns {Promise<{
 *   target: import("depthstitch").ImageOutput,
 *   reference: import("depthstitch").ImageOutput,
 *   inputs: { matches: Float32Array, targetDepth: import("depthstitch").DepthInput, referenceDepth: import("depthstitch").DepthInput },
 * }>}
 */
export async function sample() {
  const about = JSON.parse(await readFile(new URL("case.json", folder), "utf8"));
  /** @param {string} name */
  const depth = async (name) => {
    const map = await decodeDepth(await file(name));
    return { ...map, kind: about.depth.kind, invalid: about.depth.invalid };
  };
  const rows = (await readFile(new URL(about.matches, folder), "utf8")).trim().split("\n").slice(1);
  return {
    target: await decodeImage(await file(about.target)),
    reference: await decodeImage(await file(about.reference)),
    inputs: {
      matches: Float32Array.from(rows.flatMap((row) => row.split(",").map(Number))),
      targetDepth: await depth(about.target_depth),
      referenceDepth: await depth(about.reference_depth),
    },
  };
}

/**
 * What `promise` rejects with.
 *
 * @param {Promise<unknown>} promise
 * @returns {Promise<import("depthstitch").StitchError>}
 */
export async function rejection(promise) {
  try {
    await promise;
  } catch (error) {
    if (error instanceof StitchError) return error;
    throw error;
  }
  throw new Error("was not rejected");
}
