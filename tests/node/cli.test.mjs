import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { once } from "node:events";
import { closeSync, existsSync, openSync } from "node:fs";
import { link, mkdir, mkdtemp, readFile, readdir, rm, symlink, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { progressLine } from "../../dist/cli/progress.js";
import { SETTING_NAMES, flagName } from "../../dist/cli/settings.js";
import { decodeDepth, decodeImage, encodeGrayPng } from "../../dist/codecs.js";
import { defaultOptions, version } from "../../dist/index.js";
import { HEIGHT, WIDTH, writeCase } from "./rendered-case.mjs";

const MAIN = fileURLToPath(new URL("../../dist/cli/main.js", import.meta.url));

/** @type {string} */
let folder;
/** @type {string} */
let work;
/** @type {number} */
let matchCount;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-cli-"));
  matchCount = (await writeCase(join(folder, "case"))).length;
  work = join(folder, "work");
});
after(() => rm(folder, { recursive: true, force: true }));

/**
 * Runs the command line in an empty folder.
 *
 * @param {string[]} args
 * @param {(child: import("node:child_process").ChildProcess) => void} [started]
 * @param {string[]} [flags] of Node
 */
async function run(args, started, flags = []) {
  await rm(work, { recursive: true, force: true });
  await mkdir(work);
  const child = spawn(process.execPath, [...flags, MAIN, ...args], { cwd: work });
  let stdout = "";
  let stderr = "";
  child.stdout.on("data", (chunk) => (stdout += chunk));
  child.stderr.on("data", (chunk) => (stderr += chunk));
  started?.(child);
  const [code, signal] = await once(child, "close");
  return { code, signal, stdout, stderr, files: (await readdir(work)).sort() };
}

/** @param {string} name */
const input = (name) => join(folder, "case", name);
const pair = () => [input("target.png"), input("reference.png"), "--matches", input("matches.csv")];
const depths = () => [
  "--target-depth",
  input("target_depth.png"),
  "--reference-depth",
  input("reference_depth.png"),
];

/**
 * @param {Awaited<ReturnType<typeof run>>} result
 * @param {number} code
 * @param {RegExp} line
 */
function assertFails(result, code, line) {
  assert.equal(result.code, code, result.stderr);
  assert.match(result.stderr, /^depthstitch: [^\n]+\n$/, "one line on stderr");
  assert.match(result.stderr, line);
  assert.equal(result.stdout, "");
  assert.deepEqual(result.files, [], "nothing is left behind");
}

test("a pair with depth becomes a mosaic, its parts and a report", async () => {
  const outputs = "-o m.jpg --warped w.png --void-mask v.png --report r.json".split(" ");
  const result = await run([...pair(), ...depths(), ...outputs, "--seed", "7"]);
  assert.equal(result.code, 0, result.stderr);
  assert.deepEqual(result.files, ["m.jpg", "r.json", "v.png", "w.png"]);
  assert.match(result.stdout, /^m\.jpg: \d+×\d+, \d+ of \d+ matches, PSNR .* of the reference\n$/);

  const report = JSON.parse(await readFile(join(work, "r.json"), "utf8"));
  const mosaic = await decodeImage(await readFile(join(work, "m.jpg")));
  const warped = await decodeImage(await readFile(join(work, "w.png")));
  const voids = await decodeDepth(await readFile(join(work, "v.png")));
  for (const image of [mosaic, warped, voids]) {
    assert.deepEqual([image.width, image.height], [report.canvas.width, report.canvas.height]);
  }
  assert.ok(report.canvas.width >= WIDTH && report.canvas.height >= HEIGHT);
  assert.equal(report.voidPixels, voids.data.filter((value) => value !== 0).length);

  assert.deepEqual(report.options, { ...(await defaultOptions()), seed: 7 });
  assert.equal(report.version, await version());
  assert.match(report.fit.model, /^(depth|calibrated)$/);
  assert.equal(report.fit.matches, matchCount);
  assert.equal(report.inliers.length, matchCount);
  const inliers = report.inliers.filter((/** @type {number} */ flag) => flag === 1).length;
  assert.equal(report.fit.inliers, inliers);
  assert.ok(report.quality.psnrMask > 25, `PSNR ${report.quality.psnrMask}`);
  assert.ok(report.quality.coverage > 0.6, `coverage ${report.quality.coverage}`);
  assert.ok(report.times.warp > 0);
});

