import { byId, make, showOn } from "../dom.js";
import type { State, Store } from "../state.js";
import { size, sizes, smallAfterLimit } from "../text/numbers.js";
import { whyUnused, type SetPhoto } from "./photo-set.js";
import { whyLeftOut } from "./report-text.js";
import type { SetLoader } from "./set-loader.js";

/** The elements of one photo. */
interface Tile {
  readonly item: HTMLLIElement;
  readonly canvas: HTMLCanvasElement;
  readonly name: HTMLElement;
  readonly line: HTMLElement;
  readonly note: HTMLElement;
  readonly turn: HTMLButtonElement;
  readonly remove: HTMLButtonElement;
  /** What the canvas shows. */
  drawn: ImageBitmap | null;
}

/** Shows the photos of a set as thumbnails that can be removed. */
export function bindStrip(store: Store, loader: SetLoader): void {
  const list = byId("strip", HTMLUListElement);
  const tiles = new Map<number, Tile>();

  const remove = (id: number) => {
    const shown = store.state.set?.photos.map((photo) => photo.id) ?? [];
    const at = shown.indexOf(id);
    const next = shown[at + 1] ?? shown[at - 1];
    loader.remove(id);
    // The focus stays in its place; with two photos left the strip is gone.
    const target = next === undefined ? undefined : tiles.get(next)?.remove;
    if (target?.isConnected) target.focus();
    else byId("add-files", HTMLInputElement).focus();
  };

  const draw = (state: State) => {
    const photos = state.set?.photos ?? [];
    for (const [id, { item }] of tiles) {
      if (photos.some((photo) => photo.id === id)) continue;
      item.remove();
      tiles.delete(id);
    }
    for (const { id } of photos) {
      if (tiles.has(id)) continue;
      const tile = makeTile(
        () => remove(id),
        () => void loader.turn(id),
      );
      tiles.set(id, tile);
      list.append(tile.item);
    }
    // Photos that were removed and have come back take their old places.
    const order = photos.flatMap(({ id }) => tiles.get(id)?.item ?? []);
    if (order.some((item, index) => list.children[index] !== item)) list.append(...order);
    const unused = state.set ? whyUnused(state.set) : new Map<number, string>();
    for (const [index, photo] of photos.entries()) {
      const tile = tiles.get(photo.id);
      if (tile) fillTile(tile, index, photo, unused.get(photo.id), state);
    }
  };
  store.subscribe((state, before) => {
    if (state.set !== before.set || state.outcome !== before.outcome || state === before) {
      draw(state);
    }
  });
  draw(store.state);
}

function makeTile(onRemove: () => void, onTurn: () => void): Tile {
  const canvas = make("canvas", { width: "4", height: "3", role: "img" });
  const name = make("p", { class: "file" });
  const line = make("p", { class: "size" });
  const note = make("p", { class: "note" });
  const remove = make("button", { type: "button", class: "remove", "aria-keyshortcuts": "Delete" });
  remove.append(make("span", { "aria-hidden": "true" }, "×"));
  remove.addEventListener("click", onRemove);
  const turn = make("button", { type: "button", class: "turn", title: "Turn by 90°" });
  turn.append(make("span", { "aria-hidden": "true" }, "↻"));
  turn.addEventListener("click", onTurn);
  const item = make(
    "li",
    { class: "tile" },
    make("div", { class: "thumb" }, canvas),
    make("div", { class: "words" }, name, line, note),
    turn,
    remove,
  );
  item.addEventListener("keydown", (event) => {
    if (event.key !== "Delete" && event.key !== "Backspace") return;
    event.preventDefault();
    onRemove();
  });
  return { item, canvas, name, line, note, turn, remove, drawn: null };
}

function fillTile(
  tile: Tile,
  index: number,
  photo: SetPhoto,
  unused: string | undefined,
  { outcome }: State,
): void {
  const { file, content } = photo;
  const shownAs =
    outcome?.kind === "many"
      ? outcome.photos.findIndex(({ id, content: shown }) => id === photo.id && shown === content)
      : -1;
  const leftOut = outcome?.kind === "many" && shownAs >= 0 ? whyLeftOut(outcome, shownAs) : "";
  const isReference = outcome?.kind === "many" && shownAs === outcome.result.reference;
  const reading = content === null && unused === undefined;
  const words = (unused ?? leftOut) || (content ? smallAfterLimit(content) : "");
  const number = String(index + 1);
  tile.item.dataset["number"] = number;
  tile.item.classList.toggle("noted", words !== "");
  tile.item.classList.toggle("unused", unused !== undefined || leftOut !== "");
  tile.item.classList.toggle("reference", isReference);
  tile.item.setAttribute("aria-busy", String(reading));
  tile.canvas.setAttribute("aria-label", `Photo ${number}`);
  tile.name.textContent = file.name;
  tile.name.title = file.name;
  tile.line.textContent = reading
    ? "Reading…"
    : isReference
      ? "Reference"
      : content
        ? size(content.original)
        : "";
  if (content) tile.line.title = sizes(content);
  if (tile.note.textContent !== words) tile.note.textContent = words;
  tile.remove.setAttribute("aria-label", `Remove photo ${number}, ${file.name}`);
  tile.remove.title = `Remove ${file.name}`;
  tile.turn.hidden = content === null;
  tile.turn.setAttribute("aria-label", `Turn photo ${number}, ${file.name}, by 90°`);
  if (content && tile.drawn !== content.preview) {
    tile.drawn = content.preview;
    showOn(tile.canvas, content.preview);
  }
}
