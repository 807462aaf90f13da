import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdir, mkdtemp, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { parseCase, parseMatches, parseNpy } from "depthstitch/cases";
import { OPTION_LIST } from "depthstitch/options";
import { decodeImage } from "../../dist/codecs.js";
import { UNMEASURED } from "../../dist/eval/measures.js";
import { MANY } from "../../dist/eval/many/evaluate.js";
import { MODES } from "../../dist/eval/modes.js";
import { checkFloors, readFloors } from "../../dist/eval/floors.js";
import { mean, median, percentile } from "../../dist/eval/statistics.js";
import { means } from "../../dist/eval/summarise.js";
import { truthError } from "../../dist/eval/truth.js";
import { writeCase } from "./rendered-case.mjs";

const MAIN = fileURLToPath(new URL("../../dist/eval/main.js", import.meta.url));

/** @type {string} */
let folder;
/** @type {string} */
let data;

before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-eval-"));
  data = join(folder, "data");
  await writeCase(join(data, "made-good"));
  await writeCase(join(data, "made-few"), { keep: 3 });
  await writeCase(join(data, "flat"), { change: { depth: null, truth: null } });
  await mkdir(join(data, "torn"));
  await writeFile(join(data, "torn", "case.json"), "{");
  await mkdir(join(data, "no-case"));
});
after(() => rm(folder, { recursive: true, force: true }));

/** The error of a map that takes the depth of the case. @type {(
 *   fitted: import("depthstitch").Model,
 *   truth: import("../../dist/cases/case.js").Truth,
 *   depth: import("depthstitch").DepthInput,
 *   size: import("depthstitch").Size,
 * ) => import("../../dist/eval/truth.js").TruthError} */
const mapError = (fitted, truth, depth, size) => truthError(fitted, depth, truth, depth, size);

/** @param {string[]} args */
function run(...args) {
  const { status, stdout, stderr } = spawnSync(process.execPath, [MAIN, ...args], {
    encoding: "utf8",
  });
  return { status, stdout, stderr };
}

test("one row per case and mode, failures included, and means of what worked", async () => {
  const json = join(folder, "rows.json");
  const out = join(folder, "pictures");
  const modes = ["default", "baseline"];
  const result = run("--data", data, "--mode", modes.join(), "--json", json, "--out", out);
  assert.equal(result.status, 0, result.stderr);

  /** @type {import("../../dist/eval/evaluate.js").Row[]} */
  const rows = JSON.parse(await readFile(json, "utf8"));
  const names = ["flat", "made-few", "made-good", "torn"];
  const expected = modes.flatMap((mode) => names.map((name) => [name, mode]));
  assert.deepEqual(
    rows.map((row) => [row.case, row.mode]),
    expected,
  );
  const row = (/** @type {string} */ name, /** @type {string} */ mode) => {
    const found = rows.find((row) => row.case === name && row.mode === mode);
    assert.ok(found);
    return found;
  };
  assert.equal(row("made-few", "default").failed, "too-few-matches");
  assert.equal(row("torn", "default").failed, "invalid-case");
  assert.equal(row("torn", "default").psnr_bbox, null);

  const good = row("made-good", "default");
  assert.equal(good.failed, undefined);
  assert.ok((good.error_inside?.[0] ?? NaN) < 0.1, `error inside ${good.error_inside}`);
  assert.ok((good.psnr_mask ?? 0) > (row("made-good", "baseline").psnr_mask ?? NaN) + 3);
  // One homography holds the background, which is most of the photo, but not what stands before it.
  assert.ok((row("made-good", "baseline").error_inside?.[1] ?? NaN) > 3);
  assert.ok((good.inliers ?? 0) > 30 && (good.inliers ?? 0) <= (good.matches ?? 0));
  assert.ok((good.ms.warp ?? 0) > 0);
  assert.ok(row("flat", "baseline").warnings.includes("no-depth"));
  assert.ok(!row("flat", "default").warnings.includes("no-depth"));
  assert.equal(row("flat", "default").error_inside, null);

  const pictures = modes.flatMap((mode) =>
    ["flat", "made-good"].flatMap((name) =>
      ["mosaic", "warped"].map((picture) => `${name}_${mode}_${picture}.png`),
    ),
  );
  assert.deepEqual((await readdir(out)).sort(), pictures.sort());
  const warped = await decodeImage(await readFile(join(out, "made-good_default_warped.png")));
  assert.ok(warped.width > 0);

  assert.match(result.stdout, /^made-few .* FAILED too-few-matches$/m);
  assert.match(result.stdout, /^mean .* 2 of 4 stitched$/m);
  assert.match(result.stdout, /^made-\* .* 1 of 2 stitched$/m);
});