test("a case folder is enough; the default output is mosaic.png", async () => {
  const result = await run(["--case", join(folder, "case"), "--report", "r.json"]);
  assert.equal(result.code, 0, result.stderr);
  assert.deepEqual(result.files, ["mosaic.png", "r.json"]);
  const report = JSON.parse(await readFile(join(work, "r.json"), "utf8"));
  assert.match(report.fit.model, /^(depth|calibrated)$/);
  assert.equal(report.depth.scale, 0.5);
});

test("a pair without depth is stitched with a warning; --quiet silences it", async () => {
  const flat = [...pair(), "--without-depth", "homography"];
  const loud = await run(flat);
  assert.equal(loud.code, 0, loud.stderr);
  assert.match(loud.stderr, /^depthstitch: warning: no-depth: /m);
  const quiet = await run([...flat, "--quiet"]);
  assert.deepEqual([quiet.code, quiet.stdout, quiet.stderr], [0, "", ""]);
});

test("progress is silent off a terminal unless asked for", async () => {
  const args = ["--case", join(folder, "case")];
  assert.doesNotMatch((await run(args)).stderr, /^warp/m);
  const { stderr } = await run([...args, "--progress"]);
  const read = String.raw`reading reference\.png \(2 of 5\)`;
  for (const stage of [read, "estimate", "warp", "writing"]) {
    assert.match(stderr, new RegExp(`^${stage}$`, "m"));
  }
});

test("on a terminal progress is one line, rewritten and cleared", () => {
  let written = "";
  const terminal = { isTTY: true, write: (/** @type {string} */ text) => (written += text) };
  const line = progressLine(terminal, true);
  line.show({ stage: "warp", fraction: 0.5 });
  line.show({ stage: "warp", fraction: 0.501 });
  line.show({ stage: "blend", fraction: 0 });
  line.clear();
  line.clear();
  assert.equal(written, "\r\x1b[Kwarp 50 %\r\x1b[Kblend 0 %\r\x1b[K");
  progressLine(terminal, false).show({ stage: "fill", fraction: 1 });
  assert.doesNotMatch(written, /fill/);
});

test("depth flags reach the core: a wrong kind of depth fits worse", async () => {
  const residual = async (/** @type {string[]} */ flags) => {
    // Refinement would make up for most of it.
    const plain = [...pair(), ...depths(), "--refinement", "none"];
    const result = await run([...plain, ...flags, "--report", "r.json"]);
    assert.equal(result.code, 0, result.stderr);
    return JSON.parse(await readFile(join(work, "r.json"), "utf8")).quality.psnrMask;
  };
  assert.ok((await residual([])) > (await residual(["--depth-kind", "metric"])) + 3);
});

test("a reader that stops reading is no failure", async () => {
  const { code, stderr } = await run(["--case", join(folder, "case")], (child) => {
    child.stdout?.destroy();
  });
  assert.deepEqual([code, stderr], [0, ""]);
});

test("every option of the core has a flag, and --help shows it with its default", async () => {
  const defaults = await defaultOptions();
  assert.deepEqual([...SETTING_NAMES].sort(), Object.keys(defaults).sort());
  const { code, stdout } = await run(["--help"]);
  assert.equal(code, 0);
  for (const [name, value] of Object.entries(defaults)) {
    const flag = stdout.indexOf(`--${flagName(name)} `);
    assert.ok(flag >= 0, name);
    const entry = stdout.slice(flag).replaceAll(/\s+/g, " ");
    const text = typeof value === "boolean" ? (value ? "on" : "off") : String(value);
    assert.equal(/\[([^\]]*)\]/.exec(entry)?.[1], text, name);
  }
  for (const exit of ["0", "1", "2", "130"]) assert.match(stdout, new RegExp(`\\b${exit} `));
});

test("--version prints the version of the core", async () => {
  const { code, stdout } = await run(["--version"]);
  assert.deepEqual([code, stdout], [0, `${await version()}\n`]);
});

test("a wrong command line exits with 2", async () => {
  const wrong = [
    { args: ["--nonsense"], line: /usage: .*--nonsense/ },
    { args: [], line: /TARGET and REFERENCE/ },
    { args: [input("target.png")], line: /TARGET and REFERENCE/ },
    { args: [...pair(), "--own-matches"], line: /mutually exclusive/ },
    { args: [...pair(), "--invalid", "0"], line: /--invalid needs/ },
    { args: [...pair(), "--seed", "many"], line: /--seed must be a number, got "many"/ },
    { args: [...pair(), "--warp-mode", "sideways"], line: /--warp-mode must be one of forward/ },
    { args: [...pair(), "--max-trials", "-1"], line: /invalid-argument: maxTrials .*-1/ },
    { args: [...pair(), "--seed"], line: /usage: .*--seed/ },
    { args: [...pair(), "--confidence=7"], line: /invalid-argument: confidence/ },
    { args: [...pair(), "-o", "m.gif"], line: /must end in \.png/ },
    { args: [...pair(), "--warped", "w.jpg"], line: /must end in \.png/ },
    { args: [...pair(), "-o", input("target.png")], line: /is an input/ },
    { args: [...pair(), "-o", "a.png", "--warped", "./a.png"], line: /another output/ },
    { args: ["--case", "x", "--matches", "y"], line: /cannot be combined/ },
    { args: ["--case", "x", "y.png"], line: /--case names its own/ },
  ];
  for (const { args, line } of wrong) assertFails(await run(args), 2, line);
});

