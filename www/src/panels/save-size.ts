import type { Photo, Rect } from "../image-worker/contents.js";
import { byId, onClick } from "../dom.js";
import type { ManyOutcome, Outcome, Store } from "../state.js";
import { count, percent, size } from "../text/numbers.js";

/** Says beside Save what size is saved, and what full resolution would give and take. */
export function bindSaveSize(store: Store): void {
  const text = byId("save-size", HTMLElement);
  const full = byId("full-size", HTMLButtonElement);
  const crop = byId("save-crop", HTMLSelectElement);
  const draw = () => {
    const { outcome } = store.state;
    if (!outcome) {
      text.textContent = "";
      full.hidden = true;
      return;
    }
    const part = savedPart(outcome, crop.value);
    const scale = Math.min(...photosOf(outcome).map((photo) => photo.width / photo.original.width));
    full.hidden = scale >= 1;
    text.textContent = `${size(part)} pixels.${full.hidden ? "" : ` ${fullSize(outcome, part, scale)}`}`;
  };
  crop.addEventListener("change", draw);
  onClick(full, () => store.change({ photoLimit: 0 }));
  store.subscribe(({ outcome }, before) => {
    if (outcome !== before.outcome) draw();
  });
  draw();
}

/** The part of the mosaic that is saved. */
export function savedPart({ result, mosaic }: Outcome | ManyOutcome, crop: string): Rect {
  const whole = { x: 0, y: 0, width: mosaic.width, height: mosaic.height };
  return crop === "inner" ? (result.crop.inner ?? whole) : whole;
}

function photosOf(outcome: Outcome | ManyOutcome): readonly Photo[] {
  return outcome.kind === "many"
    ? outcome.photos.flatMap(({ content }) => content ?? [])
    : [outcome.job.target, outcome.job.reference];
}

function fullSize(outcome: Outcome | ManyOutcome, part: Rect, scale: number): string {
  const of = (side: number) => Math.round(side / scale);
  const spent = Object.values(outcome.result.times).reduce((sum, time) => sum + time, 0);
  // Matching works on reduced photos anyway; everything else grows with the pixels.
  const seconds = Math.max(1, Math.round(spent / scale ** 2 / 1000));
  const time =
    seconds < 90 ? `${seconds}\u00a0s` : count(Math.round(seconds / 60), "minute", "minutes");
  return (
    `Photos were downscaled to ${percent(scale)}; at full size it would have about ` +
    `${size({ width: of(part.width), height: of(part.height) })} pixels and take about ${time}.`
  );
}
