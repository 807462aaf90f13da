import type { CallOptions } from "depthstitch";
import type { DepthMap, Photo } from "../image-worker/contents.js";
import type { InputLoader } from "../inputs/load-inputs.js";
import { byId, onClick, setEnabled } from "../dom.js";
import { runNetwork } from "../networks/client.js";
import type { NetworkProgress } from "../networks/requests.js";
import {
  depthNetworkOf,
  lastingMessage,
  photoSlots,
  type Outcome,
  type Settings,
  type State,
  type Store,
} from "../state.js";
import { taken } from "../image-worker/client.js";
import { errorMessage } from "../text/errors.js";
import { seconds } from "../text/numbers.js";
import { depthStatus } from "../text/networks.js";
import { filledMosaic } from "./fill.js";
import { isReading, usablePhotos } from "../many/photo-set.js";
import { prepareJob } from "./prepare.js";
import { isCached, resultOf } from "./results.js";

/** Why a run ended that nobody cancelled. */
const givenUp = Symbol();

/** Runs and cancels computations on the photos, one at a time. */
export class Runner {
  readonly #store: Store;
  /** Of the running and the queued tasks. */
  readonly #controllers = new Set<AbortController>();
  #done: Promise<void> = Promise.resolve();

  constructor(store: Store) {
    this.#store = store;
  }

  /** Ends what is running, and says so. */
  cancel(): void {
    for (const controller of this.#controllers) controller.abort();
  }

  /** Ends what is running without a word, as something else takes its place. */
  giveUp(): void {
    for (const controller of this.#controllers) controller.abort(givenUp);
  }

  /** Stitches the current inputs with the current settings, after cancelling what is running. */
  stitch(): Promise<void> {
    return this.#start((signal) => this.#stitch(this.#store.state.settings, signal));
  }

  /** The same without user action: it uses networks only if the previous result did. */
  stitchAutomatically(): Promise<void> {
    return this.#start((signal) => this.#stitch(withoutNewNetworks(this.#store.state), signal));
  }

  /** Computes something else after what is running, with the same progress and Cancel; undefined if that fails. */
  async compute<T>(work: (call: CallOptions) => Promise<T>): Promise<T | undefined> {
    let value: T | undefined;
    await this.#queue(async (signal) => {
      const { status } = this.#store.state;
      this.#store.set({ running: { stage: "input", fraction: 0 } });
      value = await work(this.#call(signal));
      const message = lastingMessage(this.#store.state);
      this.#store.set({ running: null, status, message });
    });
    return value;
  }

  /** The same, but rejects if it fails. */
  async computed<T>(work: (call: CallOptions) => Promise<T>): Promise<T> {
    const value = await this.compute(work);
    if (value === undefined) throw new Error("The computation was cancelled or has failed.");
    return value;
  }

  /**
   * Computes what a result lacks, with the same progress and Cancel. If something else runs it does not wait for that, which may need it.
   */
  readonly computeLater = async <T>(work: (call: CallOptions) => Promise<T>): Promise<T> => {
    if (this.#controllers.size === 0) return this.computed(work);
    const controller = new AbortController();
    this.#controllers.add(controller);
    try {
      return await work(this.#call(controller.signal));
    } finally {
      this.#controllers.delete(controller);
      if (this.#controllers.size === 0) this.#store.set({ running: null });
    }
  };

  /** How the core is called: with progress and Cancel. */
  #call(signal: AbortSignal): CallOptions {
    return { signal, onProgress: (running) => this.#store.set({ running }) };
  }

  #start(work: (signal: AbortSignal) => Promise<void>): Promise<void> {
    this.giveUp();
    return this.#queue(work);
  }

  async #queue(work: (signal: AbortSignal) => Promise<void>): Promise<void> {
    const controller = new AbortController();
    this.#controllers.add(controller);
    const before = this.#done;
    let resolve = () => {};
    this.#done = new Promise((done) => {
      resolve = done;
    });
    await before;
    try {
      if (!controller.signal.aborted) await this.#attempt(work, controller.signal);
    } finally {
      this.#controllers.delete(controller);
      resolve();
    }
  }

  async #attempt(work: (signal: AbortSignal) => Promise<void>, signal: AbortSignal): Promise<void> {
    try {
      await work(signal);
    } catch (error) {
      if (signal.reason === givenUp) {
        this.#store.set({ running: null });
        return;
      }
      const message = errorMessage(signal.aborted ? signal.reason : error);
      const earlier = this.#store.state.outcome ? " The previous result is shown." : "";
      const status = message.tone === "note" ? message.title : `Not stitched.${earlier}`;
      this.#store.set({ running: null, status, message });
    }
  }

