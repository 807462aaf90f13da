import { type ErrorRecord, isErrorRecord, StitchError } from "./errors.js";

/** The functions that every module of wasm-bindgen has. */
interface Glue {
  default(input: { module_or_path: WebAssembly.Module }): Promise<unknown>;
  __wbg_reset_state(): void;
}

/** A module of wasm-bindgen on this thread, started once and started afresh after a call that broke it. */
export interface Instance<G> {
  start(module: WebAssembly.Module): Promise<void>;
  /** Calls into the started module; whatever goes wrong comes out as a {@link StitchError}. */
  call<T>(work: (glue: G) => T): T;
}

export function instance<G extends Glue>(glue: G): Instance<G> {
  let started: Promise<void> | undefined;
  let broken = false;
  return {
    start(module) {
      started ??= glue.default({ module_or_path: module }).then(
        () => undefined,
        (cause: unknown) => {
          started = undefined;
          throw new StitchError(recordOf(cause), { cause });
        },
      );
      return started;
    },
    call(work) {
      try {
        if (broken) glue.__wbg_reset_state();
        broken = false;
        return work(glue);
      } catch (cause) {
        // A typed error went through Rust's own returns. After anything else (a trap, an exception that crossed
        // Rust's frames) memory and stack of the instance are in an unknown state.
        broken = !isErrorRecord(cause);
        throw new StitchError(recordOf(cause), { cause });
      }
    },
  };
}

/** What to tell of anything that was thrown. */
export function recordOf(cause: unknown): ErrorRecord {
  if (isErrorRecord(cause)) {
    return {
      code: cause.code,
      stage: cause.stage,
      message: cause.message,
      details: { ...cause.details },
    };
  }
  const reason = cause instanceof Error ? cause.message : String(cause);
  // The engine refuses memory with a range error; the core's own refusals are typed.
  const refused = cause instanceof RangeError && /memory|alloc/i.test(reason);
  return {
    code: refused ? "out-of-memory" : "internal",
    stage: "input",
    message: `the core stopped unexpectedly: ${reason}`,
    details: {},
  };
}