test("cases are picked by name; seed and options reach the core", async () => {
  const json = join(folder, "picked.json");
  const base = ["--data", data, "--cases", "made-g*,x?", "--json", json];
  const read = async () => JSON.parse(await readFile(json, "utf8"));
  assert.equal(run(...base, "--seed", "5", "--set", "warpMode=forward").status, 0);
  const forward = await read();
  assert.equal(forward.length, 1);
  assert.equal(run(...base, "--seed", "5", "--set", "warpMode=optimal").status, 0);
  assert.notEqual(forward[0].psnr_mask, (await read())[0].psnr_mask);
});

test("every mode runs", () => {
  const result = run("--data", join(data, "made-good"), "--mode", [...MODES.keys()].join());
  assert.equal(result.status, 0, result.stderr);
  assert.doesNotMatch(result.stdout, /FAILED/);
  for (const mode of MODES.keys()) assert.ok(result.stdout.includes(`${mode}\n`), mode);
});

test("no two modes are the same", () => {
  // What a mode does is what it passes to `stitch`, with the defaults of the core for the rest.
  const resolved = [...MODES].map(([name, { settings, depth }]) => {
    const paper = settings.mode === "paper";
    const all = OPTION_LIST.map(([option, spec]) => {
      const standard = (paper ? spec.paper : undefined) ?? spec.default;
      return option === "mode" ? null : (settings[option] ?? standard);
    });
    return /** @type {const} */ ([JSON.stringify([depth, all]), name]);
  });
  assert.equal(new Map(resolved).size, MODES.size, resolved.map(([, name]) => name).join());
});

test("what does not exist (yet) is refused with exit code 2", () => {
  const refused = [
    { args: ["--mode", "best"], line: /--mode must be of baseline/ },
    { args: ["--matches", "mine"], line: /--matches must be supplied or own/ },
    { args: ["--set", "nothing=1"], line: /--set needs OPTION=VALUE/ },
    { args: ["--set", "seed"], line: /--set needs OPTION=VALUE/ },
    { args: ["--seed", "x"], line: /--seed must be a number/ },
    { args: ["--cases", "none"], line: /no case folder/ },
    { args: ["--data", join(folder, "nowhere")], line: /cannot be read/ },
    { args: ["--wrong"], line: /--wrong/ },
    { args: ["--lpips", join(folder, "no.onnx")], line: /--lpips .* cannot be read/ },
  ];
  for (const { args, line } of refused) {
    const { status, stderr } = run("--data", data, ...args);
    assert.equal(status, 2, args.join(" "));
    assert.match(stderr, line);
  }
});

test("nothing to check is no success", () => {
  const { status, stdout } = run("--data", join(data, "made-good"), "--mode", "paper", "--check");
  assert.equal(status, 1);
  assert.match(stdout, /^0 rows with a floor/m);
});