  async #stitch(settings: Settings, signal: AbortSignal): Promise<void> {
    if (!this.#store.state.set) return this.#stitchPair(settings, signal);
    // Most stitch two photos.
    const { stitchSet } = await import("../many/run.js");
    return stitchSet(this.#store, settings, signal);
  }

  async #stitchPair(settings: Settings, signal: AbortSignal): Promise<void> {
    if (settings.depthSource === "model") await this.#estimateDepth(settings, signal);
    const { slots } = this.#store.state;
    const job = prepareJob({ ...this.#store.state, settings });
    if (!("target" in job)) {
      this.#store.set({ running: null, message: job });
      return;
    }
    const cached = isCached(job);
    const lasting = lastingMessage(this.#store.state);
    this.#store.set({ running: { stage: "input", fraction: 0 }, message: lasting });
    const start = performance.now();
    const result = await resultOf(job, this.#call(signal), this.computeLater);
    const { message, ...filled } = await filledMosaic(this.#store, result, settings, signal);
    signal.throwIfAborted();
    const elapsed = performance.now() - start;
    const outcome: Outcome = { kind: "pair", result, ...filled, job, slots, elapsed };
    const status = cached ? "Done (reused the earlier result)" : `Done in ${seconds(elapsed)}`;
    this.#store.set({ running: null, status, outcome, message });
  }

  /** Estimates the depth of those photos that the network has not processed yet. */
  async #estimateDepth(settings: Settings, signal: AbortSignal): Promise<void> {
    const { depthModel: model, depthHost: host, depthOnnx: onnx } = settings;
    const network = depthNetworkOf(settings);
    const { slots } = this.#store.state;
    const photos = photoSlots.flatMap((slot) => slots[slot]?.content ?? []);
    this.#store.set({ message: lastingMessage(this.#store.state) });
    for (const [index, photo] of photos.entries()) {
      const estimated = this.#store.state.networkDepths.get(photo);
      if (estimated?.model === network) continue;
      const report = (progress: NetworkProgress) =>
        this.#store.set({
          running: {
            stage: "model-depth",
            fraction: progress.fraction,
            text: depthStatus(progress, index === 0 ? "the first photo" : "the second photo"),
          },
        });
      report({ stage: "download", fraction: 0 });
      const args = { photo: await taken(photo.pixels), model, host, onnx };
      const map = await runNetwork("depth", args, signal, report);
      this.#store.set({
        networkDepths: withDepth(this.#store.state, photo, { model: network, map }),
      });
    }
  }
}

/** Whether photos or other files are being read. */
export function isLoading({ loading, set }: State): boolean {
  return loading.size > 0 || (set !== null && isReading(set));
}

/** Whether the result that is shown is one of the present photos. */
export function isShown({ outcome, set, slots }: State): boolean {
  if (!outcome) return false;
  return outcome.kind === "many" ? outcome.set === set : !set && outcome.slots === slots;
}

/** The settings without networks that are selected but have not been used yet. */
function withoutNewNetworks({ settings, outcome }: State): Settings {
  const used = outcome?.settings;
  const { depthSource, fillMethod } = settings;
  if (depthSource !== "model" && fillMethod === "core") return settings;
  return {
    ...settings,
    depthSource: depthSource === "model" && used?.depthSource !== "model" ? "photos" : depthSource,
    fillMethod: used?.fillMethod === fillMethod ? fillMethod : "core",
  };
}

/** Adds a depth map, and removes those of photos that are no longer loaded. */
function withDepth(
  { networkDepths, slots }: State,
  photo: Photo,
  depth: { readonly model: string; readonly map: DepthMap },
): State["networkDepths"] {
  const present = photoSlots.map((slot) => slots[slot]?.content);
  const current = [...networkDepths].filter(([key]) => present.includes(key));
  return new Map([...current, [photo, depth]]);
}

/** Binds the Stitch and Cancel buttons, and stitches automatically when the photos have changed. */
export function bindRun(store: Store, runner: Runner, loader: InputLoader): void {
  const runButton = byId("run", HTMLButtonElement);
  const cancelButton = byId("cancel", HTMLButtonElement);
  onClick(runButton, () => void runner.stitch());
  const cancel = () => {
    runner.cancel();
    loader.cancel();
  };
  onClick(cancelButton, cancel);
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") cancel();
  });

  let waiting = false;
  store.subscribe((state, before) => {
    const { slots, set, running, outcome, settings } = state;
    // The button is emphasized if inputs or settings have changed.
    const stale = !isShown(state) || outcome?.settings !== settings;
    runButton.classList.toggle("primary", stale && !running);
    if (!running !== !before.running || state === before) {
      setEnabled(runButton, !running);
    }
    setEnabled(cancelButton, Boolean(running) || isLoading(state));
    const changed =
      set !== before.set || photoSlots.some((slot) => slots[slot] !== before.slots[slot]);
    if (changed) {
      const complete = set
        ? usablePhotos(set).length > 1
        : photoSlots.every((slot) => slots[slot] !== null);
      waiting = complete && (running !== null || !isShown(state));
      if (!complete) runner.giveUp();
    }
    if (!waiting || isLoading(state)) return;
    queueMicrotask(() => {
      // What has just been read may be read again.
      if (!waiting || isLoading(store.state)) return;
      waiting = false;
      void runner.stitchAutomatically();
    });
  });
}
