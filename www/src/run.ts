import { stitch, type DepthInput, type Options, type StitchOptions } from "depthstitch";
import { byId, make, onClick, setEnabled } from "./dom.js";
import { errorMessage } from "./error-words.js";
import { percent, seconds } from "./number-words.js";
import { stages, stageWords } from "./report-words.js";
import { missing, type DepthMap, type State, type Store } from "./state.js";

/** Binds the Stitch and Cancel buttons, the progress bars and the status line; returns what Stitch does. */
export function bindRun(store: Store, options: () => Partial<Options>): () => Promise<void> {
  const runButton = byId("run", HTMLButtonElement);
  const cancelButton = byId("cancel", HTMLButtonElement);
  let controller: AbortController | null = null;

  const run = async () => {
    const { slots, depth, loading, running } = store.state;
    if (running) return;
    if (loading.size > 0) {
      store.set({
        message: {
          tone: "note",
          title: "A file is still being read.",
          advice: "Stitch again in a moment.",
        },
      });
      return;
    }
    const message = missing(slots);
    const { target, reference, matches, targetDepth, referenceDepth } = slots;
    if (message || !target || !reference || !matches) {
      store.set({ message });
      return;
    }

    controller = new AbortController();
    store.set({ running: { stage: "input", fraction: 0 }, message: null });
    const chosen = options();
    const asInput = (map: DepthMap): DepthInput => ({ ...map, ...depth });
    const call: StitchOptions = {
      ...chosen,
      matches: matches.content,
      targetDepth: targetDepth ? asInput(targetDepth.content) : undefined,
      referenceDepth: referenceDepth ? asInput(referenceDepth.content) : undefined,
      signal: controller.signal,
      onProgress: (running) => store.set({ running }),
    };
    const start = performance.now();
    try {
      const result = await stitch(target.content, reference.content, call);
      const elapsed = performance.now() - start;
      store.set({
        running: null,
        status: `Done in ${seconds(elapsed)}`,
        outcome: { result, slots, options: chosen, elapsed },
      });
    } catch (error) {
      const message = errorMessage(error);
      const kept = store.state.outcome ? " The result shown is the earlier one." : "";
      store.set({
        running: null,
        status: message.tone === "note" ? message.title : `Not stitched.${kept}`,
        message,
      });
    } finally {
      controller = null;
    }
  };

  const cancel = () => controller?.abort();
  onClick(runButton, () => void run());
  onClick(cancelButton, cancel);
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") cancel();
  });

  store.subscribe(({ running }, before) => {
    if (!running === !before.running) return;
    setEnabled(runButton, !running);
    setEnabled(cancelButton, Boolean(running));
  });
  bindProgress(store);
  bindMessage(store);
  return run;
}

function bindProgress(store: Store): void {
  const status = byId("status", HTMLElement);
  const fraction = byId("fraction", HTMLElement);
  const bars = stages.map(() => make("li"));
  byId("stages", HTMLElement).append(...bars);

  const draw = ({ running, status: idle }: State) => {
    const current = running ? stages.indexOf(running.stage) : -1;
    for (const [index, bar] of bars.entries()) {
      const done = index < current ? 1 : index === current ? (running?.fraction ?? 0) : 0;
      bar.style.setProperty("--done", String(done));
    }
    // Only the stage is announced: a screen reader need not hear every percent.
    const words = running ? `${stageWords[running.stage].doing}…` : idle;
    if (status.textContent !== words) status.textContent = words;
    fraction.textContent = running ? percent(Math.round(100 * running.fraction) / 100) : "";
  };
  store.subscribe((state, before) => {
    if (state.running !== before.running || state.status !== before.status || state === before)
      draw(state);
  });
}

function bindMessage(store: Store): void {
  const box = byId("message", HTMLElement);
  store.subscribe(({ message }, before) => {
    if (message === before.message) return;
    box.classList.toggle("error", message?.tone === "error");
    box.replaceChildren(
      ...(message ? [make("strong", {}, message.title), make("p", {}, message.advice)] : []),
    );
  });
}