test("percentiles are NumPy's", () => {
  // np.percentile([3, 1, 2, 10], q)
  assert.equal(percentile([3, 1, 2, 10], 0), 1);
  assert.equal(percentile([3, 1, 2, 10], 50), 2.5);
  assert.ok(Math.abs(percentile([3, 1, 2, 10], 90) - 7.9) < 1e-12);
  assert.equal(percentile([3, 1, 2, 10], 100), 10);
  assert.equal(median([5]), 5);
  assert.equal(median([Infinity, Infinity]), Infinity);
  assert.ok(Number.isNaN(median([])));
  assert.equal(mean([1, null, 3, undefined, NaN]), 2);
  assert.equal(mean([null]), undefined);
});

const IDENTITY = new Float64Array([1, 0, 0, 0, 1, 0, 0, 0, 1]);

/** A truth that shifts by `shift` per unit of depth, along x. @param {number} shift */
const truth = (shift) => ({
  h: [...IDENTITY],
  e: [shift, 0, 0],
  ownDepth: false,
  inverseDepth: undefined,
});

/** @param {number} width @param {number} height @param {(x: number, y: number) => number} value */
function depthMap(width, height, value) {
  const data = new Float32Array(width * height).map((_, i) =>
    value(i % width, Math.floor(i / width)),
  );
  return { data, width, height, kind: /** @type {"inverse" | "metric"} */ ("inverse") };
}

test("truth error: distance between both maps, inside and outside the reference", () => {
  // 40×40 target, depth 2, true shift +10 per unit: (x, y) → (x + 20, y), so that columns up to 16 (5 of 10 grid
  // columns) stay within the 40 columns of the reference. The fitted shift is 0.5 per unit longer: off by 1 px.
  const depth = depthMap(40, 40, () => 2);
  const fitted = { h: IDENTITY, e: new Float64Array([10.5, 0, 0]) };
  const size = { width: 40, height: 40 };
  assert.deepEqual(mapError(fitted, truth(10), depth, size), { inside: [1, 1], outside: [1, 1] });

  // Metric depth ½ is the same inverse depth; the sign of a model means nothing.
  const metric = { ...depthMap(40, 40, () => 0.5), kind: /** @type {const} */ ("metric") };
  const negated = { ...truth(10), h: [...IDENTITY].map((v) => -v), e: [-10, 0, 0] };
  assert.deepEqual(mapError(fitted, negated, metric, size), { inside: [1, 1], outside: [1, 1] });
});

test("truth error: median and 90th percentile where the error varies", () => {
  // No true motion; the fitted map shifts by d, and d is the column: grid columns 0, 4, …, 36 shift by 1, 5, …, 37.
  const depth = depthMap(40, 40, (x) => x + 1);
  const fitted = { h: IDENTITY, e: new Float64Array([1, 0, 0]) };
  const { inside, outside } = mapError(fitted, truth(0), depth, { width: 40, height: 40 });
  // Ten errors of each of 1, 5, …, 37: np.median 19, np.percentile 90 at rank 89.1, between 33 and 37.
  assert.ok(inside);
  assert.equal(inside[0], 19);
  assert.ok(Math.abs(inside[1] - (33 + 0.1 * 4)) < 1e-9, String(inside[1]));
  assert.equal(outside, null);
});

