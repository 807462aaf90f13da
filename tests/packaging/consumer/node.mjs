import { readFile } from "node:fs/promises";
import { digest } from "./digest.mjs";

console.log(
  await digest(async (name) => Uint8Array.from(await readFile(`web/public/${name}`)).buffer),
);
