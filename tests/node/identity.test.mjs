// Native code and wasm give the same bytes: all pixels, all flags and all bits of both models.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdir, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { test } from "node:test";
import { stitch, stitchMany } from "depthstitch";
import { loadCase } from "../../dist/cases/case.js";
import { dataFolder, exampleRun, root } from "../../js/tools/shared.mjs";
import { sampleSet } from "./sample-set.mjs";

for (const folder of [join(root, "target", "sample-small"), join(dataFolder, "nis-PTS_17")]) {
  const missing = !existsSync(join(folder, "case.json"));
  const skip = missing && `no ${folder} (set DEPTHSTITCH_DATA)`;
  test(`${folder.split(/[\\/]/).at(-1)}: native and wasm agree to the byte`, { skip }, async () => {
    const pair = await loadCase(folder);
    const { target, reference, matches, targetDepth, referenceDepth } = pair;
    assert.ok(matches && targetDepth && referenceDepth);
    const inputs = { target, reference, targetDepth, referenceDepth };

    const arrays = Object.entries(inputs).map(([name, { data }]) => [name, data]);
    const native = await hashes(
      pair.name,
      inputs,
      Object.fromEntries([["matches", matches], ...arrays]),
    );

    const found = await stitch(target, reference, { matches, targetDepth, referenceDepth });
    const { quality } = found;
    assert.match(found.report.model, /^(depth|calibrated)$/);
    assert.deepEqual(native, {
      mosaic: fnv(found.mosaic.data),
      voidMask: fnv(found.voidMask.data),
      warped: fnv(found.warped.data),
      footprint: fnv(found.footprint.data),
      inliers: fnv(found.inliers),
      forward: fnv(Float64Array.of(...found.forward.h, ...found.forward.e)),
      reverse: fnv(Float64Array.of(...found.reverse.h, ...found.reverse.e)),
      quality: fnv(
        Float64Array.of(
          quality.psnrBbox,
          quality.ssimBbox,
          quality.psnrMask,
          quality.ssimMask,
          quality.coverage,
        ),
      ),
    });
  });
}

test("sample-set: native and wasm agree to the byte about many photos", async () => {
  const { photos } = await sampleSet();
  const arrays = photos.map(({ data }, i) => [i, data]);
  const native = await hashes("sample-set", photos, Object.fromEntries(arrays));
  const found = await stitchMany(photos);
  const cameras = found.photos.flatMap(({ camera, focalLength }) => {
    assert.ok(camera && focalLength);
    return [...camera.rotation, ...camera.translation, focalLength];
  });
  assert.deepEqual(native, {
    mosaic: fnv(found.mosaic.data),
    labels: fnv(found.labels.data),
    voidMask: fnv(found.voidMask.data),
    cameras: fnv(Float64Array.from(cameras)),
    distortion: fnv(Float64Array.of(found.distortion)),
  });
});

/**
 * What native code makes of arrays.
 *
 * @param {string} name of a folder that they are written to
 * @param {object} sizes
 * @param {Record<string, Uint8Array | Uint8ClampedArray | Float32Array>} files
 */
async function hashes(name, sizes, files) {
  const dump = join(root, "target", "identity", name);
  await mkdir(dump, { recursive: true });
  const text = JSON.stringify(sizes, (key, value) => (key === "data" ? undefined : value));
  await writeFile(join(dump, "sizes.json"), text);
  for (const [file, data] of Object.entries(files)) await writeFile(join(dump, file), data);
  const command = ["--quiet", ...exampleRun("stitch-hash", [dump])];
  return JSON.parse(execFileSync("cargo", command, { cwd: root, encoding: "utf8" }));
}

/**
 * FNV-1a, 64 bit, in two halves of 32: BigInt takes seconds for a mosaic.
 *
 * @param {ArrayBufferView} view
 */
function fnv(view) {
  const bytes = new Uint8Array(view.buffer, view.byteOffset, view.byteLength);
  let [high, low] = [0xcbf29ce4, 0x84222325];
  for (const byte of bytes) {
    low = (low ^ byte) >>> 0;
    // Times 2⁴⁰ + 0x1b3, modulo 2⁶⁴.
    const product = low * 0x1b3;
    high = (Math.imul(high, 0x1b3) + (low << 8) + Math.floor(product / 2 ** 32)) >>> 0;
    low = product >>> 0;
  }
  return [high, low].map((half) => half.toString(16).padStart(8, "0")).join("");
}
