import { existsSync } from "node:fs";
import { writeFile } from "node:fs/promises";
import { cpus } from "node:os";
import { join } from "node:path";
import { parseArgs } from "node:util";

import { CASE_FILE, loadCase } from "../cases/case.js";
import { nativeTimes, renderMany, renderSample } from "./cargo.js";
import { measureMany, timeMany, type ManyScale } from "./many.js";
import { measureScale, type Scale } from "./scaling.js";
import { STAGES, METHODS, timeStages, timeWhole, type Times, type Method } from "./stages.js";

const HELP = `Usage: npm run bench -- [options]

Times the built wasm in Node, on one thread, and the whole in one worker and in two: medians in milliseconds.

  --runs N        runs per stage after the warm-up [15]
  --data DIR      folder with the case nis-PTS_17 [$DEPTHSTITCH_DATA]; skipped if missing
  --no-native     skip the native counterpart
  --no-scaling    skip the measurement over image sizes
  --no-many       skip the measurement of many photos, which are rendered the first time: that takes minutes
  --many-only     measure nothing else
  --json FILE     write the numbers there as JSON
`;

const REAL_CASE = "nis-PTS_17";
const SAMPLE = { width: 1000, height: 662 };
const MEGAPIXELS = [0.25, 1, 3, 6, 12];
/** Without depth maps, which take more than the default limit allows. */
const LARGEST = 24;
const LABELS: Readonly<Record<Method, string>> = {
  paper: "published method",
  depth: "with depth maps",
  photos: "two photos alone",
};
/** Sets of many photos: the size that they are rendered in, and how many of them are stitched. */
const SETS = [
  { width: 1732, height: 1155, photos: 5, counts: [5] },
  { width: 1225, height: 816, photos: 30, counts: [5, 10, 20, 30] },
] as const;
const MANY_STAGES = ["detect", "match", "estimate", "depth", "warp", "blend", "fill"] as const;
/** Large photos take seconds each. */
const SCALING_RUNS = 3;
const WARM_UP = 3;

interface Timing {
  readonly case: string;
  readonly method: Method;
  readonly wasm: Times;
  readonly native: Times | undefined;
  /** Milliseconds of the whole call in one worker, and in two. */
  readonly workers: readonly number[];
}

const { values: flags } = parseArgs({
  options: {
    runs: { type: "string", default: "15" },
    data: { type: "string", default: process.env.DEPTHSTITCH_DATA ?? "" },
    "no-native": { type: "boolean", default: false },
    "no-scaling": { type: "boolean", default: false },
    "no-many": { type: "boolean", default: false },
    "many-only": { type: "boolean", default: false },
    json: { type: "string" },
    help: { type: "boolean", default: false },
  },
});

if (flags.help) {
  process.stdout.write(HELP);
} else {
  const runs = Number(flags.runs);
  if (!Number.isInteger(runs) || runs < 1)
    throw new RangeError(`--runs must be an integer above 0, got ${flags.runs}`);
  const only = flags["many-only"];
  const timings = only ? [] : await timeCases(runs);
  const scaling = only || flags["no-scaling"] ? [] : await scale();
  const many = flags["no-many"] ? [] : await scaleMany();
  if (flags.json) {
    const machine = {
      node: process.version,
      cpu: cpus()[0]?.model,
      platform: `${process.platform} ${process.arch}`,
    };
    await writeFile(
      flags.json,
      `${JSON.stringify({ machine, runs, timings, scaling, many }, null, 1)}\n`,
    );
  }
}

async function timeCases(runs: number): Promise<Timing[]> {
  const folders = new Map([["sample", await renderSample(SAMPLE.width, SAMPLE.height)]]);
  const real = join(flags.data, REAL_CASE);
  if (existsSync(join(real, CASE_FILE))) folders.set(REAL_CASE, real);
  else print(`${REAL_CASE}: skipped, not in ${flags.data || "DEPTHSTITCH_DATA, which is not set"}`);

  const timings: Timing[] = [];
  for (const [name, folder] of folders) {
    const pair = await loadCase(folder);
    for (const method of METHODS) {
      const { width, height } = pair.target;
      print(`${name}, ${LABELS[method]} (${width}×${height}, median of ${runs})`);
      const wasm = await timeStages(pair, method, runs, WARM_UP);
      const native = flags["no-native"] ? undefined : await nativeTimes(folder, method, runs);
      const workers = [
        await timeWhole(pair, method, 1, runs, WARM_UP),
        await timeWhole(pair, method, 2, runs, WARM_UP),
      ];
      const timing = { case: name, method, wasm, native, workers };
      for (const line of timingLines(timing)) print(line);
      timings.push(timing);
    }
  }
  return timings;
}

