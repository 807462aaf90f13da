import { run } from "./calls.mjs";

globalThis.onmessage = async ({ data: { name, args } }) => {
  globalThis.postMessage(await run(name, args));
};
