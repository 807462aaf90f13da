// The memory that a stitch is predicted to take, against what wasm really grows by, for several sizes and modes.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Worker, isMainThread, parentPort, workerData } from "node:worker_threads";
import { stitch } from "depthstitch";
import { core } from "../../dist/core.js";
import { rejection, sample } from "./sample.mjs";

/** @typedef {{ times: number, mode: "photos" | "depth" | "paper" }} Job */

/** Of the sample's sides, 240×160: 0.15, 0.6 and 1.9 megapixels. */
const ENLARGED = [2, 4, 7];

/** @param {import("depthstitch").ImageOutput} image @param {number} times */
function enlarged({ data, width, height }, times) {
  const [w, h] = [width * times, height * times];
  const out = new Uint8ClampedArray(4 * w * h);
  for (let y = 0; y < h; y++) {
    // Bilinearly: blocks of equal pixels have corners that no photo has.
    const v = Math.min(Math.max((y + 0.5) / times - 0.5, 0), height - 1);
    const y0 = Math.floor(v);
    const y1 = Math.min(y0 + 1, height - 1);
    for (let x = 0; x < w; x++) {
      const u = Math.min(Math.max((x + 0.5) / times - 0.5, 0), width - 1);
      const x0 = Math.floor(u);
      const x1 = Math.min(x0 + 1, width - 1);
      for (let c = 0; c < 4; c++) {
        const at = (/** @type {number} */ i, /** @type {number} */ j) =>
          data[4 * (j * width + i) + c] ?? 0;
        const above = at(x0, y0) + (u - x0) * (at(x1, y0) - at(x0, y0));
        const below = at(x0, y1) + (u - x0) * (at(x1, y1) - at(x0, y1));
        out[4 * (y * w + x) + c] = above + (v - y0) * (below - above);
      }
    }
  }
  return { data: out, width: w, height: h };
}

/** @param {Job} job @returns {Promise<{ predicted: number, measured: number }>} */
async function measure({ times, mode }) {
  const { target, reference, inputs } = await sample();
  const photos = /** @type {const} */ ([enlarged(target, times), enlarged(reference, times)]);
  const { targetDepth, referenceDepth } = inputs;
  const matches = inputs.matches.map((value) => (value + 0.5) * times - 0.5);
  const options = {
    photos: {},
    depth: { targetDepth, referenceDepth },
    paper: { mode: /** @type {const} */ ("paper"), matches, targetDepth, referenceDepth },
  }[mode];
  await stitch(...photos, { ...options, worker: false });
  const measured = core.call((raw) => raw.peakMemory());
  // What is predicted is in the refusal; once the canvas is known there may be another one.
  let predicted = 0;
  for (let maxBytes = 1; maxBytes !== predicted;) {
    maxBytes = Math.max(1, predicted);
    try {
      await stitch(...photos, { ...options, maxBytes, worker: false });
    } catch (error) {
      const { code, details } = /** @type {import("depthstitch").StitchError} */ (error);
      assert.equal(code, "too-large");
      predicted = details.bytes ?? NaN;
    }
  }
  return { predicted, measured };
}

/** On a thread of its own: its core's memory has never been larger. @param {Job} job */
function inThread(job) {
  return new Promise((resolve, reject) => {
    const worker = new Worker(new URL(import.meta.url), { workerData: job });
    worker.once("message", resolve);
    worker.once("error", reject);
  });
}

if (isMainThread) {
  for (const mode of /** @type {const} */ (["photos", "depth", "paper"])) {
    for (const times of ENLARGED) {
      test(`${mode}, ${240 * times}×${160 * times}`, async (t) => {
        const { predicted, measured } = await inThread({ times, mode });
        const [a, b] = [predicted, measured].map((bytes) => (bytes / 2 ** 20).toFixed(1));
        t.diagnostic(`predicted ${a} MiB, measured ${b} MiB`);
        const apart = predicted / measured - 1;
        // Photos alone are predicted to get depth; this scene's parallax ends in a homography, which needs less.
        const most = mode === "photos" ? 0.3 : 0.2;
        assert.ok(apart >= -0.2 && apart <= most, `${a} MiB predicted, ${b} MiB taken`);
      });
    }
  }

  test("photos that were given away are freed while the worker works", async () => {
    const { target, reference, inputs } = await sample();
    const photos = /** @type {const} */ ([enlarged(target, 7), enlarged(reference, 7)]);
    const bytes = photos[0].data.byteLength + photos[1].data.byteLength;
    const { matches } = inputs;
    // Buffers of all threads are counted.
    const before = process.memoryUsage().arrayBuffers;
    let least = before;
    const onProgress = () => {
      least = Math.min(least, process.memoryUsage().arrayBuffers);
    };
    await stitch(...photos, { matches, transfer: true, workers: 1, onProgress });
    assert.ok(before - least > 0.9 * bytes, `${before - least} of ${bytes} bytes are freed`);
  });

  test("a refused job takes no memory", async () => {
    const { target, reference, inputs } = await sample();
    const photos = /** @type {const} */ ([enlarged(target, 7), enlarged(reference, 7)]);
    await stitch(target, reference, { ...inputs, worker: false });
    const before = core.call((raw) => raw.peakMemory());
    const error = await rejection(stitch(...photos, { maxBytes: 27 * 2 ** 20, worker: false }));
    assert.equal(error.code, "too-large");
    assert.equal(
      core.call((raw) => raw.peakMemory()),
      before,
    );
  });
} else {
  parentPort?.postMessage(await measure(workerData));
}
