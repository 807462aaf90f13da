import { randomUUID } from "node:crypto";
import { access, constants, open, realpath, rename, rm, stat, writeFile } from "node:fs/promises";
import { basename, dirname, join } from "node:path";

import { FileError, systemCode } from "../cases/errors.js";
import { nameOf, systemPath } from "../cases/file-names.js";

/** A file to be written, first to `temporary` in the same folder. */
interface Pending {
  readonly path: string;
  /** Undefined for devices and pipes, which are written directly. */
  readonly temporary: string | undefined;
}

/** Output files that are replaced together once all are complete, or not at all. */
export interface OutputFiles {
  /** Writes all files, then renames them to their paths. */
  readonly commit: (contents: ReadonlyMap<string, Uint8Array>) => Promise<void>;
  /** Deletes all temporary files. */
  readonly discard: () => Promise<void>;
}

/**
 * Checks that every path can be written, by creating an empty temporary file in its folder.
 *
 * @throws {FileError} `not-writable`.
 */
export async function openOutputs(paths: readonly string[]): Promise<OutputFiles> {
  const pending: Pending[] = [];
  const discard = async (): Promise<void> => {
    await Promise.all(
      pending.map(({ temporary }) => temporary && rm(systemPath(temporary), { force: true })),
    );
  };
  const commit = async (contents: ReadonlyMap<string, Uint8Array>): Promise<void> => {
    for (const { path, temporary } of pending) {
      await writing(path, () =>
        writeFile(systemPath(temporary ?? path), contents.get(path) ?? new Uint8Array()),
      );
    }
    for (const { path, temporary } of pending) {
      if (!temporary) continue;
      await writing(path, async () =>
        rename(systemPath(temporary), systemPath(await target(path))),
      );
    }
  };
  try {
    for (const path of paths) {
      await writing(path, async () => pending.push({ path, temporary: await openTemporary(path) }));
    }
  } catch (error) {
    await discard();
    throw error;
  }
  return { commit, discard };
}

async function openTemporary(path: string): Promise<string | undefined> {
  const existing = await stat(systemPath(path)).catch(() => undefined);
  if (existing?.isDirectory()) throw new FileError("not-writable", path, "is a folder");
  if (existing) await access(systemPath(path), constants.W_OK);
  if (existing && !existing.isFile()) return undefined;
  const place = await target(path);
  const temporary = join(dirname(place), `.${basename(place)}.${randomUUID()}.tmp`);
  await (await open(systemPath(temporary), "wx")).close();
  return temporary;
}

/** Resolves symbolic links, so that the file that a link points to is replaced rather than the link. */
async function target(path: string): Promise<string> {
  return realpath(systemPath(path), "buffer").then(nameOf, () => path);
}

async function writing<T>(path: string, write: () => Promise<T>): Promise<T> {
  try {
    return await write();
  } catch (error) {
    if (error instanceof FileError) throw error;
    const code = systemCode(error);
    const reason =
      code === "ENOENT" ? "no such folder" : `cannot be written (${code ?? String(error)})`;
    throw new FileError("not-writable", path, reason, { cause: error });
  }
}
