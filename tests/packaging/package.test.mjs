// The package as its users get it: packed, installed into an empty project, and used from there; and the examples.
import assert from "node:assert/strict";
import {
  cpSync,
  existsSync,
  mkdtempSync,
  readdirSync,
  readFileSync,
  rmSync,
  writeFileSync,
} from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { before, test } from "node:test";
import { checkPackage, createPackageFromTarballData } from "@arethetypeswrong/core";
import { publint } from "publint";
import { build, createServer, preview } from "vite";
import webpack from "webpack";
import { launch } from "../../js/tools/chromium.mjs";
import { npmBin, root } from "../../js/tools/shared.mjs";
import { assertNoNetworks, consumerIn, inChromium, runIn, served } from "./consumer.mjs";

const folder = join(root, "target", "packaging");
const consumer = join(folder, "consumer");
const web = join(consumer, "web");

/** Runs a program in the consumer's folder; its output. */
const run = (command = "", args = [""], cwd = consumer) => runIn(cwd, command, args);

/** The packed package. */
let packed = "";

/** What the Node program of the consumer computes from the sample. */
let expected = "";

before(() => {
  packed = consumerIn(folder).packed;
  expected = run(process.execPath, ["node.mjs"]).trim();
});

test("the package contains what is needed and nothing else", () => {
  const files = run("npm", ["ls", "--all", "--parseable"]).trim().split("\n");
  assert.equal(files.length, 2, "the package has no dependencies");
  const installed = join(consumer, "node_modules", "depthstitch");
  for (const file of [
    "index.js",
    "codecs.js",
    "depth/index.js",
    "inpaint/index.js",
    "cases/index.js",
    "options.js",
    "worker/browser.js",
    "worker/node.js",
    "cli/main.js",
  ]) {
    assert.ok(existsSync(join(installed, "dist", file)), file);
  }
  for (const file of ["src", "js", "tests", "dist/eval", "dist/bench"]) {
    assert.ok(!existsSync(join(installed, file)), file);
  }
});

test("it works in Node", () => {
  assert.match(expected, /^[0-9a-f]{64}$/);
});

test("the wasm files can be named", () => {
  const program = `
    import { readFileSync } from "node:fs";
    import { fileURLToPath } from "node:url";
    for (const name of ["depthstitch", "many", "codecs"]) {
      const url = import.meta.resolve("depthstitch/" + name + ".wasm");
      console.log(WebAssembly.validate(readFileSync(fileURLToPath(url))));
    }`;
  assert.equal(run(process.execPath, ["--input-type=module", "-e", program]), "true\ntrue\ntrue\n");
});

test("without the peer packages of networks, the error names the package", (t) => {
  // Outside the repository, whose packages Node would find.
  const alone = mkdtempSync(join(tmpdir(), "depthstitch-alone-"));
  t.after(() => rmSync(alone, { recursive: true }));
  for (const file of ["node_modules", "package.json"]) {
    cpSync(join(consumer, file), join(alone, file), { recursive: true });
  }
  const program = `
    import { loadDepthModel, loadOnnxDepth } from "depthstitch/depth";
    import { loadInpainter } from "depthstitch/inpaint";
    // Nobody is there: fetching it first would be another error.
    const weights = "http://127.0.0.1:1/network.onnx";
    for (const load of [loadDepthModel, loadOnnxDepth, loadInpainter]) {
      const options = load === loadDepthModel ? {} : { weights };
      const { code, message } = await load(options).catch((error) => error);
      console.log(code, /npm install [^ :]+/.exec(message)?.[0]);
    }`;
  const [transformers, onnx] = ["@huggingface/transformers", "onnxruntime-web"].map(
    (name) => `model-load-failed npm install ${name}\n`,
  );
  const output = run(process.execPath, ["--input-type=module", "-e", program], alone);
  assert.equal(output, `${transformers}${onnx}${onnx}`);
});

test("the command line starts", () => {
  assert.match(run("npm", ["exec", "--no", "--", "depthstitch", "--help"]), /depthstitch/);
});

const projects = {
  "a bundler's project": {
    module: "ESNext",
    moduleResolution: "bundler",
    lib: ["ES2022", "DOM"],
    types: [],
  },
  "a bundler's project of 2020": {
    module: "ESNext",
    moduleResolution: "bundler",
    lib: ["ES2020", "DOM"],
    target: "ES2020",
    types: [],
  },
  "a Node project": { module: "NodeNext", lib: ["ES2022"], types: ["node"] },
};

for (const version of ["typescript-7", "typescript", "typescript-5.6"]) {
  for (const [name, options] of Object.entries(projects)) {
    test(`its types are sound in ${name}, by ${version}`, () => {
      const compilerOptions = {
        target: "ES2022",
        ...options,
        strict: true,
        noUncheckedIndexedAccess: true,
        exactOptionalPropertyTypes: true,
        skipLibCheck: false,
        noEmit: true,
        typeRoots: [join(root, "node_modules", "@types")],
      };
      // A CommonJS module can import the package's types, and the package when it runs.
      const files = name === "a Node project" ? ["types.ts", "common.cts"] : ["types.ts"];
      const config = join(consumer, "tsconfig.json");
      writeFileSync(config, JSON.stringify({ compilerOptions, files }));
      run(process.execPath, [npmBin(version, "tsc"), "-p", config]);
    });
  }
}

test("publint and Are the types wrong? find nothing", async () => {
  const data = readFileSync(packed);
  const tarball = data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
  const { messages } = await publint({ pack: { tarball }, strict: true });
  assert.deepEqual(messages, []);
  const found = await checkPackage(createPackageFromTarballData(new Uint8Array(tarball)));
  assert.ok(found.types);
  // The package is for module-aware resolution only.
  const problems = found.problems.filter(
    (problem) => !("resolutionKind" in problem && /node10|node16-cjs/.test(problem.resolutionKind)),
  );
  assert.deepEqual(problems, []);
});