test("a file that is missing or damaged exits with 1 and is named", async () => {
  const broken = join(folder, "broken.png");
  await writeFile(broken, "no picture");
  const unheaded = join(folder, "unheaded.csv");
  await writeFile(unheaded, "1,2,3,4\n");
  const [target, reference, ...matches] = pair();
  assert.ok(target && reference);
  const loop = join(folder, "loop.png");
  await symlink(loop, loop);
  const long = `${"n".repeat(300)}.png`;
  const cases = [
    { args: ["missing.png", reference, ...matches], line: /not-found: missing\.png: no such file/ },
    { args: [broken, reference, ...matches], line: /decode-failed: .*broken\.png: / },
    { args: [target, reference, "-m", unheaded], line: /invalid-matches: .*line 1 must be/ },
    { args: ["--case", folder], line: /not-found: .*case\.json/ },
    {
      args: [...pair(), "-o", "nowhere/m.png"],
      line: /not-writable: nowhere\/m\.png: no such folder/,
    },
    { args: [...pair(), "--report", folder], line: /not-writable: .*is a folder/ },
    ...[loop, long].flatMap((path) => [
      { args: [path, reference], line: /not-readable: .*cannot be read \(E\w+\)/ },
      { args: [...pair(), "-o", path], line: /not-writable: .*cannot be written \(E\w+\)/ },
    ]),
  ];
  for (const { args, line } of cases) assertFails(await run(args), 1, line);
});

test("photos that cannot be stitched exit with 1 and the core's code", async () => {
  const few = join(folder, "few.csv");
  await writeFile(few, "xt,yt,xr,yr\n1,2,3,4\n");
  const [target, reference] = pair();
  assert.ok(target && reference);
  assertFails(await run([target, reference, "-m", few]), 1, /too-few-matches: /);
});

test("an output that exists survives a failure and is replaced, through a link, by a success", async () => {
  const precious = join(folder, "precious.png");
  await writeFile(precious, "old");
  const few = join(folder, "one.csv");
  await writeFile(few, "xt,yt,xr,yr\n1,2,3,4\n");
  const [target, reference] = pair();
  assert.ok(target && reference);
  const failed = await run([target, reference, "-m", few, "-o", precious]);
  assert.equal(failed.code, 1);
  assert.equal(await readFile(precious, "utf8"), "old");

  const alias = join(folder, "link.png");
  await symlink(precious, alias);
  const done = await run([...pair(), ...depths(), "-o", alias]);
  assert.equal(done.code, 0, done.stderr);
  assert.ok((await decodeImage(await readFile(precious))).width >= WIDTH);
});

test("without a matches file the photos are matched", async () => {
  const photos = pair().slice(0, 2);
  const { code, stderr, files } = await run([...photos, ...depths(), "--report", "r.json"]);
  assert.equal(code, 0, stderr);
  const report = JSON.parse(await readFile(join(work, "r.json"), "utf8"));
  assert.equal(report.matches, null);
  assert.ok(report.fit.inliers > 30, `${report.fit.inliers} inliers`);
  assert.equal(report.inliers.length, report.fit.matches);
  assert.deepEqual(files, ["mosaic.png", "r.json"]);

  const anew = ["--case", join(folder, "case"), "--own-matches", "--report", "r.json"];
  assert.equal((await run(anew)).code, 0);
  const again = JSON.parse(await readFile(join(work, "r.json"), "utf8"));
  assert.deepEqual(again.fit.matches, report.fit.matches);
});

/**
 * The process sends itself a signal so many milliseconds after a line of progress: from here it might come too late.
 *
 * @param {string[]} args
 * @param {NodeJS.Signals} signal
 * @param {string} line
 * @param {number} after
 */
async function interrupted(args, signal, line, after = 0) {
  const script = `
    const write = process.stderr.write.bind(process.stderr);
    const end = () => process.kill(process.pid, "${signal}");
    process.stderr.write = (text) => {
      write(text);
      if (text.includes("${line}")) ${after} ? setTimeout(end, ${after}) : end();
    };`;
  const flags = ["--import", `data:text/javascript,${encodeURIComponent(script)}`];
  const result = await run([...args, "--progress"], undefined, flags);
  assert.ok(result.stderr.includes(line), result.stderr);
  return result;
}

