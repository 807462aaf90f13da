import { defaultOptions, version } from "depthstitch";
import { byId, onClick } from "./dom.js";
import { bindDrop } from "./drop.js";
import { errorMessage } from "./error-words.js";
import { bindInputs } from "./input-cards.js";
import { InputLoader } from "./load-inputs.js";
import { bindOptions } from "./options-panel.js";
import { bindResults } from "./results.js";
import { bindRun } from "./run.js";
import { initialState, slotNames, Store } from "./state.js";

const sampleFolder = new URL("./sample/", document.baseURI);

async function start(): Promise<void> {
  const store = new Store();
  const loader = new InputLoader(store);
  bindInputs(store, loader);
  bindDrop(loader);
  try {
    const [defaults, words] = await Promise.all([defaultOptions(), version()]);
    bindResults(store, words);
    const run = bindRun(store, bindOptions(defaults));
    byId("version", HTMLElement).textContent = `depthstitch ${words}`;
    onClick(byId("load-sample", HTMLButtonElement), () => void loader.loadSample(sampleFolder));
    onClick(byId("clear-inputs", HTMLButtonElement), () => {
      loader.clear(slotNames);
      store.set({ depth: initialState.depth, status: "Ready" });
    });
    if (await loader.loadSample(sampleFolder)) await run();
  } catch (error) {
    const { title, advice } = errorMessage(error);
    byId("status", HTMLElement).textContent = "Not ready";
    byId("message", HTMLElement).classList.add("error");
    byId("message", HTMLElement).textContent = `${title} ${advice}`;
  }
}

void start();
