#!/usr/bin/env node
import { readFileSync } from "node:fs";

import { systemCode } from "../cases/errors.js";
import { nameOf } from "../cases/file-names.js";
import { printError, run } from "./run.js";

/** The arguments. Node replaces bytes that are not UTF-8, so such names are read from the system. */
function givenArguments(): string[] {
  const args = process.argv.slice(2);
  if (process.platform !== "linux" || !args.some((arg) => arg.includes("\ufffd"))) return args;
  const all = readFileSync("/proc/self/cmdline").toString("latin1").split("\0").slice(0, -1);
  return all.slice(-args.length).map((arg) => nameOf(Buffer.from(arg, "latin1")));
}

let lost = false;
for (const stream of [process.stdout, process.stderr]) {
  stream.on("error", (error) => {
    // A reader of our output may close the pipe, as `head` does; this is not an error.
    const code = systemCode(error);
    if (code === "EPIPE") return;
    lost = true;
    process.exitCode = 1;
    if (stream === process.stdout) printError(`not-writable: standard output (${code})`);
  });
}

const status = await run(givenArguments());
process.exitCode = lost ? 1 : status;