function timingLines({ wasm, native, workers }: Timing): string[] {
  const header = columns("stage", ["wasm ms", ...(native ? ["native ms", "ratio"] : [])]);
  const rows = STAGES.flatMap((stage) => {
    const [ours, theirs] = [wasm[stage], native?.[stage]];
    if (ours === undefined) return [];
    const ratio = theirs === undefined ? [] : [theirs.toFixed(2), (ours / theirs).toFixed(2)];
    return columns(stage, [ours.toFixed(2), ...ratio]);
  });
  const shared = workers.map((ms, i) =>
    columns(`${i + 1} worker${i > 0 ? "s" : ""}`, [ms.toFixed(2)]),
  );
  return [header, ...rows, ...shared, ""];
}

async function scale(): Promise<Scale[]> {
  const scales: Scale[] = [];
  for (const method of METHODS) scales.push(...(await scaleOf(method)));
  return scales;
}

async function scaleOf(method: Method): Promise<Scale[]> {
  print(`whole stitch by size, ${LABELS[method]} (sample, median of ${SCALING_RUNS})`);
  print(columns("MP", ["ms", "ms/MP", "peak MiB", "MiB/MP", "predicted", "off %"]));
  const scales: Scale[] = [];
  for (const wanted of method === "photos" ? [...MEGAPIXELS, LARGEST] : MEGAPIXELS) {
    const width = Math.round(Math.sqrt((wanted * 1e6 * SAMPLE.width) / SAMPLE.height));
    const height = Math.round((width * SAMPLE.height) / SAMPLE.width);
    const found = await measureScale(await renderSample(width, height), method, SCALING_RUNS);
    const { megapixels, ms, memory, predicted } = found;
    const mebibytes = memory / 2 ** 20;
    const numbers = [
      ms,
      ms / megapixels,
      mebibytes,
      mebibytes / megapixels,
      predicted / 2 ** 20,
      100 * (predicted / memory - 1),
    ];
    print(
      columns(
        megapixels.toFixed(2),
        numbers.map((value) => value.toFixed(0)),
      ),
    );
    scales.push(found);
  }
  print("");
  return scales;
}

async function scaleMany(): Promise<ManyScale[]> {
  print("many photos (gallery, walking past; one run)");
  const headings = ["used", "s", "CPU s", "s/photo", "peak MiB", "at first", "predicted", "off %"];
  print(columns("photos", [...headings, ...MANY_STAGES.map((stage) => `${stage} s`)]));
  const scales: ManyScale[] = [];
  for (const { width, height, photos, counts } of SETS) {
    const folder = await renderMany(width, height, photos);
    for (const count of counts) {
      const found = await measureMany(folder, count);
      const { used, ms, megapixels, memory, predicted, processor, times } = found;
      const [first = NaN, last = first] = [predicted[0], predicted.at(-1)];
      const stages = MANY_STAGES.map((stage) => ((times[stage] ?? 0) / 1000).toFixed(1));
      const numbers = [
        String(used),
        (ms / 1000).toFixed(1),
        processor.toFixed(1),
        (ms / 1000 / count).toFixed(2),
        (memory / 2 ** 20).toFixed(0),
        (first / 2 ** 20).toFixed(0),
        (last / 2 ** 20).toFixed(0),
        (100 * (last / memory - 1)).toFixed(0),
      ];
      print(columns(`${count}×${(megapixels / count).toFixed(0)} MP`, [...numbers, ...stages]));
      scales.push(found);
    }
    const [count] = counts;
    const times = [await timeMany(folder, count, 1), await timeMany(folder, count, 2)];
    const [one, two] = times.map((ms) => (ms / 1000).toFixed(1));
    print(`the first ${count} in one worker ${one} s, in two ${two} s`);
  }
  print("");
  return scales;
}

function columns(name: string, cells: readonly string[]): string {
  return [name.padEnd(8), ...cells.map((cell) => cell.padStart(9))].join("  ");
}

function print(text: string): void {
  process.stdout.write(`${text}\n`);
}
