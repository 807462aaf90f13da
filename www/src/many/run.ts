import { StitchError, type Progress } from "depthstitch";
import { filledMosaic } from "../run/fill.js";
import { lastingMessage, type Message, type Running, type Settings, type Store } from "../state.js";
import { seconds } from "../text/numbers.js";
import { manyResultOf, prepareSet } from "./job.js";

/** The most photos of which every pair is compared; of more, only promising pairs are, and not said how many. */
const allPairs = 8;

/** Stitches the present set of photos. */
export async function stitchSet(
  store: Store,
  settings: Settings,
  signal: AbortSignal,
): Promise<void> {
  const { set } = store.state;
  const job = prepareSet({ ...store.state, settings });
  if (!set || !("photos" in job)) {
    store.set({ message: "photos" in job ? null : job });
    return;
  }
  store.set({ running: { stage: "input", fraction: 0 }, message: lastingMessage(store.state) });
  const start = performance.now();
  const count = job.photos.length;
  const stitched = await manyResultOf(job, {
    signal,
    onProgress: (progress) => store.set({ running: running(progress, count) }),
  }).catch((error: unknown) => {
    if (signal.aborted || job.reference === null || !isNoConsensus(error)) throw error;
    const shown = store.state.outcome ? " The previous result is shown." : "";
    store.set({ running: null, status: `Not stitched.${shown}`, message: lonelyReference });
    return null;
  });
  if (!stitched) return;
  const { result, cached } = stitched;
  const { message, ...filled } = await filledMosaic(store, result, settings, signal);
  signal.throwIfAborted();
  const elapsed = performance.now() - start;
  const { photos } = job;
  store.set({
    running: null,
    status: cached ? "Done (reused the earlier result)" : `Done in ${seconds(elapsed)}`,
    outcome: { kind: "many", result, ...filled, photos, set, elapsed },
    message,
  });
}

function isNoConsensus(error: unknown): boolean {
  return error instanceof StitchError && error.code === "no-consensus";
}

const lonelyReference: Message = {
  tone: "error",
  title: "No common points of the reference photo and the others were found.",
  advice: "Choose another reference photo or “Automatic”, or add photos from in between.",
};

/** Progress with the photo, or the pair of photos, that is worked on: each takes an equal part of a stage. */
function running({ stage, fraction }: Progress, count: number): Running {
  const at = (share: number, of: number, what: string) =>
    `${what} ${Math.min(of, 1 + Math.floor(share * of + 1e-4))} of ${of}`;
  const shown = { stage, fraction };
  switch (stage) {
    case "detect":
      return { ...shown, detail: at(fraction, count, "photo") };
    case "match":
      // A fifth of the stage is for finding the pairs.
      return count > allPairs
        ? shown
        : { ...shown, detail: at((fraction - 0.2) / 0.8, (count * (count - 1)) / 2, "pair") };
    case "warp":
    case "blend":
      return { ...shown, detail: at(fraction, count - 1, "photo") };
    default:
      return shown;
  }
}
