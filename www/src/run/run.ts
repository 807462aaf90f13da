import type { CallOptions } from "depthstitch";
import { byId, onClick, setEnabled } from "../dom.js";
import { NetworkError, runNetwork } from "../networks/client.js";
import type { NetworkProgress } from "../networks/requests.js";
import {
  depthNetworkOf,
  photoSlots,
  type Message,
  type Outcome,
  type Settings,
  type State,
  type Store,
} from "../state.js";
import type { DepthMap, Photo } from "../studio/contents.js";
import { errorMessage } from "../words/errors.js";
import { seconds } from "../words/numbers.js";
import { depthWords, fillWords } from "../words/networks.js";
import { filledMosaic } from "./fill.js";
import { jobOf } from "./job.js";
import { isKnown, resultOf } from "./results.js";

/** Starts, restarts and stops the work on the page's photos; one run at a time. */
export class Runner {
  readonly #store: Store;
  /** Of the work that runs and of what waits for it. */
  readonly #controllers = new Set<AbortController>();
  #done: Promise<void> = Promise.resolve();

  constructor(store: Store) {
    this.#store = store;
  }

  cancel(): void {
    for (const controller of this.#controllers) controller.abort();
  }

  /** Stitches what the inputs and settings are now, after ending what runs. */
  stitch(): Promise<void> {
    return this.#start((signal) => this.#stitch(this.#store.state.settings, signal));
  }

  /** The same, but begun by the page itself: it uses no network that the result before did not use. */
  stitchByItself(): Promise<void> {
    return this.#start((signal) => this.#stitch(withoutNewNetworks(this.#store.state), signal));
  }

  /** Computes something else when nothing runs, under the same progress and Cancel; nothing where that fails. */
  async other<T>(work: (call: CallOptions) => Promise<T>): Promise<T | undefined> {
    let value: T | undefined;
    await this.#queue(async (signal) => {
      const { status } = this.#store.state;
      value = await work({ signal, onProgress: (running) => this.#store.set({ running }) });
      this.#store.set({ running: null, status, message: null });
    });
    return value;
  }

  #start(work: (signal: AbortSignal) => Promise<void>): Promise<void> {
    this.cancel();
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
      const message = errorMessage(signal.aborted ? signal.reason : error);
      const kept = this.#store.state.outcome ? " The result shown is the earlier one." : "";
      const status = message.tone === "note" ? message.title : `Not stitched.${kept}`;
      this.#store.set({ running: null, status, message });
    }
  }

  async #stitch(settings: Settings, signal: AbortSignal): Promise<void> {
    if (settings.depthSource === "model") await this.#estimateDepth(settings, signal);
    const { slots } = this.#store.state;
    const job = jobOf({ ...this.#store.state, settings });
    if (!("target" in job)) {
      this.#store.set({ message: job });
      return;
    }
    const known = isKnown(job);
    this.#store.set({ running: { stage: "input", fraction: 0 }, message: null });
    const start = performance.now();
    const result = await resultOf(job, {
      signal,
      onProgress: (running) => this.#store.set({ running }),
    });
    const tell = (progress: NetworkProgress) =>
      this.#store.set({
        running: { stage: "model-fill", fraction: progress.fraction, words: fillWords(progress) },
      });
    let message: Message | null = null;
    const mosaic = await filledMosaic(result, settings, signal, tell).catch((error: unknown) => {
      if (!(error instanceof NetworkError)) throw error;
      // What the core filled is there in any case.
      message = errorMessage(error);
      return result.mosaic;
    });
    const elapsed = performance.now() - start;
    const outcome: Outcome = { result, mosaic, job, slots, settings, elapsed };
    const status = known ? "Done: known from before" : `Done in ${seconds(elapsed)}`;
    this.#store.set({ running: null, status, outcome, message });
  }

  /** Has the network estimate the depth of the photos whose depth it has not estimated yet. */
  async #estimateDepth(settings: Settings, signal: AbortSignal): Promise<void> {
    const { depthModel: model, depthHost: host, depthOnnx: onnx } = settings;
    const network = depthNetworkOf(settings);
    const { slots } = this.#store.state;
    const photos = photoSlots.flatMap((slot) => slots[slot]?.content ?? []);
    this.#store.set({ message: null });
    for (const [index, photo] of photos.entries()) {
      const known = this.#store.state.modelDepths.get(photo);
      if (known?.model === network) continue;
      const { data, width, height } = photo;
      const args = { photo: { data, width, height }, model, host, onnx };
      const tell = (progress: NetworkProgress) =>
        this.#store.set({
          running: {
            stage: "model-depth",
            fraction: progress.fraction,
            words: depthWords(progress, index === 0 ? "the first photo" : "the second photo"),
          },
        });
      tell({ stage: "download", fraction: 0 });
      const map = await runNetwork("depth", args, signal, tell);
      this.#store.set({
        modelDepths: withDepth(this.#store.state, photo, { model: network, map }),
      });
    }
  }
}

/** The settings but for networks that were chosen and not yet asked to run. */
function withoutNewNetworks({ settings, outcome }: State): Settings {
  const used = outcome?.settings;
  const { depthSource, filler } = settings;
  if (depthSource !== "model" && filler === "core") return settings;
  return {
    ...settings,
    depthSource: depthSource === "model" && used?.depthSource !== "model" ? "photos" : depthSource,
    filler: used?.filler === filler ? filler : "core",
  };
}

/** The depth maps with a new one; those of photos that are gone are forgotten. */
function withDepth(
  { modelDepths, slots }: State,
  photo: Photo,
  depth: { readonly model: string; readonly map: DepthMap },
): State["modelDepths"] {
  const present = photoSlots.map((slot) => slots[slot]?.content);
  const kept = [...modelDepths].filter(([key]) => present.includes(key));
  return new Map([...kept, [photo, depth]]);
}

/** Binds the Stitch and Cancel buttons, and stitches by itself when the photos have changed. */
export function bindRun(store: Store, runner: Runner): void {
  const runButton = byId("run", HTMLButtonElement);
  const cancelButton = byId("cancel", HTMLButtonElement);
  onClick(runButton, () => void runner.stitch());
  onClick(cancelButton, () => runner.cancel());
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") runner.cancel();
  });

  let waiting = false;
  store.subscribe((state, before) => {
    const { slots, loading, running, outcome, settings } = state;
    // What is new asks to be pressed.
    const stale = outcome?.slots !== slots || outcome.settings !== settings;
    runButton.classList.toggle("primary", stale && !running);
    if (!running !== !before.running || state === before) {
      setEnabled(runButton, !running);
      setEnabled(cancelButton, Boolean(running));
    }
    const changed = photoSlots.some((slot) => slots[slot] !== before.slots[slot]);
    if (changed) waiting = photoSlots.every((slot) => slots[slot]);
    if (!waiting || loading.size > 0) return;
    waiting = false;
    queueMicrotask(() => void runner.stitchByItself());
  });
}
