// The recipes of docs/bundlers.md, as they stand there, on the packed package.
import assert from "node:assert/strict";
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { availableParallelism } from "node:os";
import { join } from "node:path";
import { before, test } from "node:test";
import { createServer } from "vite";
import { launch } from "../../js/tools/chromium.mjs";
import { npmBin, root } from "../../js/tools/shared.mjs";
import { assertNoNetworks, consumerIn, inChromium, runIn, served } from "./consumer.mjs";

const folder = join(root, "target", "packaging-bundlers");
const recipes = readFileSync(join(root, "docs", "bundlers.md"), "utf8");

/** The first code block of a section. @param {string} section @param {string} language */
function code(section, language, number = 0) {
  const text = recipes.split(/^## /m).find((part) => part.startsWith(`${section}\n`)) ?? "";
  const blocks = [...text.matchAll(/^```(\w+)\n([^]*?)^```$/gm)];
  const block = blocks.filter(([, name]) => name === language)[number]?.[2];
  assert.ok(block, `docs/bundlers.md: ${section} has no ${language}`);
  return block;
}

/** @type {ReturnType<typeof consumerIn>} */
let made;

/** What the Node program computes without a bundler. */
let expected = "";

const forBrowsers = `
import { summary } from "./many.mjs";
const read = async (name) => (await fetch(new URL(name, document.baseURI))).arrayBuffer();
document.title = await summary(read).catch(String);
`;
const forNode = readFileSync(join(root, "tests", "packaging", "consumer", "node-many.mjs"), "utf8");

/** A project with the package, and with a program `main.js`. @param {string} name */
function project(name, main = "", manifest = {}) {
  const copy = join(folder, name);
  mkdirSync(copy, { recursive: true });
  for (const file of ["node_modules", "digest.mjs", "many.mjs"]) {
    cpSync(join(made.consumer, file), join(copy, file), { recursive: true });
  }
  writeFileSync(
    join(copy, "package.json"),
    JSON.stringify({ private: true, type: "module", ...manifest }),
  );
  writeFileSync(join(copy, "main.js"), main);
  return copy;
}

/** @param {string} script */
const pageWith = (script) =>
  `<!doctype html><meta charset="utf-8" /><title>consumer</title><script type="module" src="${script}"></script>`;

/** Checks what a bundle for browsers computes. `dist` has a page, or only scripts. @param {string} dist */
async function checkInBrowser(dist) {
  cpSync(join(made.web, "public"), dist, { recursive: true });
  if (!existsSync(join(dist, "index.html"))) {
    assertNoNetworks(join(dist, "js", "main.js"));
    writeFileSync(join(dist, "index.html"), pageWith("js/main.js"));
  }
  // One for the pair, and those that have the module of many photos: two if there are processors for them.
  const workers = 1 + Math.min(2, availableParallelism());
  await served(dist, async (url) => {
    assert.deepEqual(await inChromium(url), { digest: expected, workers });
  });
}

/** Checks what a bundle for Node computes once it was moved, and the project deleted. @param {string} copy */
function checkInNode(copy) {
  const moved = `${copy}-moved`;
  cpSync(join(copy, "dist"), moved, { recursive: true });
  rmSync(copy, { recursive: true });
  assertNoNetworks(join(moved, "js", "main.js"));
  const photos = join(made.web, "public");
  assert.equal(runIn(moved, process.execPath, ["js/main.js", photos]).trim(), expected);
}

before(() => {
  made = consumerIn(folder);
  const plain = project("plain", forNode);
  const photos = join(made.web, "public");
  expected = runIn(plain, process.execPath, ["main.js", photos]).trim();
  assert.match(expected, /^[0-9a-f]{64} \d+×\d+$/);
});

test("esbuild", async () => {
  const copy = project("esbuild", forBrowsers);
  writeFileSync(join(copy, "build.mjs"), code("esbuild", "js"));
  runIn(copy, process.execPath, ["build.mjs"]);
  await checkInBrowser(join(copy, "dist"));
});

test("Rollup", async () => {
  const copy = project("rollup", forBrowsers);
  writeFileSync(join(copy, "rollup.config.mjs"), code("Rollup", "js"));
  const args = [npmBin("rollup", "rollup"), "-c", "--silent", "--failAfterWarnings"];
  runIn(copy, process.execPath, args);
  await checkInBrowser(join(copy, "dist"));
});

test("Parcel", async () => {
  const copy = project("parcel", forBrowsers, JSON.parse(code("Parcel", "json")));
  writeFileSync(join(copy, "index.html"), pageWith("main.js"));
  // Where the lock file is, Parcel looks for its settings.
  cpSync(join(made.consumer, "package-lock.json"), join(copy, "package-lock.json"));
  const args = [
    npmBin("parcel", "parcel"),
    "build",
    "index.html",
    "--no-cache",
    "--cache-dir",
    "cache",
  ];
  runIn(copy, process.execPath, args);
  await checkInBrowser(join(copy, "dist"));
});

const esbuildNode = () => code("esbuild for Node", "js");

test("esbuild for Node", () => {
  const copy = project("esbuild-node", forNode);
  writeFileSync(join(copy, "build.mjs"), esbuildNode());
  runIn(copy, process.execPath, ["build.mjs"]);
  checkInNode(copy);
});

test("esbuild for Node, as CommonJS", () => {
  const copy = project("esbuild-cjs", forNode);
  const more = code("esbuild for Node", "js", 1);
  const program = esbuildNode()
    .replace('  format: "esm",\n', `  format: "cjs",\n${more}`)
    .replace('"type": "module"', '"type": "commonjs"');
  assert.ok(program.includes('"cjs"') && program.includes('"commonjs"'));
  writeFileSync(join(copy, "build.mjs"), program);
  runIn(copy, process.execPath, ["build.mjs"]);
  checkInNode(copy);
});

test("a bundle that has the wasm files in it", () => {
  const codecs = `
    import { init as initCodecs } from "depthstitch/codecs";
    import codecs from "depthstitch/codecs.wasm";
    await initCodecs(codecs);`;
  const main = code("Another bundler", "js") + codecs + forNode;
  const copy = project("esbuild-binary", main);
  const program = esbuildNode()
    .replace(/^for [^]*^}$/m, "")
    .replace('"node",', '"node",\n  target: "node20",\n  loader: { ".wasm": "binary" },');
  assert.ok(program.includes("binary") && !program.includes("_bg.wasm"));
  writeFileSync(join(copy, "build.mjs"), program);
  runIn(copy, process.execPath, ["build.mjs"]);
  checkInNode(copy);
});

