// A network that nobody will hold is released.
import assert from "node:assert/strict";
import { test } from "node:test";
import { modelError } from "../../dist/models/errors.js";
import { loaded } from "../../dist/models/loaded.js";
import { rejection } from "../node/sample.mjs";

/** Loads the network "n", and says what becomes of it. @param {Promise<string>} loading */
function load(
  loading,
  /** @type {import("depthstitch/depth").ModelCallOptions} */ { onProgress, signal } = {},
) {
  /** @type {string[]} */
  const released = [];
  const release = async (/** @type {string} */ network) => void released.push(network);
  const failure = (/** @type {unknown} */ cause) => modelError("not loaded", cause);
  return { released, network: loaded(loading, { onProgress, signal }, release, failure) };
}

test("one that is handed over is kept, and said to be there", async () => {
  /** @type {unknown[]} */
  const heard = [];
  const onProgress = (/** @type {unknown} */ progress) => void heard.push(progress);
  const { released, network } = load(Promise.resolve("n"), { onProgress });
  assert.equal(await network, "n");
  assert.deepEqual([released, heard], [[], [{ stage: "prepare", fraction: 1 }]]);
});

test("one is released when onProgress throws", async () => {
  const mine = new Error("mine");
  const onProgress = () => {
    throw mine;
  };
  const { released, network } = load(Promise.resolve("n"), { onProgress });
  await assert.rejects(network, mine);
  assert.deepEqual(released, ["n"]);
});

test("one that comes after its call was aborted is released", async () => {
  const controller = new AbortController();
  let come = (/** @type {string} */ _) => {};
  const loading = new Promise((resolve) => (come = resolve));
  const { released, network } = load(loading, { signal: controller.signal });
  controller.abort();
  assert.equal((await rejection(network)).code, "aborted");
  assert.deepEqual(released, []);
  come("n");
  await loading;
  assert.deepEqual(released, ["n"]);
});

test("one that does not come is an error with its cause", async () => {
  const cause = new Error("no such file");
  const error = await rejection(load(Promise.reject(cause)).network);
  assert.deepEqual([error.code, error.cause], ["model-load-failed", cause]);
});
