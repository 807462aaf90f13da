import { type ErrorRecord, isErrorRecord, StitchError } from "./errors.js";

/** The functions that every module of wasm-bindgen exports. */
interface Glue {
  default(input: { module_or_path: WebAssembly.Module }): Promise<unknown>;
  __wbg_reset_state(): void;
}

/** A wasm-bindgen module on this thread. It is instantiated once, and again after a call that trapped. */
export interface Instance<G> {
  start(module: WebAssembly.Module): Promise<void>;
  /** Calls into the module. All exceptions are thrown as a {@link StitchError}. */
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
        // Typed errors are returned by Rust. After anything else (a trap, an exception that unwound Rust frames) the memory
        // and stack of the instance are in an undefined state.
        broken = !isErrorRecord(cause);
        throw new StitchError(recordOf(cause), { cause });
      }
    },
  };
}

/** Anything thrown as a record. */
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
  // Engines report failed memory growth as a RangeError; allocation failures in the core are typed errors.
  const isMemory = cause instanceof RangeError && /memory|alloc/i.test(reason);
  return {
    code: isMemory ? "out-of-memory" : "internal",
    stage: "input",
    message: `${isMemory ? "out of memory" : "the core failed unexpectedly"}: ${reason}`,
    details: {},
  };
}
