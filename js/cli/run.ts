import { join } from "node:path";
import { CASE_FILE, caseFiles } from "../cases/case.js";
import { FileError } from "../cases/errors.js";
import { StitchError, version } from "../index.js";
import {
  checkPaths,
  inputPaths,
  outputPaths,
  parseCommand,
  type StitchCommand,
  type StitchManyCommand,
} from "./arguments.js";
import { helpText } from "./help.js";
import { stitchManyFiles } from "./many.js";
import { checkOutputs, writeOutputs } from "./output.js";
import { stitchPairFiles } from "./pair.js";
import { encoded, type Stitched } from "./produced.js";
import { progressLine, type ProgressLine } from "./progress.js";
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
  await produce(command, (line) => stitchPairFiles(command, files, line));
}

/** Writes what `work` makes, and says so. */
async function produce(
  command: StitchCommand | StitchManyCommand,
  work: (line: ProgressLine) => Promise<Stitched>,
): Promise<void> {
  const { outputs, quiet, progress } = command;
  const line = progressLine(process.stderr, !quiet && (progress ?? process.stderr.isTTY));
  await checkOutputs(outputPaths(outputs));
  try {
    const stitched = await work(line);
    line.message("writing");
    const { contents, warnings, summary } = await encoded(command, stitched);
    await writeOutputs(contents);
    line.clear();
    if (quiet) return;
    for (const warning of warnings) printError(`warning: ${warning}`);
    process.stdout.write(`${summary}\n`);
  } finally {
    line.clear();
  }
}

/** Prints an error as one line to stderr and returns the exit code. */
function reportError(error: unknown): number {
  if (error instanceof UsageError) {
    printError(`usage: ${error.message}`);
    return USAGE;
  }
  if (error instanceof StitchError) {
    printError(`${error.code}: ${error.message}`);
    // Arguments of the core are given as flags, or are what they name: photos and cameras.
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
