import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { summary } from "./many.mjs";

const photos = process.argv[2] ?? "";
const read = async (name) => Uint8Array.from(await readFile(join(photos, name))).buffer;
// A bundle may be CommonJS, which cannot await here.
summary(read).then(console.log);
