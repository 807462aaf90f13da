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

/** What ends a program from outside. */
const SIGNALS = ["SIGINT", "SIGTERM", "SIGHUP"] as const;

/**
 * Checks that every path can be written, by creating an empty temporary file in its folder.
 *
 * @throws {FileError} `not-writable`.
 */
export function checkOutputs(paths: readonly string[]): Promise<void> {
  return withTemporaries(paths, () => Promise.resolve());
}

/**
 * Writes files by their paths. They replace what is there together once all are complete, or not at all.
 *
 * @throws {FileError} `not-writable`.
 */
export function writeOutputs(contents: ReadonlyMap<string, Uint8Array>): Promise<void> {
  return withTemporaries([...contents.keys()], async (pending, signal) => {
    for (const { path, temporary } of pending) {
      await writing(path, () =>
        writeFile(systemPath(temporary ?? path), contents.get(path) ?? new Uint8Array(), {
          signal,
        }),
      );
    }
    for (const { path, temporary } of pending) {
      if (!temporary) continue;
      await writing(path, async () =>
        rename(systemPath(temporary), systemPath(await target(path))),
      );
    }
  });
}

/**
 * Works with a temporary file for each path, and deletes those that are left. Only for that long a signal is held up, which otherwise ends the
 * program at once, whatever keeps its thread busy; a second one ends it even then.
 */
async function withTemporaries(
  paths: readonly string[],
  work: (pending: readonly Pending[], signal: AbortSignal) => Promise<void>,
): Promise<void> {
  const pending: Pending[] = [];
  const controller = new AbortController();
  const { signal } = controller;
  const interrupt = (name: NodeJS.Signals): void => controller.abort(name);
  for (const name of SIGNALS) process.once(name, interrupt);
  try {
    for (const path of paths) {
      await writing(path, async () => pending.push({ path, temporary: await openTemporary(path) }));
    }
    await work(pending, signal);
  } finally {
    await Promise.all(
      pending.map(({ temporary }) => temporary && rm(systemPath(temporary), { force: true })),
    );
    for (const name of SIGNALS) process.off(name, interrupt);
    if (signal.aborted) process.kill(process.pid, signal.reason as NodeJS.Signals);
  }
}

async function openTemporary(path: string): Promise<string | undefined> {
  const existing = await stat(systemPath(path)).catch((error: unknown) => {
    if (systemCode(error) !== "ENOENT") throw error;
  });
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
