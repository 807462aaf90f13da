/** A callback of the caller, called amid code of others: what it throws is kept, and thrown again outside of that. */
export interface Callback<A extends unknown[]> {
  /** Calls it unless it has thrown before; whether it never has. */
  call(...args: A): boolean;
  /** Throws what it has thrown, if anything. */
  rethrow(): void;
}

export function callback<A extends unknown[]>(own: (...args: A) => void): Callback<A> {
  let thrown: { error: unknown } | undefined;
  return {
    call(...args) {
      try {
        if (!thrown) own(...args);
      } catch (error) {
        thrown = { error };
      }
      return !thrown;
    },
    rethrow() {
      if (thrown) throw thrown.error;
    },
  };
}
