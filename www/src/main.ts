import { defaultOptions, version } from "depthstitch";
import { byId, onClick, setEnabled } from "./dom.js";
import { bindDrop } from "./inputs/drop.js";
import { bindInputs } from "./inputs/input-cards.js";
import { InputLoader } from "./inputs/load-inputs.js";
import { bindPaste } from "./inputs/paste.js";
import { bindOffline } from "./offline.js";
import { bindProgress } from "./run/progress.js";
import { bindRun, Runner } from "./run/run.js";
import { bindSettingsLink } from "./settings-link.js";
import { initialState, noSlots, slotNames, Store, swapped } from "./state.js";
import { errorMessage } from "./text/errors.js";

const sampleFolder = new URL("./sample/", document.baseURI);

async function start(): Promise<void> {
  const store = new Store();
  const loader = new InputLoader(store);
  const runner = new Runner(store);
  bindInputs(store, loader);
  bindDrop(loader);
  bindPaste(loader);
  bindPhase(store);
  bindProgress(store);
  bindRun(store, runner);
  bindHead(store, loader, runner);
  bindOffline();
  try {
    const [defaults, packageVersion] = await Promise.all([defaultOptions(), version()]);
    bindSettingsLink(store);
    byId("version", HTMLElement).textContent = `depthstitch ${packageVersion}`;
    if (new URLSearchParams(location.search).has("sample")) void loader.loadSample(sampleFolder);
    // Settings and results are loaded with the first photo.
    await new Promise<void>((resolve) =>
      store.subscribe(({ loading, slots }) => {
        if (loading.size > 0 || slots.target || slots.reference) resolve();
      }),
    );
    const { bindPanels } = await import("./panels/bind-all.js");
    bindPanels(store, loader, runner, defaults, packageVersion);
  } catch (error) {
    store.set({ status: "Not ready", message: errorMessage(error) });
  }
}

/** The page starts with the photos only; once both are loaded, results and settings are shown. */
function bindPhase(store: Store): void {
  store.subscribe(({ slots, outcome }) => {
    const working = outcome !== null || (slots.target !== null && slots.reference !== null);
    document.body.dataset["phase"] = working ? "work" : "start";
  });
}

function bindHead(store: Store, loader: InputLoader, runner: Runner): void {
  const swap = byId("swap", HTMLButtonElement);
  onClick(swap, () => store.set({ slots: swapped(store.state.slots), problems: {} }));
  for (const id of ["load-sample", "start-sample"]) {
    onClick(byId(id, HTMLButtonElement), () => void loader.loadSample(sampleFolder));
  }
  onClick(byId("clear-inputs", HTMLButtonElement), () => {
    runner.cancel();
    loader.clear(slotNames);
    const { settings } = store.state;
    const depthSource = settings.depthSource === "files" ? "photos" : settings.depthSource;
    store.set({
      ...initialState,
      slots: noSlots,
      settings: { ...settings, depthSource, depth: initialState.settings.depth },
    });
    byId("target-file", HTMLInputElement).focus();
  });
  store.subscribe(({ slots }, before) => {
    if (slots !== before.slots || store.state === before) {
      setEnabled(swap, slots.target !== null || slots.reference !== null);
    }
  });
}

void start();