test("webpack for Node", () => {
  const copy = project("webpack-node", forNode);
  writeFileSync(join(copy, "webpack.config.mjs"), code("webpack for Node", "js"));
  const program = `
    import webpack from "webpack";
    import config from ${JSON.stringify(join(copy, "webpack.config.mjs"))};
    webpack({ ...config, context: process.cwd() }, (error, stats) => {
      if (error || stats.hasErrors() || stats.hasWarnings()) throw error ?? new Error(stats.toString());
    });`;
  runIn(copy, process.execPath, ["--input-type=module", "-e", program]);
  checkInNode(copy);
});

for (const [name, excluded] of /** @type {const} */ ([
  ["vite", false],
  ["vite-7", false],
  ["vite-7", true],
])) {
  const works = name === "vite" || excluded;
  const how = excluded ? "with" : "without";
  test(`the development server of ${name} ${works ? "works" : "fails"} ${how} the exclusion`, async () => {
    const copy = project(`${name}-${how}`, forBrowsers);
    cpSync(join(made.web, "public"), join(copy, "public"), { recursive: true });
    writeFileSync(join(copy, "index.html"), pageWith("main.js"));
    if (excluded) writeFileSync(join(copy, "vite.config.js"), code("Vite", "js"));
    const vite = /** @type {{ createServer: typeof createServer }} */ (await import(name));
    const server = await vite.createServer({
      root: copy,
      logLevel: "silent",
      server: { port: 0, fs: { allow: [copy] } },
    });
    try {
      await server.listen();
      const { digest } = await inChromium(server.resolvedUrls?.local[0]);
      if (works) assert.equal(digest, expected);
      else assert.match(digest, /^StitchError: could not/);
    } finally {
      await server.close();
    }
  });
}

test("the page without a bundler", async () => {
  const copy = project("html");
  writeFileSync(join(copy, "index.html"), code("No bundler", "html"));
  const browser = await launch();
  try {
    await served(copy, async (url) => {
      const page = await browser.newPage();
      await page.goto(url);
      const photos = ["target.jpg", "reference.jpg"].map((name) => join(made.web, "public", name));
      // Two photos, then three: each of the two ways to stitch draws a picture.
      for (const files of [photos, [...photos, photos[0] ?? ""]]) {
        await page.locator("canvas").evaluate((canvas) => canvas.setAttribute("width", "1"));
        await page.locator("input").setInputFiles(files);
        await page.waitForFunction(() => (document.querySelector("canvas")?.width ?? 0) > 250);
      }
    });
  } finally {
    await browser.close();
  }
});
