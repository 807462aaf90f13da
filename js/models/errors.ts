import { StitchError } from "../errors.js";

/** The error of a network that could not be fetched, prepared or run. */
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

/** What a cause says of itself; runtimes throw numbers and strings, too. */
export function reasonOf(cause: unknown): string {
  if (!(cause instanceof Error)) return String(cause);
  const inner = cause.cause instanceof Error ? ` (${cause.cause.message})` : "";
  return cause.message + inner;
}

/** The error of a package that is not installed: which, and how to get it. */
export function missingPackage(name: string, cause: unknown): StitchError {
  return modelError(
    `this needs the package ${name}, which could not be loaded: npm install ${name}`,
    cause,
  );
}
