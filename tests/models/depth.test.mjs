// Depth networks in Node: the library's folder format, and single ONNX files.
import assert from "node:assert/strict";
import { existsSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { stitch, StitchError } from "depthstitch";
import { estimateDepth, loadDepthModel, loadOnnxDepth } from "depthstitch/depth";
import { dataFolder } from "../../js/tools/shared.mjs";
import { rejection } from "../node/sample.mjs";
import { BIAS, depthOf, folder, writeDepthModel } from "./networks.mjs";
import { paint, rankCorrelation, sample, withDepth } from "./pictures.mjs";
import { weights } from "./weights.mjs";

const ID = "tests/depth-anything-like";
const LEFT = [200, 40, 90];
const RIGHT = [10, 120, 250];
const photo = paint(320, 200, (x) => (x < 160 ? LEFT : RIGHT));

/** @type {string[]} */
const requests = [];
const server = createServer((request, response) => {
  const path = decodeURIComponent(request.url ?? "");
  requests.push(path);
  const file = join(folder, path.replace(/^\/hub\/(.*)\/at\/main\//, "$1/"));
  if (path.startsWith("/slow/")) return; // Never answers.
  if (!path.startsWith("/hub/") || !existsSync(file)) return void response.writeHead(404).end();
  const body = readFileSync(file);
  response.writeHead(200, { "Content-Length": body.length }).end(body);
});
let host = "";
let cacheDir = "";
before(async () => {
  cacheDir = mkdtempSync(join(tmpdir(), "depthstitch-models-"));
  writeDepthModel(ID);
  await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
  const address = server.address();
  host = `http://127.0.0.1:${typeof address === "object" ? address?.port : ""}`;
});
after(() => {
  server.closeAllConnections();
  server.close();
  rmSync(cacheDir, { recursive: true });
});

/** The options for the local server. */
const remote = () => ({
  model: { id: ID },
  host: `${host}/hub/`,
  path: "{model}/at/{revision}/",
  cacheDir,
});

/**
 * Fails unless this is what the network with this bias makes of the photo.
 *
 * @param {import("depthstitch/depth").EstimatedDepth} depth
 * @param {number} bias
 */
function assertDepth({ data, width, height, kind }, bias) {
  // 56 rows, and as many columns as keep the photo's shape, both multiples of 14.
  assert.deepEqual([width, height, kind], [84, 56, "inverse"]);
  for (let y = 0; y < height; y++) {
    for (const [x, rgb] of /** @type {[number, number[]][]} */ ([
      [5, LEFT],
      [78, RIGHT],
    ])) {
      const [actual, expected] = [data[y * width + x] ?? NaN, depthOf(rgb, bias)];
      assert.ok(Math.abs(actual - expected) < 1e-3, `${actual} instead of ${expected}`);
    }
  }
}

test("a model from a folder", async () => {
  const estimator = await loadDepthModel({ model: { id: ID }, local: folder });
  assert.equal(estimator.device, "cpu");
  assertDepth(await estimator.estimate(photo), BIAS.model);
  await estimator.dispose();
});

test("a model from a host, with progress, by type of weights", async () => {
  /** @type {import("depthstitch/depth").ModelProgress[]} */
  const heard = [];
  const onProgress = (/** @type {typeof heard[number]} */ progress) => void heard.push(progress);
  assertDepth(await estimateDepth(photo, { ...remote(), onProgress }), BIAS.model);
  assert.deepEqual([...new Set(heard.map(({ stage }) => stage))], ["download", "prepare", "run"]);
  const { loaded = 0, total } = heard.filter(({ stage }) => stage === "download").at(-1) ?? {};
  assert.ok(loaded > 100 && loaded === total);
  assert.ok(
    requests.every((path) => path.startsWith(`/hub/${ID}/at/main/`)),
    requests.join(" "),
  );
  assertDepth(await estimateDepth(photo, { ...remote(), dtype: "fp16" }), BIAS.model_fp16);
  assertDepth(await estimateDepth(photo, { ...remote(), dtype: "q8" }), BIAS.model_quantized);
});

test("what onProgress throws is what the call rejects with", async () => {
  const mine = new Error("mine");
  const onProgress = () => {
    throw mine;
  };
  const anew = { ...remote(), cacheDir: join(cacheDir, "thrown") };
  await assert.rejects(loadDepthModel({ ...anew, onProgress }), mine);
  assertDepth(await estimateDepth(photo, anew), BIAS.model);
});

test("what has been downloaded is kept", async () => {
  await estimateDepth(photo, remote());
  requests.length = 0;
  assertDepth(await estimateDepth(photo, remote()), BIAS.model);
  assert.deepEqual(requests, []);
});

test("what it was set to before is what the library is set to afterwards", async () => {
  // Not by a literal: its types do not compile under this package's settings.
  const library = "@huggingface/transformers";
  const { env } = await import(library);
  const before = { ...env };
  await estimateDepth(photo, remote());
  await rejection(estimateDepth(photo, { ...remote(), model: { id: "tests/none" } }));
  assert.deepEqual({ ...env }, before);
});

test("Depth Anything is requested at a fixed commit", async () => {
  requests.length = 0;
  const error = await rejection(loadDepthModel({ ...remote(), model: "small" }));
  assert.equal(error.code, "model-load-failed");
  const path = /^\/hub\/onnx-community\/depth-anything-v2-small\/at\/[0-9a-f]{40}\//;
  assert.match(requests[0] ?? "", path);
});

test("nothing is loaded from a moving branch of the public hub by accident", async () => {
  const error = await rejection(loadDepthModel({ model: { id: ID } }));
  assert.equal(error.code, "invalid-argument");
  assert.match(error.message, /model\.revision must be given/);
});

test("a model that is not there: the address is named", async () => {
  const error = await rejection(loadDepthModel({ ...remote(), model: { id: "tests/none" } }));
  assert.deepEqual([error.code, error.stage], ["model-load-failed", "model"]);
  assert.ok(error.message.includes(`${host}/hub/tests/none/at/main/`), error.message);
  const dead = await rejection(
    loadDepthModel({ ...remote(), model: { id: "tests/none" }, host: "http://127.0.0.1:1/" }),
  );
  assert.equal(dead.code, "model-load-failed");
  assert.match(dead.message, /127\.0\.0\.1:1/);
});

test("aborting ends a download that does not come", async () => {
  const controller = new AbortController();
  const model = { id: "tests/none" };
  const options = { ...remote(), model, host: `${host}/slow/`, signal: controller.signal };
  const loading = rejection(loadDepthModel(options));
  setTimeout(() => controller.abort(), 100);
  assert.equal((await loading).name, "AbortError");
  assertDepth(await estimateDepth(photo, remote()), BIAS.model);
});

test("aborting before and between", async () => {
  const signal = AbortSignal.abort();
  assert.equal((await rejection(loadDepthModel({ ...remote(), signal }))).code, "aborted");
  const estimator = await loadDepthModel(remote());
  assert.equal((await rejection(estimator.estimate(photo, { signal }))).code, "aborted");
  assertDepth(await estimator.estimate(photo), BIAS.model);
  await estimator.dispose();
});

/** Options that throw when they are read. */
const unreadable = {
  get device() {
    throw new Error("mine");
  },
};

test("wrong arguments", async () => {
  const wrong = /** @type {[any, RegExp][]} */ ([
    [{ model: "huge" }, /model must be "small"/],
    [{ device: "gpu" }, /device/],
    [{ modell: "small" }, /modell/],
    [{ threads: 0 }, /threads/],
    [{ signal: {} }, /signal/],
    [null, /options must be an object, got null/],
    ["small", /options must be an object, got "small"/],
    [{ model: { id: ID, revision: "main", output: "depth" } }, /model\.output/],
    [{ device: Object.create(null) }, /device must be "auto" or .*, got Object/],
    [{ dtype: 8 }, /dtype must be a string, got 8/],
    [{ cacheDir: new URL("file:///cache") }, /cacheDir must be a string, got URL/],
    [{ host: 8080 }, /host must be a string or a URL, got 8080/],
    [{ cache: "false" }, /cache must be true or false, got "false"/],
    [{ model: { id: ID, revision: 4472 } }, /model\.revision must be a string, got 4472/],
    [{ wasmPaths: new URL("file:///ort/") }, /wasmPaths must be a string or .*, got URL/],
    [{ wasmPaths: { wasm: 1 } }, /wasmPaths\.wasm must be a string or a URL, got 1/],
    [unreadable, /an argument cannot be read: mine/],
  ]);
  for (const [options, message] of wrong) {
    const error = await rejection(loadDepthModel(options));
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, message);
  }
  const estimator = await loadDepthModel(remote());
  const short = { ...photo, data: photo.data.subarray(4) };
  assert.equal((await rejection(estimator.estimate(short))).code, "size-mismatch");
  const none = /** @type {any} */ (null);
  for (const [estimating, message] of /** @type {[Promise<unknown>, RegExp][]} */ ([
    [estimator.estimate(none), /image must be an object, got null/],
    [estimator.estimate(photo, none), /options must be an object, got null/],
    [estimateDepth(photo, none), /options must be an object, got null/],
  ])) {
    const error = await rejection(estimating);
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, message);
  }
  await estimator.dispose();
  // Before anything is downloaded.
  requests.length = 0;
  assert.equal((await rejection(estimateDepth(short, remote()))).code, "size-mismatch");
  const weights = `${host}/hub/none.onnx`;
  const wrongOnnx = /** @type {[any, RegExp, object?][]} */ ([
    [undefined, /options must be an object, got undefined/],
    [unreadable, /an argument cannot be read: mine/],
    [{ weights, inputSize: { width: 20, height: 0.5 } }, /inputSize\.height/, { value: 0.5 }],
    [{ weights, inputSize: 384 }, /inputSize must be an object, got 384/, { value: 384 }],
    [{ weights, mean: 0.5 }, /mean must be three numbers, got 0.5/, { value: 0.5 }],
    [{ weights, mean: [0, 0] }, /mean must be three numbers, got 2/, { expected: 3, actual: 2 }],
    [{ weights, mean: [0, 0, "0"] }, /mean\[2\] must be a number, got "0"/],
    [{ weights, mean: [0, NaN, 0] }, /mean\[1\] must be finite, got NaN/, { value: NaN }],
    [{ weights, cache: 0 }, /cache must be true or false, got 0/, { value: 0 }],
    [{ weights, std: [0, 1, 1] }, /std\[0\] must be finite and above 0, got 0/, { value: 0 }],
    [{ weights, std: [1, 1, Infinity] }, /std\[2\] must be finite/, { value: Infinity }],
  ]);
  for (const [options, message, details = {}] of wrongOnnx) {
    const error = await rejection(loadOnnxDepth(options));
    assert.equal(error.code, "invalid-argument");
    assert.match(error.message, message);
    assert.deepEqual(error.details, details);
  }
  assert.deepEqual(requests, []);
});

test("a single file: resized, normalised, inverted", async () => {
  const file = pathToFileURL(join(folder, ID, "onnx", "model.onnx"));
  const inputSize = { width: 20, height: 10 };
  const common = /** @type {const} */ ({ weights: file, inputSize, std: [0.229, 0.224, 0.225] });
  const estimator = await loadOnnxDepth({ ...common, mean: [0.485, 0.456, 0.406] });
  const { data, width, height } = await estimator.estimate(photo);
  assert.deepEqual([width, height, data.length], [20, 10, 200]);
  const metric = await loadOnnxDepth({ ...common, mean: [0.485, 0.456, 0.406], output: "metric" });
  const inverted = await metric.estimate(photo);
  assert.equal(inverted.kind, "inverse");
  for (const [x, rgb] of /** @type {[number, number[]][]} */ ([
    [3, LEFT],
    [16, RIGHT],
  ])) {
    assert.ok(Math.abs((data[x] ?? NaN) - depthOf(rgb, BIAS.model)) < 1e-4);
    assert.ok(Math.abs((inverted.data[x] ?? NaN) - 1 / depthOf(rgb, BIAS.model)) < 1e-4);
  }
  await estimator.dispose();
  await metric.dispose();
});

test("a single file that is none", async () => {
  const bytes = new TextEncoder().encode("not a network at all");
  const damaged = await rejection(loadOnnxDepth({ weights: bytes }));
  assert.equal(damaged.code, "model-load-failed");
  assert.match(damaged.message, /20 bytes/);
  const missing = await rejection(loadOnnxDepth({ weights: `${host}/hub/none.onnx` }));
  assert.equal(missing.details.status, 404);
  assert.ok(missing.message.includes(`${host}/hub/none.onnx`));
  const sizeless = pathToFileURL(join(folder, ID, "onnx", "model.onnx"));
  const unsaid = await rejection(loadOnnxDepth({ weights: sizeless }));
  assert.equal(unsaid.code, "invalid-argument");
  assert.match(unsaid.message, /inputSize/);
});

test("FastDepth sees what is near", async (t) => {
  const { path, missing } = weights("fastdepth");
  if (missing) return t.skip(missing);
  const estimator = await loadOnnxDepth({ weights: readFileSync(path), output: "metric" });
  for (const view of /** @type {const} */ (["target", "reference"])) {
    const scene = await withDepth(sample, view);
    const depth = await estimator.estimate(scene.photo);
    assert.deepEqual([depth.width, depth.height], [224, 224]);
    const correlation = rankCorrelation(depth, scene);
    t.diagnostic(`${view}: rank correlation ${correlation.toFixed(3)}`);
    // It knows rooms, and this is a terrace.
    assert.ok(correlation > 0.3, `${view}: ${correlation}`);
  }
  await estimator.dispose();
});

test("FastDepth in a room, as a sensor measured it", async (t) => {
  const { path, missing } = weights("fastdepth");
  if (missing) return t.skip(missing);
  const room = join(dataFolder, "kinect-0002_0003");
  if (!existsSync(room)) return t.skip("SKIPPED: DEPTHSTITCH_DATA has no kinect-0002_0003");
  const estimator = await loadOnnxDepth({ weights: readFileSync(path), output: "metric" });
  for (const view of /** @type {const} */ (["target", "reference"])) {
    const scene = await withDepth(room, view);
    const correlation = rankCorrelation(await estimator.estimate(scene.photo), scene);
    t.diagnostic(`${view}: rank correlation ${correlation.toFixed(3)}`);
    assert.ok(correlation > 0.85, `${view}: ${correlation}`);
  }
  await estimator.dispose();
});

test("what comes out fits stitch", async (t) => {
  const { path, missing } = weights("fastdepth");
  if (missing) return t.skip(missing);
  const estimator = await loadOnnxDepth({ weights: readFileSync(path), output: "metric" });
  const [target, reference] = [
    await withDepth(sample, "target"),
    await withDepth(sample, "reference"),
  ];
  const rows = readFileSync(join(sample, "matches.csv"), "utf8").trim().split("\n").slice(1);
  const { report } = await stitch(target.photo, reference.photo, {
    matches: Float32Array.from(rows.flatMap((row) => row.split(",").map(Number))),
    targetDepth: await estimator.estimate(target.photo),
    referenceDepth: await estimator.estimate(reference.photo),
  });
  assert.ok(!report.warnings.some(({ code }) => code.includes("depth")), "the depth is used");
  await estimator.dispose();
});

test("errors are those of the main entry", async () => {
  const { StitchError: same } = await import("depthstitch/depth");
  assert.equal(same, StitchError);
});
