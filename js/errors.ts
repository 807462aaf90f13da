import type { Stage } from "./wasm/types.js";

/** What went wrong. Stable: programs may switch on it. */
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
  /** One of the package's own files, the wasm module or the worker, could not be loaded. */
  | "load-failed"
  /** A bug in depthstitch, never in the input. The next call starts from a fresh core. */
  | "internal"
  | "aborted";

/** Where: a stage of the pipeline, or one of the helpers around it. */
export type ErrorStage = Stage | "codecs" | "load" | "model";

/** The parts of a {@link StitchError} that survive a trip between threads. */
export interface ErrorRecord {
  code: ErrorCode;
  stage: ErrorStage;
  message: string;
  /** The numbers behind the error, by name: how many matches, how many inliers, how many bytes. */
  details: Record<string, number>;
}

/** Every error of this package. An aborted call rejects with one whose `name` is `"AbortError"`, as `fetch` does. */
export class StitchError extends Error {
  readonly code: ErrorCode;
  readonly stage: ErrorStage;
  /** The numbers behind the error, by name: how many matches, how many inliers, how many bytes. */
  readonly details: Readonly<Record<string, number>>;

  constructor({ code, stage, message, details }: ErrorRecord, options?: ErrorOptions) {
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
    message: "stopped by the caller",
    details: {},
  };
  return new StitchError(record, { cause: signal.reason });
}

export function invalid(message: string, details: Record<string, number> = {}): StitchError {
  return new StitchError({ code: "invalid-argument", stage: "input", message, details });
}

/** Whether `value` is an error as the wasm modules throw them: an `Error` with `code`, `stage` and `details`. */
export function isErrorRecord(value: unknown): value is Error & ErrorRecord {
  return value instanceof Error && "code" in value && "stage" in value && "details" in value;
}
