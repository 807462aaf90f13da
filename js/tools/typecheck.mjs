// Type checks the package, the page, the scripts and the tests.
import { join } from "node:path";
import { isMain, npmBin, root, run } from "./shared.mjs";

const projects = ["tsconfig.json", "tsconfig.tests.json", join("www", "tsconfig.json")];

export function typecheck() {
  for (const project of projects) {
    run(process.execPath, [npmBin("typescript-7", "tsc"), "--noEmit", "-p", join(root, project)]);
  }
}

if (isMain(import.meta.url)) typecheck();