test("truth error: few points, holes, far points and other true depth", () => {
  const fitted = { h: IDENTITY, e: new Float64Array([0, 0, 0]) };
  const size = { width: 1000, height: 1000 };
  // A 20×16 target has 5×4 = 20 grid points: too few; one more row is enough.
  assert.equal(
    mapError(
      fitted,
      truth(0),
      depthMap(20, 16, () => 1),
      size,
    ).inside,
    null,
  );
  assert.deepEqual(
    mapError(
      fitted,
      truth(0),
      depthMap(20, 17, () => 1),
      size,
    ).inside,
    [0, 0],
  );
  // Holes and depth that is not positive are left out.
  const holes = depthMap(40, 40, (x) => (x < 20 ? NaN : x < 36 ? 1 : 0));
  assert.equal(mapError(fitted, truth(0), holes, size).inside?.length, 2);
  const mostlyHoles = depthMap(40, 40, (x) => (x < 32 ? NaN : 0));
  assert.equal(mapError(fitted, truth(0), mostlyHoles, size).inside, null);
  // Farther than 3000 px: neither inside nor outside.
  const far = mapError(
    fitted,
    truth(3100),
    depthMap(40, 40, () => 1),
    size,
  );
  assert.deepEqual(far, { inside: null, outside: null });
  // The true map takes the true depth, here 3 where the fitted one has 1.
  const inverseDepth = { data: new Float32Array(1600).fill(3), shape: [40, 40] };
  const other = { ...truth(1), inverseDepth };
  const shifted = { h: IDENTITY, e: new Float64Array([1, 4, 0]) };
  const expected = Math.hypot(1 - 3, 4);
  assert.deepEqual(
    mapError(
      shifted,
      other,
      depthMap(40, 40, () => 1),
      size,
    ).inside,
    [expected, expected],
  );
  // The fitted map takes the depth it was warped with, here 2.
  const used = depthMap(40, 40, () => 2);
  const given = depthMap(40, 40, () => 1);
  const along = { h: IDENTITY, e: new Float64Array([1, 0, 0]) };
  assert.deepEqual(truthError(along, used, truth(1), given, size).inside, [1, 1]);
});

test("floors: what falls short is named, tolerance included", async () => {
  const floors = {
    tolerance: {
      psnr_bbox: 0.1,
      ssim_bbox: 0.01,
      cover: 0.01,
      error_inside: 0.2,
      error_outside: 0.2,
      seam_length: 0.5,
    },
    modes: {
      paper: {
        a: { psnr_bbox: 20, error_inside: 1, seam_length: 5 },
        "b-*": { cases: 2, cover: 0.5 },
        absent: { cover: 1 },
      },
    },
  };
  /** @type {(name: string, psnr_bbox: number | null, error: number, cover: number) => import("../../dist/eval/evaluate.js").Row} */
  const row = (name, psnr_bbox, error, cover) => ({
    ...UNMEASURED,
    case: name,
    mode: "paper",
    psnr_bbox,
    cover,
    error_inside: [error, 99],
    seam_length: 4 * error,
    ms: {},
    warnings: [],
  });
  const check = (/** @type {import("../../dist/eval/evaluate.js").Row[]} */ rows) =>
    checkFloors(floors, "paper", rows, means(rows), new Set(["overlap"]));

  const fine = check([row("a", 19.95, 1.15, 0), row("b-1", 1, 1, 0.4), row("b-2", 1, 1, 0.6)]);
  assert.deepEqual(fine, { checked: 2, short: [] });
  const short = check([row("a", 19.85, 1.25, 0), row("b-1", 1, 1, 0.4), row("b-2", 1, 1, 0.5)]);
  assert.equal(short.short.length, 3);
  assert.equal(check([row("a", null, 1, 0)]).short.length, 1, "not measured is short");
  assert.equal(check([row("b-1", 1, 1, 0.4)]).checked, 0, "the mean of a part of a group");
  assert.deepEqual(checkFloors(floors, "default", [], [], new Set()), { checked: 0, short: [] });

  // What was not asked for is not compared; of what a person sees, less is better.
  const row4 = [row("a", 0, 1, 0)];
  const look = checkFloors(floors, "paper", row4, means(row4), new Set(["look"]));
  assert.deepEqual(look, { checked: 1, short: [] });
  const row8 = [row("a", 0, 2, 0)];
  const longer = checkFloors(floors, "paper", row8, means(row8), new Set(["look"]));
  assert.equal(longer.checked, 1);
  assert.match(longer.short.join(), /^paper a: seam_length 8.000, ceiling 5 \(tolerance 0.5\)$/);

  for (const mode of Object.keys((await readFloors()).modes)) {
    assert.ok(mode === MANY || MODES.has(mode.replace("+own", "")), mode);
  }
});

