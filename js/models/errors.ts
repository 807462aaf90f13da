import { StitchError } from "../errors.js";

/** A `model-load-failed` error: a network could not be fetched, initialized or run. */
export function modelError(
  message: string,
  cause?: unknown,
  details: Record<string, number> = {},
): StitchError {
  const reason = cause === undefined ? "" : `: ${reasonOf(cause)}`;
  return new StitchError(
    { code: "model-load-failed", stage: "model", message: message + reason, details },
    { cause },
  );
}

/** The message of a cause; runtimes also throw numbers and strings. */
function reasonOf(cause: unknown): string {
  if (!(cause instanceof Error)) return String(cause);
  const inner = cause.cause instanceof Error ? ` (${cause.cause.message})` : "";
  return cause.message + inner;
}

/** The error for a peer dependency that is not installed. */
export function missingPackage(name: string, cause: unknown): StitchError {
  return modelError(
    `this needs the package ${name}, which could not be loaded: npm install ${name}`,
    cause,
  );
}
