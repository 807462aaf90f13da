import { caseFiles, loadPair, type PairFiles } from "../cases/case.js";
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
import { openOutputs } from "./output.js";
import type { Produced } from "./produced.js";
import { progressLine, readingOf, type ProgressLine } from "./progress.js";
import { report, summary } from "./report.js";
import { UsageError } from "./usage.js";

const OK = 0;
const FAILED = 1;
const USAGE = 2;
/** Signals that end a program from outside, with the exit codes that shells expect. */
const SIGNALS = { SIGINT: 130, SIGTERM: 143, SIGHUP: 129 } as const;
type Signal = keyof typeof SIGNALS;

/** A signal ended the command. */
class Interrupted extends Error {
  constructor(readonly signal: Signal) {
    super(`interrupted by ${signal === "SIGINT" ? "Ctrl-C" : signal}`);
  }
}

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
        await interruptible((signal) => runStitch(command, signal));
        break;
      case "stitch-many":
        await interruptible((signal) =>
          produce(command, (line) => stitchManyFiles(command, line, signal), signal),
        );
    }
    return OK;
  } catch (error) {
    return reportError(error);
  }
}

async function runStitch(command: StitchCommand, signal: AbortSignal): Promise<void> {
  const given = "case" in command.input ? await caseFiles(command.input.case) : command.input;
  const files = command.ownMatches ? { ...given, matches: null } : given;
  checkPaths(command.outputs, inputPaths(files));
  await produce(command, (line) => stitchFiles(command, files, line, signal), signal);
}

/** Writes what `work` makes, and says so. */
async function produce(
  { outputs, quiet, progress }: StitchCommand | StitchManyCommand,
  work: (line: ProgressLine) => Promise<Produced>,
  signal: AbortSignal,
): Promise<void> {
  const line = progressLine(process.stderr, !quiet && (progress ?? process.stderr.isTTY));
  const out = await openOutputs(outputPaths(outputs));
  try {
    const { contents, warnings, summary } = await work(line);
    signal.throwIfAborted();
    await out.commit(contents);
    line.clear();
    if (quiet) return;
    for (const warning of warnings) printError(`warning: ${warning}`);
    process.stdout.write(`${summary}\n`);
  } finally {
    line.clear();
    await out.discard();
  }
}

/** Reads, stitches and encodes two photos. */
async function stitchFiles(
  { settings, outputs, quality, crop: part, workers }: StitchCommand,
  files: PairFiles,
  line: ProgressLine,
  signal: AbortSignal,
): Promise<Produced> {
  const onFile = readingOf(inputPaths(files), line);
  const pair = await withDecoder(signal, (by) => loadPair(files, { signal, onFile }, by));
  const { matches, targetDepth, referenceDepth } = pair;
  const [ofTarget, ofReference] = pair.metadata;
  const photos = [
    { image: pair.target, metadata: ofTarget },
    { image: pair.reference, metadata: ofReference },
  ];
  const colours = await matchColours([files.target, files.reference], photos, 1);
  const { colourProfile } = colours;
  const [target = pair.target, reference = pair.reference] = colours.images;
  const call = { onProgress: line.show, signal, workers, transfer: true };
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

/** Runs `work` until a signal aborts it; a second one terminates the process. */
async function interruptible(work: (signal: AbortSignal) => Promise<void>): Promise<void> {
  const controller = new AbortController();
  const names = Object.keys(SIGNALS) as Signal[];
  let received: Signal | undefined;
  const interrupt = (name: Signal): void => {
    received ??= name;
    controller.abort();
  };
  for (const name of names) process.once(name, interrupt);
  try {
    await work(controller.signal);
  } catch (error) {
    throw received ? new Interrupted(received) : error;
  } finally {
    for (const name of names) process.off(name, interrupt);
  }
}

/** Prints an error as one line to stderr and returns the exit code. */
function reportError(error: unknown): number {
  if (error instanceof Interrupted) {
    printError(`aborted: ${error.message}`);
    return SIGNALS[error.signal];
  }
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