/** Fails if a script in a folder contains code of networks. @param {string} folder */
function assertNoNetworksIn(folder) {
  const scripts = readdirSync(folder).filter((name) => name.endsWith(".js"));
  for (const file of scripts) assertNoNetworks(join(folder, file));
}

test("a Vite build stitches in a Web Worker, to the bytes of Node", async () => {
  const config = {
    root: web,
    configFile: /** @type {const} */ (false),
    logLevel: /** @type {const} */ ("warn"),
  };
  await build({ ...config, build: { target: "es2022" } });
  assertNoNetworksIn(join(web, "dist", "assets"));
  const server = await preview({ ...config, preview: { port: 0 } });
  try {
    const result = await inChromium(server.resolvedUrls?.local[0]);
    assert.deepEqual(result, { digest: expected, workers: 1 });
  } finally {
    await server.close();
  }
});

test("so does a webpack build", async () => {
  const out = join(web, "webpack");
  /** @type {import("webpack").Stats | undefined} */
  const stats = await new Promise((resolve, reject) =>
    webpack(
      {
        mode: "production",
        context: web,
        entry: "./main.mjs",
        output: { path: out },
        performance: false,
      },
      (error, done) => (error ? reject(error) : resolve(done)),
    ),
  );
  assert.ok(stats && !stats.hasErrors() && !stats.hasWarnings(), stats?.toString());
  assertNoNetworksIn(out);
  cpSync(join(web, "public"), out, { recursive: true });
  const page = '<!doctype html><title>consumer</title><script src="main.js"></script>';
  writeFileSync(join(out, "index.html"), page);
  await served(out, async (url) => {
    assert.deepEqual(await inChromium(url), { digest: expected, workers: 1 });
  });
});

test("so does Vite's development server", async () => {
  const server = await createServer({
    root: web,
    configFile: false,
    logLevel: "warn",
    server: { port: 0, fs: { allow: [consumer] } },
  });
  try {
    await server.listen();
    const result = await inChromium(server.resolvedUrls?.local[0]);
    assert.deepEqual(result, { digest: expected, workers: 1 });
  } finally {
    await server.close();
  }
});

/** A copy of an example with the installed package and two photos beside it or in `photos`. @param {string} name */
function example(name, photos = "") {
  const copy = join(folder, `example-${name}`);
  cpSync(join(root, "examples", name), copy, { recursive: true });
  cpSync(join(consumer, "node_modules"), join(copy, "node_modules"), { recursive: true });
  for (const [from, to] of [
    ["target.jpg", "left.jpg"],
    ["reference.jpg", "right.jpg"],
  ]) {
    cpSync(join(web, "public", from ?? ""), join(copy, photos, to ?? ""));
  }
  return copy;
}

test("the example for Node writes a mosaic", async () => {
  const copy = example("node");
  const output = run(process.execPath, ["stitch.mjs", "left.jpg", "right.jpg", "out.png"], copy);
  assert.match(output, /^PSNR \d+\.\d dB over \d+ % of the reference$/m);
  const { decodeImage } = await import("depthstitch/codecs");
  const { data, width, height } = await decodeImage(readFileSync(join(copy, "out.png")));
  assert.ok(width > 100 && height > 80, `${width}×${height}`);
  assert.ok(
    data.every((value, i) => i % 4 < 3 || value === 255),
    "cropped to opaque pixels",
  );
});

/** Fails unless the page at `url` shows a mosaic. @param {string | undefined} url */
async function showsMosaic(url) {
  assert.ok(url);
  const browser = await launch();
  try {
    const page = await browser.newPage();
    await page.goto(url);
    await page.locator("#status", { hasText: /^(Done|Failed)/ }).waitFor({ timeout: 120_000 });
    assert.match((await page.locator("#status").textContent()) ?? "", /^Done: \d+ inliers/);
    const { width, opaque } = await page.evaluate(() => {
      const canvas = document.querySelector("canvas");
      const context = canvas?.getContext("2d");
      if (!canvas || !context) throw new Error("no canvas");
      const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
      return { width: canvas.width, opaque: data.filter((v, i) => i % 4 === 3 && v > 0).length };
    });
    assert.ok(width > 240 && opaque > 240 * 160, `${opaque} pixels on a canvas ${width} wide`);
  } finally {
    await browser.close();
  }
}

test("the example for Vite shows a mosaic, built and by the development server", async () => {
  const copy = example("vite", "public");
  const config = {
    root: copy,
    logLevel: /** @type {const} */ ("warn"),
  };
  await build({ ...config, build: { target: "es2022" } });
  const built = await preview({ ...config, preview: { port: 0 } });
  try {
    await showsMosaic(built.resolvedUrls?.local[0]);
  } finally {
    await built.close();
  }
  const server = await createServer({ ...config, server: { port: 0, fs: { allow: [copy] } } });
  try {
    await server.listen();
    await showsMosaic(server.resolvedUrls?.local[0]);
  } finally {
    await server.close();
  }
});

test("the example without a build step shows a mosaic, also with the package on another origin", async () => {
  const copy = example("html");
  await served(copy, async (page) => {
    await showsMosaic(page);
    // Another port is another origin.
    await served(consumer, async (cdn) => {
      const html = readFileSync(join(copy, "index.html"), "utf8");
      assert.ok(html.includes("./node_modules/"));
      const address = new URL("node_modules/", cdn).href;
      writeFileSync(join(copy, "index.html"), html.replace("./node_modules/", address));
      await showsMosaic(page);
    });
  });
});
