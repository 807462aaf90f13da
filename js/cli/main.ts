#!/usr/bin/env node
import { systemCode } from "../cases/errors.js";
import { run } from "./run.js";

// A reader of our output may close the pipe, as `head` does; this is not an error.
for (const stream of [process.stdout, process.stderr]) {
  stream.on("error", (error) => {
    if (systemCode(error) !== "EPIPE") throw error;
  });
}

process.exitCode = await run(process.argv.slice(2));
