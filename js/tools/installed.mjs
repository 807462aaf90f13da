// Finds programs of other projects that the tests drive, and installs Debian packages where that needs no interaction.
import { accessSync, constants, existsSync } from "node:fs";
import { delimiter, join } from "node:path";
import { run } from "./shared.mjs";

/**
 * Path of an installed program, if any.
 *
 * @param {string} variable of the environment that may name it
 * @param {readonly string[]} names in the search path
 * @param {readonly string[]} [places] elsewhere
 * @throws if the variable names a file that does not exist
 */
export function findProgram(variable, names, places = []) {
  const wanted = process.env[variable];
  if (wanted) {
    if (!existsSync(wanted)) throw new Error(`${variable} names ${wanted}, which does not exist`);
    return wanted;
  }
  const folders = (process.env.PATH ?? "").split(delimiter).filter(Boolean);
  return [...folders.flatMap((folder) => names.map((name) => join(folder, name))), ...places].find(
    isExecutable,
  );
}

/** @param {string} file */
function isExecutable(file) {
  try {
    accessSync(file, constants.X_OK);
    return true;
  } catch {
    return false;
  }
}

/** Whether packages of Debian can be installed without asking anybody. */
export const hasApt = process.getuid?.() === 0 && existsSync("/usr/bin/apt-get");

let listed = false;

/** Installs packages of Debian. @param {...string} packages @throws if that fails */
export function aptInstall(...packages) {
  const env = { DEBIAN_FRONTEND: "noninteractive" };
  if (!listed) run("apt-get", ["update"], { env });
  listed = true;
  run("apt-get", ["install", "-y", "--no-install-recommends", ...packages], { env });
}
