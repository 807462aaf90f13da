import { join } from "node:path";
import { CASE_FILE, caseFiles, loadPair, type PairFiles } from "../cases/case.js";
import { FileError } from "../cases/errors.js";
import { encodeGrayPng, encodePng } from "../codecs.js";
import { StitchError, crop, defaultOptions, stitch, version } from "../index.js";
import {
  checkPaths,
  inputPaths,
  outputPaths,
  parseCommand,
  type Outputs,
  type StitchCommand,
  type StitchManyCommand,
} from "./arguments.js";
import { matchColours } from "./colours.js";
import { withDecoder } from "./decoding.js";
import { encodeImage, jsonBytes } from "./encode.js";
import { helpText } from "./help.js";
import { stitchManyFiles } from "./many.js";
import { checkOutputs, writeOutputs } from "./output.js";
import type { Produced } from "./produced.js";
import { progressLine, readingOf, type ProgressLine } from "./progress.js";
import { report, summary } from "./report.js";
import { UsageError } from "./usage.js";

const OK = 0;
const FAILED = 1;
const USAGE = 2;

/** Executes a command line (without `node` and the script) and returns the exit code. */
export async function run(args: readonly string[]): Promise<number> {
  try {
    const command = parseCommand(args);
    switch (command.kind) {
      case "help":
        process.stdout.write(helpText());
        break;
      case "version":
        process.stdout.write(`${await version()}\n`);
        break;
      case "stitch":
        await runStitch(command);
        break;
      case "stitch-many":
        await produce(command, (line) => stitchManyFiles(command, line));
    }
    return OK;
  } catch (error) {
    return reportError(error);
  }
}

async function runStitch(command: StitchCommand): Promise<void> {
  const { input } = command;
  const given = "case" in input ? await caseFiles(input.case) : input;
  const files = command.ownMatches ? { ...given, matches: null } : given;
  // Also what is not read this time: a case has to stay whole.
  const description = "case" in input ? [join(input.case, CASE_FILE)] : [];
  checkPaths(command.outputs, [...inputPaths(given), ...description]);
  await produce(command, (line) => stitchFiles(command, files, line));
}

/** Writes what `work` makes, and says so. */
async function produce(
  { outputs, quiet, progress }: StitchCommand | StitchManyCommand,
  work: (line: ProgressLine) => Promise<Produced>,
): Promise<void> {
  const line = progressLine(process.stderr, !quiet && (progress ?? process.stderr.isTTY));
  await checkOutputs(outputPaths(outputs));
  try {
    const { contents, warnings, summary } = await work(line);
    await writeOutputs(contents);
    line.clear();
    if (quiet) return;
    for (const warning of warnings) printError(`warning: ${warning}`);
    process.stdout.write(`${summary}\n`);
  } finally {
    line.clear();
  }
}

/** Reads, stitches and encodes two photos. */
async function stitchFiles(
  { settings, outputs, quality, crop: part, workers }: StitchCommand,
  files: PairFiles,
  line: ProgressLine,
): Promise<Produced> {
  const onFile = readingOf(inputPaths(files), line);
  const pair = await withDecoder((by) => loadPair(files, onFile, by));
  const { matches, targetDepth, referenceDepth } = pair;
  const [ofTarget, ofReference] = pair.metadata;
  const photos = [
    { image: pair.target, metadata: ofTarget },
    { image: pair.reference, metadata: ofReference },
  ];
  const colours = await matchColours([files.target, files.reference], photos, 1);
  const { colourProfile } = colours;
  const [target = pair.target, reference = pair.reference] = colours.images;
  const call = { onProgress: line.show, workers, transfer: true };
  const result = await stitch(target, reference, {
    ...settings,
    ...call,
    outputs: neededFor(outputs),
    matches,
    targetDepth,
    referenceDepth,
  });
  line.message("writing");
  const rect = part === "none" ? null : result.crop[part];
  const mosaic = rect ? crop(result.mosaic, rect) : result.mosaic;
  const metadata = { colourProfile, exif: colours.exif[1] ?? null };
  const encoded = await encodeImage(outputs.mosaic, mosaic, quality, metadata);
  const contents = new Map([[outputs.mosaic, encoded]]);
  if (outputs.warped)
    contents.set(outputs.warped, await encodePng(result.warped, { colourProfile }));
  if (outputs.voidMask) contents.set(outputs.voidMask, await encodeGrayPng(result.voidMask));
  if (outputs.report) {
    const options = { ...(await defaultOptions(settings.mode)), ...settings };
    const json = report(await version(), files, pair, options, outputs, result);
    contents.set(outputs.report, jsonBytes(json));
  }
  const warnings = result.report.warnings.map(({ code, message }) => `${code}: ${message}`);
  return {
    contents,
    warnings: [...colours.warnings, ...warnings],
    summary: summary(outputs, mosaic, result),
  };
}

/** The pictures and masks that the files are made of. */
function neededFor({ warped, voidMask, report }: Outputs): ("mosaic" | "warped" | "voidMask")[] {
  return [
    "mosaic",
    ...(warped ? (["warped"] as const) : []),
    ...(voidMask || report ? (["voidMask"] as const) : []),
  ];
}

/** Prints an error as one line to stderr and returns the exit code. */
function reportError(error: unknown): number {
  if (error instanceof UsageError) {
    printError(`usage: ${error.message}`);
    return USAGE;
  }
  if (error instanceof StitchError) {
    printError(`${error.code}: ${error.message}`);
    // Arguments of the core are given as flags.
    return error.code === "invalid-argument" ? USAGE : FAILED;
  }
  if (error instanceof FileError) {
    printError(`${error.code}: ${error.message}`);
    return FAILED;
  }
  printError(
    `internal: ${error instanceof Error ? (error.stack ?? error.message) : String(error)}`,
  );
  return FAILED;
}

export function printError(text: string): void {
  process.stderr.write(`depthstitch: ${text.replaceAll(/\s+/g, " ").trim()}\n`);
}
