import { run } from "./calls.mjs";

/** The same in a worker of the page's own. @param {string} name @param {any} args */
function runInWorker(name, args) {
  const worker = new Worker(new URL("./worker.mjs", import.meta.url), { type: "module" });
  return new Promise((resolve, reject) => {
    worker.onmessage = ({ data }) => resolve(data);
    worker.onerror = (event) => reject(new Error(event.message));
    worker.postMessage({ name, args });
  }).finally(() => worker.terminate());
}

Object.assign(globalThis, { run, runInWorker });
document.title = "ready";
