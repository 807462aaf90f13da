/**
 * A function that reads one file after another, as each takes memory while it is decoded, and says which. None is read
 * after one that could not be, with whose error all further ones fail.
 */
export function inTurn(onFile?: (path: string) => void) {
  let last: Promise<unknown> = Promise.resolve();
  return <T>(path: string, load: (path: string) => Promise<T>): Promise<T> => {
    const next = last.then(() => {
      onFile?.(path);
      return load(path);
    });
    last = next;
    return next;
  };
}