for (const signal of /** @type {const} */ (["SIGINT", "SIGTERM"])) {
  for (const line of ["(1 of 5)", "estimate"]) {
    test(`${signal} while the line says ${line} ends it and leaves nothing behind`, async () => {
      const result = await interrupted([...pair(), ...depths()], signal, line);
      assert.equal(result.signal, signal, result.stderr);
      assert.deepEqual(result.files, []);
    });
  }
}

test("a signal while outputs are written leaves those that were there", async () => {
  const old = await mkdtemp(join(folder, "outputs-"));
  const names = ["a.png", "b.png"];
  for (const name of names) await writeFile(join(old, name), "old");
  const script = `
    import { writeOutputs } from ${JSON.stringify(new URL("../../dist/cli/output.js", import.meta.url))};
    const contents = process.argv.slice(1).map((path) => [path, new Uint8Array(1e7)]);
    const written = writeOutputs(new Map(contents));
    process.kill(process.pid, "SIGTERM");
    await written;`;
  const paths = names.map((name) => join(old, name));
  const { signal } = spawnSync(process.execPath, ["--input-type=module", "-e", script, ...paths]);
  assert.equal(signal, "SIGTERM");
  assert.deepEqual((await readdir(old)).sort(), names);
  for (const path of paths) assert.equal(await readFile(path, "utf8"), "old");
});

test("a signal does not wait for the decoder", async () => {
  const side = 8000;
  const file = join(folder, "slow.png");
  const slow = await encodeGrayPng({
    data: new Uint8Array(side * side),
    width: side,
    height: side,
  });
  await writeFile(file, slow);
  const start = performance.now();
  await decodeImage(slow);
  const takes = performance.now() - start;
  const result = await interrupted([file, file], "SIGTERM", "(1 of 2)", takes / 4);
  assert.equal(result.signal, "SIGTERM", result.stderr);
  assert.ok(!result.stderr.includes("(2 of 2)"), "the first photo was decoded to its end");
});

test("an output that is an input, or another output, by another name is refused", async () => {
  const [target = ""] = pair();
  const places = await mkdtemp(join(folder, "links-"));
  await symlink(target, join(places, "link.png"));
  await link(target, join(places, "hard.png"));
  await symlink(join(places, "new.png"), join(places, "dangling.png"));
  await symlink(places, join(folder, "elsewhere"));
  const at = (/** @type {string} */ name) => join(places, name);
  for (const [args, line] of /** @type {const} */ ([
    [["-o", at("link.png")], /link.png: it is an input/],
    [["-o", at("hard.png")], /hard.png: it is an input/],
    [["-o", at("new.png"), "--warped", at("dangling.png")], /dangling.png: it is another output/],
    [
      ["-o", at("new.png"), "--warped", join(folder, "elsewhere", "new.png")],
      /new.png: it is another output/,
    ],
  ])) {
    assertFails(await run([...pair(), ...args]), 2, line);
  }
});

test("no file of a case is overwritten, whether it is used or not", async () => {
  const place = join(folder, "case");
  const { matches } = JSON.parse(await readFile(join(place, "case.json"), "utf8"));
  assert.equal(typeof matches, "string");
  for (const name of ["case.json", matches]) {
    const before = await readFile(join(place, name));
    const args = ["--case", place, "--own-matches", "--report", join(place, name)];
    assertFails(await run(args), 2, /it is an input/);
    assert.deepEqual(await readFile(join(place, name)), before);
  }
});

test("the size that is printed is that of the file", async () => {
  const { code, stdout, stderr } = await run([...pair(), ...depths(), "--crop", "inner"]);
  assert.equal(code, 0, stderr);
  const { width, height } = await decodeImage(await readFile(join(work, "mosaic.png")));
  assert.ok(stdout.startsWith(`mosaic.png: ${width}×${height}, `), stdout);
});

const full = existsSync("/dev/full") ? {} : { skip: "this system has no /dev/full" };
test("a standard output that is full is said in one line", full, () => {
  const out = openSync("/dev/full", "w");
  const { status, stderr } = spawnSync(process.execPath, [MAIN, "--help"], {
    stdio: ["ignore", out, "pipe"],
    encoding: "utf8",
  });
  closeSync(out);
  assert.equal(status, 1);
  assert.equal(stderr, "depthstitch: not-writable: standard output (ENOSPC)\n");
});
