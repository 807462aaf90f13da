// Four rendered photos with true cameras and exact depth.
import assert from "node:assert/strict";
import { fileURLToPath } from "node:url";
import { loadSet } from "../../dist/eval/many/set.js";

export const SET = fileURLToPath(new URL("../../target/sample-set/", import.meta.url));

/** The photos, read afresh: a test may give the arrays away; what is known of them; and photos with all that. */
export async function sampleSet() {
  const { photos, cameras, depths } = await loadSet(SET);
  assert.ok(cameras && depths);
  const known = photos.map((photo, i) => {
    const { K = [], R = [], t = [] } = cameras[i] ?? {};
    const camera = { rotation: Float64Array.from(R), translation: Float64Array.from(t) };
    return { ...photo, focalLength: K[0], camera, depth: depths[i] };
  });
  return { photos, cameras, depths, known };
}
