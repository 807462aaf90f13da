import { readlinkSync, statSync } from "node:fs";
import { basename, dirname, resolve } from "node:path";

import { nameOf, systemPath } from "../cases/file-names.js";

/** Links to links to … that are followed where none of them leads to a file. */
const MOST_LINKS = 40;

/** The same for two paths exactly if they lead to the same file, through links or not; the file need not exist yet. */
export function identity(path: string): string {
  let place = resolve(path);
  for (let i = 0; i < MOST_LINKS; i++) {
    const file = inode(place);
    if (file) return file;
    const target = linkTarget(place);
    if (target === undefined) break;
    place = resolve(dirname(place), target);
  }
  return `${inode(dirname(place)) ?? dirname(place)}/${basename(place)}`;
}

/** What the system knows a file or folder by. */
function inode(path: string): string | undefined {
  return asked(() => {
    const { dev, ino } = statSync(systemPath(path), { bigint: true });
    return `${dev}:${ino}`;
  });
}

function linkTarget(path: string): string | undefined {
  return asked(() => nameOf(readlinkSync(systemPath(path), "buffer")));
}

/** What the system answers; undefined if it refuses. Why, is said when the file is read or written. */
function asked<T>(ask: () => T): T | undefined {
  try {
    return ask();
  } catch {
    return undefined;
  }
}