/** @param {string} header @param {number[]} data @param {{ bytes?: number, major?: number }} [options] */
function npy(header, data, { bytes = 4, major = 1 } = {}) {
  const start = major === 1 ? 10 : 12;
  const file = new Uint8Array(start + header.length + data.length * bytes);
  const view = new DataView(file.buffer);
  file.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, major, 0]);
  if (major === 1) view.setUint16(8, header.length, true);
  else view.setUint32(8, header.length, true);
  file.set(new TextEncoder().encode(header), start);
  for (const [i, value] of data.entries()) {
    const at = start + header.length + i * bytes;
    if (bytes === 4) view.setFloat32(at, value, true);
    else view.setFloat64(at, value, true);
  }
  return file;
}

test("npy: float32 and float64, one and two dimensions, versions 1 and 2", () => {
  const f4 = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n";
  const image = parseNpy(npy(f4, [1, 2, 3, 4, 5, 0.1]), "a.npy");
  assert.deepEqual(image, { data: new Float32Array([1, 2, 3, 4, 5, 0.1]), shape: [2, 3] });
  const f8 = "{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }\n";
  const line = parseNpy(npy(f8, [0.1, -Infinity], { bytes: 8, major: 2 }), "a.npy");
  assert.deepEqual(line, { data: new Float64Array([0.1, -Infinity]), shape: [2] });
});

test("npy: every type, in both byte orders, is read exactly", () => {
  /** @type {[string, number[], number[], Float32ArrayConstructor | Float64ArrayConstructor][]} */
  const types = [
    ["|u1", [7, 255], [7, 255], Float32Array],
    ["|i1", [0x80, 1], [-128, 1], Float32Array],
    ["<u2", [1, 2, 0xff, 0xff], [513, 65535], Float32Array],
    [">u2", [1, 2, 0xff, 0xff], [258, 65535], Float32Array],
    ["<i2", [0, 0x80, 1, 0], [-32768, 1], Float32Array],
    ["<i4", [0xff, 0xff, 0xff, 0xff, 1, 0, 0, 1], [-1, 16777217], Float64Array],
    [">u4", [0xff, 0xff, 0xff, 0xff, 1, 0, 0, 1], [4294967295, 16777217], Float64Array],
    [">f4", [0x3f, 0xc0, 0, 0, 0xff, 0x80, 0, 0], [1.5, -Infinity], Float32Array],
    ["<f2", [0, 0x3c, 1, 0], [1, 2 ** -24], Float32Array],
  ];
  for (const [descr, bytes, values, Data] of types) {
    const header = `{'descr': '${descr}', 'fortran_order': False, 'shape': (2,), }\n`;
    const file = Buffer.concat([npy(header, []), Buffer.from(bytes)]);
    assert.deepEqual(parseNpy(file, "a.npy"), { data: Data.from(values), shape: [2] }, descr);
  }
});

test("npy: anything else is refused with the file's name", () => {
  const header = (/** @type {string} */ descr, /** @type {string} */ order) =>
    `{'descr': '${descr}', 'fortran_order': ${order}, 'shape': (2,), }\n`;
  const good = npy(header("<f4", "False"), [1, 2]);
  const refused = [
    { bytes: new Uint8Array(3), reason: /is not an \.npy file/ },
    { bytes: good.subarray(0, 9), reason: /is not an \.npy file/ },
    { bytes: good.subarray(0, 40), reason: /is truncated/ },
    {
      bytes: good.subarray(0, good.length - 1),
      reason: /has 7 bytes of data, its shape implies 8/,
    },
    { bytes: npy(header("<c8", "False"), [1, 2]), reason: /unsupported type <c8/ },
    { bytes: npy(header("<f4", "True"), [1, 2]), reason: /Fortran order/ },
    { bytes: npy("{}", []), reason: /no valid header/ },
    { bytes: npy(header("<f4", "False"), [1, 2], { major: 9 }), reason: /version 9/ },
  ];
  for (const { bytes, reason } of refused) {
    assert.throws(() => parseNpy(bytes, "a.npy"), {
      name: "FileError",
      code: "invalid-npy",
      message: reason,
    });
  }
});

