import type { Photo } from "../image-worker/contents.js";
import { byId, find, make } from "../dom.js";
import { slotNames, type PhotoSlot, type SlotName, type State, type Store } from "../state.js";
import { imageTask } from "../image-worker/client.js";
import { messageOf } from "../message-of.js";
import { count, percent, size, sizes, smallAfterLimit } from "../text/numbers.js";
import type { InputLoader } from "./load-inputs.js";
import { drawThumbnail } from "./thumbnails.js";

const depthFiles = "image/png,image/jpeg,.npy,.pfm";
const texts: {
  readonly [K in SlotName]: {
    readonly title: string;
    /** Text of the empty card. */
    readonly hint: string;
    /** What its buttons refer to, for screen readers. */
    readonly who: string;
    readonly accept: string;
  };
} = {
  target: {
    title: "First photo",
    hint: "is warped onto the second",
    who: "the first photo",
    accept: "image/*",
  },
  reference: {
    title: "Second photo",
    hint: "is the reference",
    who: "the second photo",
    accept: "image/*",
  },
  targetDepth: {
    title: "First photo",
    hint: "grayscale PNG, .npy, .pfm",
    who: "the first photo's depth map",
    accept: depthFiles,
  },
  referenceDepth: {
    title: "Second photo",
    hint: "grayscale PNG, .npy, .pfm",
    who: "the second photo's depth map",
    accept: depthFiles,
  },
  matches: {
    title: "Custom matches",
    hint: "CSV file: xt,yt,xr,yr",
    who: "the matches file",
    accept: ".csv,.txt,text/csv,text/plain",
  },
};

/** Fills the five input cards and binds them to the state. */
export function bindInputs(store: Store, loader: InputLoader): void {
  for (const slot of slotNames) bindCard(slot, store, loader);
  bindNext(store);
  onFiles(byId("many-files", HTMLInputElement), (files) => void loader.loadMany(files));
  onFiles(byId("add-files", HTMLInputElement), (files) => void loader.loadMany(files, "add"));
}

/** Says what comes next once one photo is in. */
function bindNext(store: Store): void {
  const label = find(document, 'label[for="many-files"]', HTMLElement);
  const hint = byId("next-hint", HTMLElement);
  store.subscribe(({ slots: { target, reference } }, before) => {
    if (target === before.slots.target && reference === before.slots.reference) return;
    const one = Boolean(target) !== Boolean(reference);
    label.textContent = one
      ? target
        ? "Add the second photo"
        : "Add the first photo"
      : "Choose photos";
    const loaded = (target ?? reference)?.file.name ?? "";
    hint.textContent = one
      ? `${loaded} is there. Now add the ${target ? "second" : "first"} photo, taken from another place.`
      : "";
  });
}

function bindCard(slot: SlotName, store: Store, loader: InputLoader): void {
  const card = find(document, `[data-slot="${slot}"]`, HTMLElement);
  const remove = fillCard(card, slot, loader);
  const turn = card.querySelector<HTMLElement>('[data-part="turn"]');
  const thumb = find(card, ".thumb", HTMLElement);
  const canvas = find(card, "canvas", HTMLCanvasElement);
  const sizeLine = find(card, '[data-part="size"]', HTMLElement);
  const fileLine = find(card, '[data-part="file"]', HTMLElement);
  const choose = find(card, '[data-part="choose"]', HTMLElement);
  const note = find(card, '[data-part="note"]', HTMLElement);

  store.subscribe((state, before) => {
    const loaded = state.slots[slot];
    const changed = loaded !== before.slots[slot] || state === before;
    const due = changed || redraws(slot, state, before);
    const drawn = loaded && due ? drawThumbnail(canvas, slot, state) : null;
    if (changed || state.loading !== before.loading) {
      thumb.classList.toggle("empty", !loaded);
      card.setAttribute("aria-busy", String(state.loading.has(slot)));
      sizeLine.textContent = loaded ? sizeText(slot, state) : "";
      fileLine.textContent = state.loading.has(slot)
        ? "Reading…"
        : (loaded?.file.name ?? texts[slot].hint);
      fileLine.title = loaded?.file.name ?? "";
      choose.textContent = loaded ? "Change" : "Choose";
      if (remove) remove.hidden = !loaded;
      if (turn) turn.hidden = !loaded;
    }
    const problem = state.problems[slot];
    const show = (text: string, bad: boolean) => {
      if (note.textContent !== text) note.textContent = text;
      note.classList.toggle("bad", bad);
    };
    const showLater = (text: string, bad: boolean) => {
      if (store.state.slots[slot] === loaded && !store.state.problems[slot]) show(text, bad);
    };
    if (problem !== undefined) show(problem, true);
    if (due || state.problems !== before.problems) {
      Promise.all([warningAbout(slot, state), drawn]).then(
        ([text]) => showLater(text, false),
        (error: unknown) => showLater(messageOf(error), true),
      );
    }
  });
}

