import type { Stage } from "./wasm/types.js";

/** What went wrong. The codes are stable. */
export type ErrorCode =
  | "invalid-argument"
  | "size-mismatch"
  | "too-few-matches"
  | "no-consensus"
  | "degenerate-geometry"
  | "no-overlap"
  | "too-large"
  | "out-of-memory"
  | "decode-failed"
  | "model-load-failed"
  /** The wasm module or the worker could not be loaded. */
  | "load-failed"
  /** A bug in depthstitch. The next call starts with a fresh instance of the core. */
  | "internal"
  | "aborted";

/** Where it went wrong: in a stage of the pipeline, or in loading code or a network. */
export type ErrorStage = Stage | "codecs" | "load" | "model";

/** The parts of a {@link StitchError} that can be sent between threads. */
export interface ErrorRecord {
  code: ErrorCode;
  stage: ErrorStage;
  message: string;
  /** The numbers that caused the error, by name, such as counts of matches or bytes. */
  details: Record<string, number>;
}

/** The error type of this package. As with `fetch`, aborted calls reject with an error named `"AbortError"`. */
export class StitchError extends Error {
  readonly code: ErrorCode;
  readonly stage: ErrorStage;
  /** The numbers that caused the error, by name, such as counts of matches or bytes. */
  readonly details: Readonly<Record<string, number>>;

  constructor({ code, stage, message, details }: ErrorRecord, options?: { cause?: unknown }) {
    super(message, options);
    this.name = code === "aborted" ? "AbortError" : "StitchError";
    this.code = code;
    this.stage = stage;
    this.details = details;
  }
}

/** The error of a call whose signal was aborted; `cause` is the signal's reason. */
export function abortError(signal: AbortSignal): StitchError {
  const record: ErrorRecord = {
    code: "aborted",
    stage: "input",
    message: "aborted by the caller",
    details: {},
  };
  return new StitchError(record, { cause: signal.reason });
}

/** Whether the memory of the core is in an undefined state, or full, after this error. */
export function isFatal({ code }: Pick<StitchError, "code">): boolean {
  return code === "internal" || code === "load-failed" || code === "out-of-memory";
}

/** An `invalid-argument` error. */
export function invalid(
  message: string,
  details: Record<string, number> = {},
  options?: { cause?: unknown },
): StitchError {
  return new StitchError({ code: "invalid-argument", stage: "input", message, details }, options);
}

/** Whether `value` is an error thrown by the wasm modules: an `Error` with `code`, `stage` and `details`. */
export function isErrorRecord(value: unknown): value is Error & ErrorRecord {
  return value instanceof Error && "code" in value && "stage" in value && "details" in value;
}