test("matches: numbers by row; what is wrong is named with its line", () => {
  const text = "xt, yt ,xr,yr\r\n1,2.5,-3,4e1\r\n\r\n5,6,7,8\n";
  assert.deepEqual(parseMatches(text, "m.csv"), new Float32Array([1, 2.5, -3, 40, 5, 6, 7, 8]));
  assert.deepEqual(parseMatches("xt,yt,xr,yr", "m.csv"), new Float32Array());
  const refused = [
    { text: "", reason: /line 1 must be the header/ },
    { text: "1,2,3,4", reason: /line 1 must be the header/ },
    { text: "xr,yr,xt,yt\n1,2,3,4", reason: /line 1 must be the header/ },
    { text: "xt,yt,xr,yr\n1,2,3", reason: /line 2 has 3 values/ },
    { text: "xt,yt,xr,yr\n\n1,2,3,x", reason: /line 3: "x" is not a number/ },
    { text: "xt,yt,xr,yr\n1,2,,4", reason: /line 2: "" is not a number/ },
    { text: "xt,yt,xr,yr\n1,2,nan,4", reason: /line 2: "nan" is not a number/ },
    { text: "xt,yt,xr,yr\n1,2,1e999,4", reason: /line 2: "1e999" is not a number/ },
  ];
  for (const { text, reason } of refused) {
    assert.throws(() => parseMatches(text, "m.csv"), { code: "invalid-matches", message: reason });
  }
});

test("case.json: every wrong key is named", () => {
  const good = {
    target: "t.png",
    reference: "r.png",
    matches: "m.csv",
    target_depth: "a.png",
    reference_depth: "b.png",
    depth: { kind: "metric", scale: 2, invalid: 0 },
    truth_map: {
      H_inf: [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
      ],
      e_prime: [1, 2, 3],
    },
  };
  const parse = (/** @type {object} */ change) =>
    parseCase(JSON.stringify({ ...good, ...change }), "case.json");
  const parsed = parse({});
  assert.deepEqual(parsed.truth, { h: [1, 0, 0, 0, 1, 0, 0, 0, 1], e: [1, 2, 3], ownDepth: true });
  assert.deepEqual(parsed.depth, {
    kind: "metric",
    scale: 2,
    invalid: 0,
    target: "a.png",
    reference: "b.png",
  });
  assert.equal(parse({ depth: null }).depth, null);
  assert.equal(parse({ reference_depth: undefined }).depth?.reference, null);
  assert.equal(parse({ matches: undefined }).matches, null);
  assert.equal(parse({ depth: { kind: "metric" } }).depth?.scale, 1);
  assert.equal(parse({ truth: good.truth_map }).truth?.ownDepth, false);
  const refused = [
    { change: { target: 5 }, reason: /"target" must be a file name/ },
    { change: { target_depth: 7 }, reason: /"target_depth" must be a file name/ },
    {
      change: { target_depth: undefined, reference_depth: null },
      reason: /"depth" needs "target_depth" or "reference_depth"/,
    },
    { change: { depth: [] }, reason: /"depth" must be an object/ },
    { change: { depth: { kind: "far", scale: 1 } }, reason: /"depth.kind"/ },
    { change: { depth: { kind: "metric", scale: 0 } }, reason: /"depth.scale"/ },
    { change: { depth: { kind: "metric", scale: 1, invalid: "0" } }, reason: /"depth.invalid"/ },
    { change: { truth: { H_inf: [1], e_prime: [1, 2, 3] } }, reason: /"H_inf" must be 9 numbers/ },
    { change: { truth: { H_inf: Array(9).fill("1"), e_prime: [] } }, reason: /"H_inf"/ },
  ];
  for (const { change, reason } of refused) {
    assert.throws(() => parse(change), { code: "invalid-case", message: reason });
  }
  assert.throws(() => parseCase("{", "case.json"), { code: "invalid-case" });
});