/** Fills a card from the template. Returns its Remove button, which photos do not have. */
function fillCard(card: HTMLElement, slot: SlotName, loader: InputLoader): HTMLElement | null {
  const { title, who, accept } = texts[slot];
  card.append(byId("card", HTMLTemplateElement).content.cloneNode(true));
  let heading = find(card, '[data-part="title"]', HTMLElement);
  if (slot === "target" || slot === "reference") {
    // The photos are a section of their own, right below the title of the page.
    const above = make("h2", { "data-part": "title" });
    heading.replaceWith(above);
    heading = above;
  }
  heading.id = `${slot}-title`;
  heading.textContent = title;
  find(card, "canvas", HTMLElement).setAttribute("aria-labelledby", heading.id);
  find(card, '[data-part="note"]', HTMLElement).id = `${slot}-note`;
  for (const part of card.querySelectorAll('[data-part="who"]')) part.textContent = ` ${who}`;

  const inputs = [...card.querySelectorAll("input")];
  for (const input of inputs) {
    // Desktop browsers have no property for this attribute.
    const camera = input.hasAttribute("capture");
    input.id = camera ? `${slot}-camera` : `${slot}-file`;
    if (!camera) input.accept = accept;
    input.setAttribute("aria-describedby", `${slot}-note`);
    const label = input.nextElementSibling;
    if (label instanceof HTMLLabelElement) label.htmlFor = input.id;
    onFiles(input, ([file]) => {
      if (file) void loader.loadOne(slot, file);
    });
  }
  // The thumbnail is the largest target for pointers; keyboards use the button.
  find(card, ".thumb", HTMLElement).addEventListener("click", () => inputs[0]?.click());
  const remove = find(card, '[data-part="remove"]', HTMLElement);
  if (slot === "target" || slot === "reference") {
    remove.remove();
    find(card, '[data-part="turn"]', HTMLElement).addEventListener(
      "click",
      () => void loader.turn(slot),
    );
    return null;
  }
  find(card, ".camera", HTMLElement).remove();
  find(card, '[data-part="turn"]', HTMLElement).remove();
  remove.addEventListener("click", () => {
    loader.clear([slot]);
    inputs[0]?.focus();
  });
  return remove;
}

/** The slot of the photo that a depth map, or the drawing of matches, belongs to. */
function photoOf(slot: SlotName): PhotoSlot {
  return slot === "referenceDepth" ? "reference" : "target";
}

/** Whether the thumbnail, or what is said of it, depends on something else that changed. */
function redraws(slot: SlotName, state: State, before: State): boolean {
  if (slot === "target" || slot === "reference") return false;
  if (state.slots[photoOf(slot)] !== before.slots[photoOf(slot)]) return true;
  return slot !== "matches" && state.settings.depth !== before.settings.depth;
}

function sizeText(slot: SlotName, { slots }: State): string {
  switch (slot) {
    case "matches":
      return slots.matches ? count(slots.matches.content.length / 4, "match", "matches") : "";
    case "target":
    case "reference":
      return slots[slot] ? photoText(slots[slot].content) : "";
    default: {
      const map = slots[slot]?.content;
      if (!map) return "";
      const bits = map.data instanceof Uint16Array ? ", 16 bit" : "";
      return size(map) + (map.data instanceof Float32Array ? ", float" : bits);
    }
  }
}

function photoText(photo: Photo): string {
  const { focalLength35 } = photo;
  const text = sizes(photo);
  return focalLength35 === null ? text : `${text}, ${Math.round(focalLength35)}\u00a0mm`;
}

/** A warning about a file that is usable but looks wrong. */
async function warningAbout(slot: SlotName, { slots, settings }: State): Promise<string> {
  if (slot === "target" || slot === "reference") {
    return slots[slot] ? smallAfterLimit(slots[slot].content) : "";
  }
  if (slot === "matches") return "";
  const map = slots[slot]?.content;
  const photo = slots[photoOf(slot)]?.content;
  if (!map) return "";
  if (photo) {
    const ratio = (map.width / map.height) * (photo.height / photo.width);
    if (Math.abs(ratio - 1) > 0.02) {
      return (
        `This map is ${size(map)}, its photo ${size(photo)}: the aspect ratios differ, so the map will be stretched. ` +
        "Is it the map of this photo, rotated and cropped in the same way?"
      );
    }
  }
  const holes = await imageTask("holeShare", map, settings.depth);
  return holes > 0.5
    ? `${percent(holes)} of this map is unknown. Check the meaning of its values below.`
    : "";
}

/** Calls `take` with the chosen files, even if the same file is chosen again. */
function onFiles(input: HTMLInputElement, take: (files: readonly File[]) => void): void {
  input.addEventListener("change", () => {
    const files = [...(input.files ?? [])];
    input.value = "";
    if (files.length > 0) take(files);
  });
}
