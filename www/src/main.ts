import { defaultOptions, version } from "depthstitch";
import { byId, onClick, setEnabled } from "./dom.js";
import { bindDrop } from "./inputs/drop.js";
import { bindInputs } from "./inputs/input-cards.js";
import { InputLoader } from "./inputs/load-inputs.js";
import { bindPaste } from "./inputs/paste.js";
import { bindLeaving } from "./leaving.js";
import { bindOffline } from "./offline.js";
import { bindProgress } from "./run/progress.js";
import { bindRun, isLoading, Runner } from "./run/run.js";
import { bindSettingsLink } from "./settings-link.js";
import { initialState, noSlots, Store, swapped } from "./state.js";
import { errorMessage } from "./text/errors.js";
import { bindUndo } from "./undo.js";

const sampleFolder = new URL("./sample/", document.baseURI);

async function start(): Promise<void> {
  const store = new Store();
  const loader = new InputLoader(store);
  const runner = new Runner(store);
  bindInputs(store, loader);
  bindDrop(loader);
  bindPaste(loader);
  bindPhase(store);
  bindUndo(store);
  bindProgress(store);
  bindRun(store, runner, loader);
  bindHead(store, loader, runner);
  bindLeaving(store);
  bindOffline();
  try {
    const [defaults, packageVersion] = await Promise.all([defaultOptions(), version()]);
    bindSettingsLink(store);
    byId("version", HTMLElement).textContent = `depthstitch ${packageVersion}`;
    if (new URLSearchParams(location.search).has("sample")) void loader.loadSample(sampleFolder);
    // Settings and results are loaded with the first photo.
    await new Promise<void>((resolve) =>
      store.subscribe(({ loading, slots, set }) => {
        if (loading.size > 0 || slots.target || slots.reference || set) resolve();
      }),
    );
    const [{ bindPanels }, sets] = await Promise.all([
      import("./panels/bind-all.js"),
      loader.sets(),
    ]);
    bindPanels(store, loader, runner, defaults, packageVersion, sets);
  } catch (error) {
    store.set({ status: "Not ready", message: errorMessage(error) });
  }
}

/**
 * The page starts with the photos only; once there are two or more, results and settings are shown: those of two photos
 * (`pair`) or of more (`many`).
 */
function bindPhase(store: Store): void {
  const { dataset } = document.body;
  store.subscribe((state) => {
    const { slots, set, outcome } = state;
    dataset["loading"] = String(isLoading(state));
    const complete = set !== null || (slots.target !== null && slots.reference !== null);
    const phase = outcome !== null || complete ? "work" : "start";
    dataset["phase"] = phase;
    // What was pressed goes with the start. The focus follows in the frame that lays out the page anyway.
    if (phase === "work" && document.activeElement?.closest(".only-start")) {
      requestAnimationFrame(() => byId("results", HTMLElement).focus({ preventScroll: true }));
    }
    dataset["photos"] = set ? "many" : "pair";
    dataset["result"] = outcome?.kind ?? (set ? "many" : "pair");
  });
}

function bindHead(store: Store, loader: InputLoader, runner: Runner): void {
  const swap = byId("swap", HTMLButtonElement);
  onClick(swap, () => store.set({ slots: swapped(store.state.slots), problems: {} }));
  for (const id of ["load-sample", "start-sample"]) {
    onClick(byId(id, HTMLButtonElement), () => void loader.loadSample(sampleFolder));
  }
  onClick(byId("clear-inputs", HTMLButtonElement), () => {
    const before = store.state;
    runner.giveUp();
    loader.cancel();
    const { settings } = store.state;
    const depthSource = settings.depthSource === "files" ? "photos" : settings.depthSource;
    const undo = { label: "Undo", run: () => loader.comeBack(before) };
    store.set({
      ...initialState,
      slots: noSlots,
      settings: { ...settings, depthSource, depth: initialState.settings.depth },
      undo: { text: "Photos and result were removed.", choices: [undo] },
    });
    byId("target-file", HTMLInputElement).focus();
  });
  store.subscribe(({ slots, loading }) => {
    // What is being read has its place already.
    setEnabled(swap, loading.size === 0 && (slots.target ?? slots.reference) !== null);
  });
}

void start();
