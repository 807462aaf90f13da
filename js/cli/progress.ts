import { basename } from "node:path";

import type { Progress } from "../index.js";

/** Where progress is shown: stderr, or a stand-in for it. */
export interface Terminal {
  readonly isTTY?: boolean;
  write(text: string): unknown;
}

/** Shows how far the work has come. */
export interface ProgressLine {
  readonly show: (progress: Progress) => void;
  /** Shows a step that is not a stage of the pipeline, such as reading files. */
  readonly message: (text: string) => void;
  /** Clears the line. */
  readonly clear: () => void;
}

/** Shows progress as one updated line on a terminal, as one line per stage elsewhere, or not at all. */
export function progressLine(terminal: Terminal, enabled: boolean): ProgressLine {
  let shown = "";
  const write = (text: string): void => {
    if (!enabled || text === shown) return;
    shown = text;
    terminal.write(terminal.isTTY ? `\r\x1b[K${text}` : `${text}\n`);
  };
  return {
    show: ({ stage, fraction }) =>
      write(terminal.isTTY ? `${stage} ${Math.round(100 * fraction)} %` : stage),
    message: write,
    clear: () => {
      if (enabled && terminal.isTTY && shown !== "") terminal.write("\r\x1b[K");
      shown = "";
    },
  };
}

/** Says which of these files is read, each time it is called. */
export function readingOf(files: readonly string[], line: ProgressLine): (path: string) => void {
  let count = 0;
  return (path) => line.message(`reading ${basename(path)} (${++count} of ${files.length})`);
}
