import { holeShare, paintColourLegend, paintHoleLegend } from "./depth-colours.js";
import { byId, find } from "./dom.js";
import type { InputLoader } from "./load-inputs.js";
import { count, percent, size } from "./number-words.js";
import { slotNames, type SlotName, type State, type Store } from "./state.js";
import { drawThumbnail, put } from "./thumbnails.js";

/** Binds the five input cards and the meaning of the depth values to the state. */
export function bindInputs(store: Store, loader: InputLoader): void {
  for (const slot of slotNames) bindCard(slot, store, loader);
  bindDepthSettings(store);

  const many = byId("many-files", HTMLInputElement);
  onFiles(many, (files) => void loader.loadMany(files));
}

function bindCard(slot: SlotName, store: Store, loader: InputLoader): void {
  const card = find(document, `[data-slot="${slot}"]`, HTMLElement);
  const thumb = find(card, ".thumb", HTMLElement);
  const canvas = find(card, "canvas", HTMLCanvasElement);
  const sizeLine = find(card, '[data-part="size"]', HTMLElement);
  const fileLine = find(card, '[data-part="file"]', HTMLElement);
  const note = find(card, '[data-part="note"]', HTMLElement);
  const input = find(card, "input", HTMLInputElement);
  const remove = card.querySelector<HTMLButtonElement>('[data-part="remove"]');
  const invitation = fileLine.textContent;

  onFiles(input, ([file]) => {
    if (file) void loader.loadOne(slot, file);
  });
  remove?.addEventListener("click", () => {
    loader.clear([slot]);
    input.focus();
  });

  store.subscribe((state, before) => {
    const loaded = state.slots[slot];
    const changed = loaded !== before.slots[slot];
    if (loaded && (changed || redraws(slot, state, before))) drawThumbnail(canvas, slot, state);
    if (changed || state.loading !== before.loading || !loaded) {
      thumb.classList.toggle("empty", !loaded);
      card.setAttribute("aria-busy", String(state.loading.has(slot)));
      sizeLine.textContent = loaded ? sizeWords(slot, state) : "";
      fileLine.textContent = state.loading.has(slot) ? "Reading…" : (loaded?.file ?? invitation);
      fileLine.title = loaded?.file ?? "";
      if (remove) remove.hidden = !loaded;
    }
    const problem = state.problems[slot];
    const words = problem ?? doubt(slot, state);
    if (note.textContent !== words) note.textContent = words;
    note.classList.toggle("bad", problem !== undefined);
  });
}

/** Whether something else than the slot's own file changed its picture. */
function redraws(slot: SlotName, state: State, before: State): boolean {
  if (slot === "matches") return state.slots.target !== before.slots.target;
  return slot.endsWith("Depth") && state.depth !== before.depth;
}

function sizeWords(slot: SlotName, { slots }: State): string {
  if (slot === "matches") {
    return slots.matches ? count(slots.matches.content.length / 4, "match", "matches") : "";
  }
  const content = slots[slot]?.content;
  if (!content) return "";
  const deep = content.data instanceof Uint16Array ? ", 16 bit" : "";
  return size(content) + deep;
}

/** What looks wrong about a depth map that can still be used. */
function doubt(slot: SlotName, { slots, depth }: State): string {
  if (slot !== "targetDepth" && slot !== "referenceDepth") return "";
  const map = slots[slot]?.content;
  const photo = slots[slot === "targetDepth" ? "target" : "reference"]?.content;
  if (!map) return "";
  if (photo) {
    const ratio = (map.width / map.height) * (photo.height / photo.width);
    if (Math.abs(ratio - 1) > 0.02) {
      return (
        `This map is ${size(map)}, its photo ${size(photo)}: the shapes differ. ` +
        "Is it the map of this photo, turned and cropped the same way? It would be stretched to fit."
      );
    }
  }
  const holes = remembered(map, depth.kind, depth.invalid, () => holeShare(map, depth));
  return holes > 0.5
    ? `${percent(holes)} of this map is unknown. Check what its values mean, below.`
    : "";
}

const known = new WeakMap<object, { key: string; value: number }>();

/** Counting the holes of a large map on every redraw would be felt. */
function remembered(
  map: object,
  kind: string,
  invalid: number | null,
  compute: () => number,
): number {
  const key = `${kind} ${invalid}`;
  const entry = known.get(map);
  if (entry?.key === key) return entry.value;
  const value = compute();
  known.set(map, { key, value });
  return value;
}

function bindDepthSettings(store: Store): void {
  const kinds = [...document.querySelectorAll<HTMLInputElement>('input[name="depth-kind"]')];
  const invalid = byId("depth-invalid", HTMLInputElement);
  put(byId("depth-legend", HTMLCanvasElement), paintColourLegend(64));
  put(byId("hole-legend", HTMLCanvasElement), paintHoleLegend(18, 10));

  const read = () => {
    const kind = kinds.find((choice) => choice.checked)?.value === "metric" ? "metric" : "inverse";
    store.set({
      depth: { kind, invalid: Number.isNaN(invalid.valueAsNumber) ? null : invalid.valueAsNumber },
    });
  };
  for (const choice of kinds) choice.addEventListener("change", read);
  invalid.addEventListener("change", read);

  store.subscribe(({ depth }, before) => {
    if (depth === before.depth) return;
    for (const choice of kinds) choice.checked = choice.value === depth.kind;
    invalid.value = depth.invalid === null ? "" : String(depth.invalid);
  });
}

/** Calls back with the chosen files, also when the same file is chosen again. */
function onFiles(input: HTMLInputElement, take: (files: readonly File[]) => void): void {
  input.addEventListener("change", () => {
    const files = [...(input.files ?? [])];
    input.value = "";
    if (files.length > 0) take(files);
  });
}
