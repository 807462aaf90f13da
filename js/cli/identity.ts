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

/** What the system knows a file or folder by; undefined if there is none. */
function inode(path: string): string | undefined {
  const found = statSync(systemPath(path), { bigint: true, throwIfNoEntry: false });
  return found && `${found.dev}:${found.ino}`;
}

function linkTarget(path: string): string | undefined {
  try {
    return nameOf(readlinkSync(systemPath(path), "buffer"));
  } catch {
    return undefined;
  }
}
