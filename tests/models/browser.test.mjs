// The networks in a real browser: a page built by Vite, under a strict content security policy, served with the models.
import assert from "node:assert/strict";
import {
  createReadStream,
  existsSync,
  mkdtempSync,
  readdirSync,
  rmSync,
  statSync,
  writeFileSync,
} from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { build, preview } from "vite";
import { launch } from "../../js/tools/chromium.mjs";
import { root } from "../../js/tools/shared.mjs";
import { BIAS, depthOf, folder, lamaLike, writeDepthModel } from "./networks.mjs";
import { rankCorrelation, sample, withDepth } from "./pictures.mjs";
import { weights } from "./weights.mjs";

const ID = "tests/depth-anything-like";
const LEFT = [200, 40, 90];
const RIGHT = [10, 120, 250];
const web = fileURLToPath(new URL("./web/", import.meta.url));
const policy =
  "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'";

/** @typedef {import("playwright-core").Page} Page */
/** @type {string[]} */
const requests = [];
const outDir = mkdtempSync(join(tmpdir(), "depthstitch-models-web-"));
/** @type {import("playwright-core").Browser} */
let browser;
/** @type {import("vite").PreviewServer} */
let server;
let url = "";

/** @type {Record<string, { folder: string, type: string }>} */
const places = {
  models: { folder, type: "application/octet-stream" },
  sample: { folder: sample, type: "image/jpeg" },
  ort: { folder: join(root, "node_modules", "onnxruntime-web", "dist"), type: "application/wasm" },
};

/** Serves these places and notes what is asked for. @type {import("vite").Plugin} */
const models = {
  name: "models",
  configurePreviewServer({ middlewares }) {
    middlewares.use((request, response, next) => {
      const path = decodeURIComponent(request.url ?? "");
      requests.push(path);
      if (path.startsWith("/models/slow/")) return; // Never answers.
      const [, from = "", rest = ""] = /^\/(\w+)\/([^?]*)/.exec(path) ?? [];
      const place = places[from];
      if (!place) return next();
      const file = join(place.folder, rest);
      if (!existsSync(file)) return void response.writeHead(404).end();
      response.setHeader("Content-Type", file.endsWith(".mjs") ? "text/javascript" : place.type);
      response.writeHead(200, { "Content-Length": statSync(file).size });
      createReadStream(file).pipe(response);
    });
  },
};

before(async () => {
  writeDepthModel(ID);
  writeFileSync(join(folder, "lama-like.onnx"), lamaLike(512));
  /** @type {import("vite").InlineConfig} */
  const config = {
    root: web,
    configFile: false,
    logLevel: "error",
    plugins: [models],
    worker: { format: "es" },
    build: {
      outDir,
      emptyOutDir: true,
      target: "es2022",
      assetsInlineLimit: 0,
      chunkSizeWarningLimit: 9999,
    },
  };
  await build(config);
  const headers = { "Content-Security-Policy": policy };
  server = await preview({ ...config, preview: { host: "127.0.0.1", port: 0, headers } });
  url = server.resolvedUrls?.local[0] ?? "";
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server?.close();
  rmSync(outDir, { recursive: true });
});

