import { access, mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { basename, join, resolve } from "node:path";

import { CASE_FILE } from "../cases/case.js";
import { systemCode } from "../cases/errors.js";
import { UsageError } from "../cli/usage.js";
import { encodePng } from "../codecs.js";
import type { StitchResult } from "../index.js";
import { HELP, parseRequest, type Request } from "./arguments.js";
import { evaluate, type Row } from "./evaluate.js";
import { checkFloors, readFloors } from "./floors.js";
import { MANY, evaluateSet } from "./many/evaluate.js";
import { perceptualDistance, type PerceptualDistance } from "./lpips.js";
import { Sheet } from "./sheet.js";
import { means } from "./summarise.js";
import { tableLines } from "./table.js";

/** Runs the evaluation that the command line (without `node` and the script) asks for; returns the exit code. */
export async function run(args: readonly string[]): Promise<number> {
  try {
    const request = parseRequest(args);
    if (request) return await runRequest(request);
    print(HELP.trimEnd());
    return 0;
  } catch (error) {
    if (!(error instanceof UsageError)) throw error;
    process.stderr.write(`eval: ${error.message.replaceAll(/\s+/g, " ")}\n`);
    return 2;
  }
}

async function runRequest(request: Request): Promise<number> {
  const folders = await caseFolders(request.data, request.wanted);
  const lines = tableLines(Math.max(...folders.map(({ name }) => name.length), 12), request.groups);
  if (request.out) await mkdir(request.out, { recursive: true });
  const sheet = request.sheet === undefined ? undefined : new Sheet();
  const rows = await (request.many ? sets : pairs)(request, folders, lines, sheet);
  if (sheet && request.sheet) await writeFile(request.sheet, await encodePng(sheet.draw()));
  if (request.json) await writeFile(request.json, `${JSON.stringify(rows, rounded, 1)}\n`);
  if (request.check) return check(request, rows);
  return rows.some(({ failed }) => failed === undefined) ? 0 : 1;
}

type Lines = ReturnType<typeof tableLines>;

/** Evaluates sets of photos. */
async function sets(
  request: Request,
  folders: readonly CaseFolder[],
  lines: Lines,
  sheet: Sheet | undefined,
): Promise<Row[]> {
  print(lines.header);
  const rows: Row[] = [];
  for (const { name, path } of folders) {
    const { row, photos, result } = await evaluateSet(path, name, request);
    rows.push(row);
    print(lines.row(row));
    if (sheet && result) sheet.addSet(row, photos, result.mosaic);
    if (request.out && result)
      await writeFile(join(request.out, `${name}.png`), await encodePng(result.mosaic));
  }
  for (const mean of means(rows)) print(lines.mean(mean));
  return rows;
}

/** Evaluates pairs, in one mode after another. */
async function pairs(
  request: Request,
  folders: readonly CaseFolder[],
  lines: Lines,
  sheet: Sheet | undefined,
): Promise<Row[]> {
  const distance = request.lpips === undefined ? undefined : await network(request.lpips);
  const task = { ...request, distance, pictures: Boolean(request.out ?? request.sheet) };

  const rows: Row[] = [];
  for (const [modeName, mode] of request.modes) {
    print(`${modeName}\n${lines.header}`);
    for (const { name, path } of folders) {
      const { row, input, result } = await evaluate(path, name, modeName, mode, task);
      rows.push(row);
      print(lines.row(row));
      if (sheet && input && result) sheet.add(row, input, result);
      if (request.out && result) await writePictures(request.out, `${name}_${modeName}`, result);
    }
    for (const mean of means(rows.filter((row) => row.mode === modeName))) print(lines.mean(mean));
    print("");
  }
  await distance?.dispose();
  return rows;
}

/** Compares with the floors: 0 when every number holds, 1 when one falls short or there was nothing to compare. */
async function check(request: Request, rows: readonly Row[]): Promise<number> {
  const floors = await readFloors();
  let checked = 0;
  let short = 0;
  const modes = request.many ? [MANY] : request.modes.map(([name]) => name);
  for (const modeName of modes) {
    const ofMode = rows.filter((row) => row.mode === modeName);
    const name = request.ownMatches ? `${modeName}+own` : modeName;
    const found = checkFloors(floors, name, ofMode, means(ofMode), request.groups);
    checked += found.checked;
    short += found.short.length;
    for (const line of found.short) print(`short: ${line}`);
  }
  print(`${checked} rows with a floor, ${short} numbers fall short`);
  return checked > 0 && short === 0 ? 0 : 1;
}

async function network(path: string): Promise<PerceptualDistance> {
  const bytes = await readFile(path).catch((error: unknown) => {
    throw new UsageError(`--lpips ${path}: cannot be read (${systemCode(error) ?? String(error)})`);
  });
  return perceptualDistance(bytes);
}

interface CaseFolder {
  readonly name: string;
  readonly path: string;
}

async function caseFolders(data: string, wanted: (name: string) => boolean): Promise<CaseFolder[]> {
  if (await exists(join(data, CASE_FILE))) return [{ name: basename(resolve(data)), path: data }];
  const entries = await readdir(data).catch((error: unknown) => {
    throw new UsageError(`--data ${data}: cannot be read (${systemCode(error) ?? String(error)})`);
  });
  const found: CaseFolder[] = [];
  for (const name of entries.filter(wanted).sort()) {
    const path = join(data, name);
    if (await exists(join(path, CASE_FILE))) found.push({ name, path });
  }
  if (found.length === 0)
    throw new UsageError(`--data ${data}: no case folder that --cases asks for`);
  return found;
}

async function exists(path: string): Promise<boolean> {
  return access(path).then(
    () => true,
    () => false,
  );
}

async function writePictures(
  folder: string,
  name: string,
  { mosaic, warped }: StitchResult,
): Promise<void> {
  await writeFile(join(folder, `${name}_mosaic.png`), await encodePng(mosaic));
  await writeFile(join(folder, `${name}_warped.png`), await encodePng(warped));
}

/** Four decimals: more than any of the measures is good for. */
function rounded(_key: string, value: unknown): unknown {
  return typeof value === "number" ? Number(value.toFixed(4)) : value;
}

function print(text: string): void {
  process.stdout.write(`${text}\n`);
}
