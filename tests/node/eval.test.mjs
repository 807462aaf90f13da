import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdir, mkdtemp, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { OPTION_LIST } from "depthstitch/options";
import { decodeImage } from "../../dist/codecs.js";
import { UNMEASURED } from "../../dist/eval/measures.js";
import { MANY } from "../../dist/eval/many/evaluate.js";
import { parseRequest } from "../../dist/eval/arguments.js";
import { MODES, onPlane } from "../../dist/eval/modes.js";
import { checkFloors, readFloors } from "../../dist/eval/floors.js";
import { mean, median, percentile } from "../../dist/eval/statistics.js";
import { means } from "../../dist/eval/summarise.js";
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
  // Where there is a true map.
  assert.match(result.stdout, /^mean .* 2 of 4 stitched; in med of 1; out med of 1$/m);
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
    { args: ["--leave-out"], line: /--leave-out needs --many/ },
    { args: ["--set", "projection=sphere"], line: /--set projection needs --many/ },
    { args: ["--many"], line: /--data cannot be combined with --many/ },
    { args: ["--lpips", join(folder, "no.onnx")], line: /--lpips .* cannot be read/ },
  ];
  for (const { args, line } of refused) {
    const { status, stderr } = run("--data", data, ...args);
    assert.equal(status, 2, args.join(" "));
    assert.match(stderr, line);
  }
});

test("what only pairs have is refused of sets", () => {
  const flags = [
    ["--mode", "paper"],
    ["--matches", "own"],
    ["--look"],
    ["--stability"],
    ["--hidden"],
    ["--lpips", "network.onnx"],
  ];
  for (const flag of flags) {
    assert.throws(() => parseRequest([...flag, "--many", data]), {
      name: "UsageError",
      message: `${flag[0]} cannot be combined with --many`,
    });
  }
  assert.equal(parseRequest(["--many", data, "--set", "projection=sphere"])?.many, true);
});

test("a stitch that is measured is one on the plane, whatever its options say", () => {
  const options = onPlane({ seed: 2, projection: "sphere", worker: true });
  assert.deepEqual(options, { seed: 2, projection: "plane", worker: false });
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
  assert.equal(mean([1, Infinity]), Infinity);
  assert.equal(mean([null]), undefined);
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
  const failed = {
    ...UNMEASURED,
    case: "b-2",
    mode: "paper",
    failed: "no-overlap",
    ms: {},
    warnings: [],
  };
  assert.equal(check([row("b-1", 1, 1, 0.9), failed]).short.length, 1, "the mean of those left");
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
