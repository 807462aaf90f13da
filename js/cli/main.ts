#!/usr/bin/env node
import { systemCode } from "../cases/errors.js";
import { printError, run } from "./run.js";

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

const status = await run(process.argv.slice(2));
process.exitCode = lost ? 1 : status;
