#!/usr/bin/env node
import { systemCode } from "../cases/errors.js";
import { run } from "./run.js";

// Whoever reads our output may stop reading, as `head` does: no reason to fail.
for (const stream of [process.stdout, process.stderr]) {
  stream.on("error", (error) => {
    if (systemCode(error) !== "EPIPE") throw error;
  });
}

process.exitCode = await run(process.argv.slice(2));