/** A fresh page; `complaints` has what must not happen on it. */
async function open(within = browser) {
  const context = await within.newContext();
  const page = await context.newPage();
  /** @type {string[]} */
  const complaints = [];
  page.on("console", (message) => {
    if (message.type() === "error") complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(String(error)));
  context.on("request", (request) => {
    if (!request.url().startsWith(url)) complaints.push(`request to ${request.url()}`);
  });
  await page.goto(url);
  await page.waitForFunction(() => document.title === "ready");
  requests.length = 0;
  return { page, complaints, close: () => context.close() };
}

/**
 * Makes a call of web/calls.mjs in the page.
 *
 * @param {Page} page
 * @param {string} how `run` on its thread, `runInWorker` in a worker
 * @param {string} name
 * @param {object} args
 * @returns {Promise<any>}
 */
function call(page, how, name, args) {
  const request = { how, name, args };
  return page.evaluate(
    ({ how, name, args }) => /** @type {any} */ (globalThis)[how](name, args),
    request,
  );
}

/** The options for the page's own server. */
const local = { model: { id: ID }, host: "/models/", path: "{model}/" };

/** @param {{ data: number[], width: number, height: number }} depth @param {number} bias */
function assertDepth({ data, width, height }, bias) {
  assert.deepEqual([width, height], [84, 56]);
  for (const [x, rgb] of /** @type {[number, number[]][]} */ ([
    [5, LEFT],
    [78, RIGHT],
  ])) {
    const [actual, expected] = [data[28 * width + x] ?? NaN, depthOf(rgb, bias)];
    assert.ok(Math.abs(actual - expected) < 1e-3, `${actual} instead of ${expected}`);
  }
}

test("nothing of a network is loaded before one is asked for", async () => {
  const { page, complaints, close } = await open();
  const { error } = await call(page, "run", "main", {});
  assert.equal(error.code, "too-few-matches");
  assert.ok(!requests.some((path) => /onnx|ort-|transformers/.test(path)), requests.join(" "));
  const entry = readdirSync(join(outDir, "assets")).filter((name) => /^index.*\.js$/.test(name));
  const size = entry.reduce((sum, name) => sum + statSync(join(outDir, "assets", name)).size, 0);
  assert.ok(size < 150_000, `${size} bytes of script before the first network`);
  assert.deepEqual(complaints, []);
  await close();
});

for (const how of ["run", "runInWorker"]) {
  test(`a depth model from the page's host (${how}), kept by the browser`, async () => {
    const { page, complaints, close } = await open();
    const args = { left: LEFT, right: RIGHT, options: local };
    const depth = await call(page, how, "depth", args);
    assert.equal(depth.error, undefined, depth.error?.message);
    // Without a GPU: wasm, and the small weights that go with it.
    assertDepth(depth, BIAS.model_quantized);
    assert.deepEqual(depth.stages, ["download", "prepare", "run"]);
    assert.ok(requests.includes(`/models/${ID}/onnx/model_quantized.onnx`));
    requests.length = 0;
    assertDepth(await call(page, how, "depth", args), BIAS.model_quantized);
    assert.ok(!requests.some((path) => path.startsWith("/models/")), requests.join(" "));
    assertDepth(
      await call(page, how, "depth", { ...args, options: { ...local, dtype: "fp32" } }),
      BIAS.model,
    );
    assert.deepEqual(complaints, []);
    await close();
  });
}

test("a depth model as a folder of the page", async () => {
  const { page, complaints, close } = await open();
  const options = { model: { id: ID }, local: "/models/", cache: false };
  const args = { left: LEFT, right: RIGHT, options };
  assertDepth(await call(page, "run", "depth", args), BIAS.model_quantized);
  assert.deepEqual(complaints, []);
  await close();
});

test("a model that is not there, a download that is stopped, a runtime that is elsewhere", async () => {
  const { page, close } = await open();
  const args = { left: LEFT, right: RIGHT, options: { ...local, model: "small" } };
  const { error: none } = await call(page, "run", "depth", args);
  assert.deepEqual([none.code, none.stage], ["model-load-failed", "model"]);
  assert.match(none.message, /\/models\/onnx-community\/depth-anything-v2-small\//);
  const slow = { ...local, host: "/models/slow/" };
  const { error: stopped } = await call(page, "run", "abort", { options: slow });
  assert.deepEqual([stopped?.name, stopped?.code], ["AbortError", "aborted"]);
  assertDepth(
    await call(page, "run", "depth", { left: LEFT, right: RIGHT, options: local }),
    BIAS.model_quantized,
  );
  await close();

  const again = await open();
  const astray = { weights: "/models/lama-like.onnx", model: "lama", wasmPaths: "/nowhere/" };
  const hole = { x: 100, y: 100, size: 20 };
  const { error } = await call(again.page, "run", "inpaint", {
    url: "/sample/reference.jpg",
    options: astray,
    hole,
  });
  assert.equal(error.code, "model-load-failed");
  assert.match(error.message, /wasmPaths/);
  await again.close();
});

test("the runtime from an address of one's own", async () => {
  const { page, complaints, close } = await open();
  const lama = { model: "lama", weights: "/models/lama-like.onnx", wasmPaths: "/ort/" };
  const hole = { x: 100, y: 100, size: 20 };
  const url = "/sample/reference.jpg";
  const filled = await call(page, "runInWorker", "inpaint", { url, options: lama, hole });
  assert.deepEqual([filled.changed, filled.empty], [0, 0], filled.error?.message);
  assert.ok(requests.includes("/ort/ort-wasm-simd-threaded.wasm"), requests.join(" "));
  const options = { ...local, wasmPaths: "/ort/" };
  const args = { left: LEFT, right: RIGHT, options };
  assertDepth(await call(page, "runInWorker", "depth", args), BIAS.model_quantized);
  assert.ok(requests.includes("/ort/ort-wasm-simd-threaded.asyncify.wasm"), requests.join(" "));
  assert.deepEqual(complaints, []);
  await close();
});

test("FastDepth in the browser sees what it sees in Node", async (t) => {
  const { missing } = weights("fastdepth");
  if (missing) return t.skip(missing);
  const { page, complaints, close } = await open();
  const args = {
    url: "/sample/reference.jpg",
    options: { weights: "/models/fastdepth.onnx", output: "metric" },
  };
  const { data, width, height, error } = await call(page, "runInWorker", "onnxDepth", args);
  assert.equal(error, undefined, error?.message);
  const depth = { data: Float32Array.from(data), width, height };
  const correlation = rankCorrelation(depth, await withDepth(sample, "reference"));
  t.diagnostic(`rank correlation ${correlation.toFixed(3)}`);
  assert.ok(correlation > 0.3, `${correlation}`);
  assert.deepEqual(complaints, []);
  await close();
});

test("LaMa's interface, and MI-GAN, in the browser", async (t) => {
  const { page, complaints, close } = await open();
  const hole = { x: 318, y: 380, size: 24 };
  const url = "/sample/reference.jpg";
  const lama = { model: "lama", weights: "/models/lama-like.onnx" };
  const average = await call(page, "run", "inpaint", { url, options: lama, hole });
  assert.deepEqual([average.changed, average.empty], [0, 0], average.error?.message);
  const { missing } = weights("migan");
  if (missing) return t.skip(missing);
  const migan = { weights: "/models/migan.onnx" };
  for (const how of ["runInWorker", "run"]) {
    const filled = await call(page, how, "inpaint", { url, options: migan, hole });
    assert.deepEqual([filled.changed, filled.empty], [0, 0], filled.error?.message);
    t.diagnostic(`MI-GAN ${filled.psnr.toFixed(2)} dB, mean ${average.psnr.toFixed(2)} dB`);
    assert.ok(filled.psnr > average.psnr, "a network that looks is better than a mean");
  }
  const fetched = requests.filter((path) => path === "/models/migan.onnx");
  assert.equal(fetched.length, 1, "the second time the browser had it");
  assert.deepEqual(complaints, []);
  await close();
});

test("on a GPU, where there is one: other weights, the same depth", async (t) => {
  const gpu = await launch({ webgpu: true });
  t.after(() => gpu.close());
  const { page, complaints, close } = await open(gpu);
  const found = await page.evaluate(async () => {
    const { gpu } = /** @type {any} */ (navigator);
    const adapter = await gpu?.requestAdapter();
    return adapter ? { half: adapter.features.has("shader-f16") } : undefined;
  });
  if (!found) return t.skip("SKIPPED: this Chromium has no WebGPU");
  const args = { left: LEFT, right: RIGHT, options: local };
  const depth = await call(page, "run", "depth", args);
  assert.equal(depth.error, undefined, depth.error?.message);
  assertDepth(depth, found.half ? BIAS.model_fp16 : BIAS.model);
  const file = `/models/${ID}/onnx/model.onnx`;
  const options = { weights: file, inputSize: { width: 56, height: 42 } };
  const request = { url: "/sample/reference.jpg", options };
  const onWasm = await call(page, "run", "onnxDepth", request);
  request.options = Object.assign(options, { device: "webgpu" });
  const onGpu = await call(page, "run", "onnxDepth", request);
  assert.equal(onGpu.error, undefined, onGpu.error?.message);
  assert.deepEqual([onGpu.width, onGpu.height, onGpu.data.length], [56, 42, 56 * 42]);
  const apart = onGpu.data.map((/** @type {number} */ value, /** @type {number} */ i) =>
    Math.abs(value - onWasm.data[i]),
  );
  assert.ok(Math.max(...apart) < 1e-3, `${Math.max(...apart)}`);
  assert.deepEqual(complaints, []);
  await close();
});
