import type { Progress } from "../index.js";

/** Where progress is shown: stderr, or a stand-in for it. */
export interface Terminal {
  readonly isTTY?: boolean;
  write(text: string): unknown;
}

/** Shows how far the work has come. */
export interface ProgressLine {
  readonly show: (progress: Progress) => void;
  /** Says something that is no stage of the pipeline, such as reading. */
  readonly say: (text: string) => void;
  /** Leaves the line empty for what comes next. */
  readonly clear: () => void;
}

/** One line, rewritten on a terminal; a line per stage elsewhere (a log); nothing when not `enabled`. */
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
    say: write,
    clear: () => {
      if (enabled && terminal.isTTY && shown !== "") terminal.write("\r\x1b[K");
      shown = "";
    },
  };
}
