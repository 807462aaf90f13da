import { decodePhoto } from "../image-worker/client.js";
import { noSlots, photoSlots, type Slots, type State, type Store } from "../state.js";
import { count } from "../text/numbers.js";
import {
  coloursOfSet,
  hasSize,
  isDue,
  isReading,
  limitOf,
  setPhoto,
  whyUnused,
  type PhotoSet,
  type SetPhoto,
} from "./photo-set.js";
import { messageOf } from "../message-of.js";

/** Adds photos to a set, removes them, and decodes those that are to be used. */
export class SetLoader {
  readonly #store: Store;
  readonly #reading = new Set<number>();
  /** Gives up what is being loaded besides. */
  readonly #giveUpOthers: () => void;
  /** Whether photos are being read, one after another. */
  #reads = false;

  constructor(store: Store, giveUpOthers: () => void) {
    this.#store = store;
    this.#giveUpOthers = giveUpOthers;
  }

  /** Starts a set of these files, with the photos of the two slots first if `keep`. */
  start(files: readonly File[], keep: boolean): void {
    const { slots, settings } = this.#store.state;
    const { photoLimit } = settings;
    const kept = keep
      ? photoSlots.flatMap((slot) => {
          const loaded = slots[slot];
          if (loaded?.origin !== "own") return [];
          // -1: it is to be read again.
          const limit = hasSize(loaded.content, photoLimit) ? photoLimit : -1;
          return [setPhoto(loaded.file, "own", loaded.content, limit)];
        })
      : [];
    const photos = [...kept, ...files.map((file) => setPhoto(file, "own"))];
    const pair = kept.length > 0 ? slots : noSlots;
    this.#store.set({
      set: this.#limited({ photos, limit: photoLimit, reference: null, pair }),
      slots: noSlots,
      problems: {},
      message: null,
      undo: null,
    });
    void this.read();
  }

  /** Adds files to the set. */
  add(files: readonly File[]): void {
    const { set } = this.#store.state;
    if (files.length === 0) return;
    if (!set) return this.start(files, true);
    const photos = [...set.photos, ...files.map((file) => setPhoto(file, "own"))];
    this.#store.set({ set: this.#limited({ ...set, photos }), message: null, undo: null });
    void this.read();
  }

  /** Removes a photo, with a way back. Two photos that are left are two photos as before. */
  remove(id: number): void {
    const { set, slots, problems, outcome, status } = this.#store.state;
    const removed = set?.photos.find((photo) => photo.id === id);
    if (!set || !removed) return;
    const photos = set.photos.filter((photo) => photo !== removed);
    const reference = set.reference === id ? null : set.reference;
    const back = () => {
      this.#giveUpOthers();
      const earlier = { slots, problems, outcome, status };
      this.#store.set({ ...earlier, set: this.#limited(set), message: null, undo: null });
      void this.read();
    };
    this.#store.set({
      ...asPair(this.#limited({ ...set, photos, reference })),
      message: null,
      undo: {
        text: `Removed ${removed.file.name}.`,
        choices: [{ label: "Undo", run: back }],
      },
    });
    void this.read();
  }

  /** Leaves out the photos that are not read yet, with a way back. */
  cancel(): void {
    const { set } = this.#store.state;
    const photos = set?.photos.filter(({ content, problem }) => content ?? problem) ?? [];
    const left = (set?.photos.length ?? 0) - photos.length;
    if (!set || left === 0) return;
    const back = () => {
      this.#giveUpOthers();
      this.#store.set({ set: this.#limited(set), slots: noSlots, undo: null });
      void this.read();
    };
    this.#store.set({
      ...asPair({ ...set, photos }),
      status: "Cancelled",
      undo: {
        text: `Left out ${count(left, "photo that was", "photos that were")} not read yet.`,
        choices: [{ label: "Read on", run: back }],
      },
    });
  }

  /** Turns a photo by 90° clockwise. */
  async turn(id: number): Promise<void> {
    const photo = this.#store.state.set?.photos.find((photo) => photo.id === id);
    if (!photo?.content || this.#reading.has(id)) return;
    const { turns, colourSpace } = photo.content;
    this.#reading.add(id);
    const decoded = await decode(photo, photo.limit, (turns + 1) % 4, colourSpace);
    this.#reading.delete(id);
    const { set } = this.#store.state;
    if (!set?.photos.some(({ content }) => content === photo.content)) return;
    const photos = set.photos.map((other) => (other.id === id ? { ...other, ...decoded } : other));
    this.#store.set({ set: { ...set, photos }, undo: null });
    // Another size may have been chosen meanwhile.
    void this.read();
  }

  /** Chooses the photo in whose view all are shown; null for the one in the middle. */
  chooseReference(reference: number | null): void {
    const { set } = this.#store.state;
    if (set) this.#store.set({ set: { ...set, reference } });
  }

  /** Decodes all photos again after the size limit has changed. */
  reload(): void {
    const { set } = this.#store.state;
    if (set) this.#store.set({ set: this.#limited(set) });
    void this.read();
  }

  /** A set with the size limit for as many photos as it has. */
  #limited(set: PhotoSet): PhotoSet {
    const limit = limitOf(set.photos.length, this.#store.state.settings.photoLimit);
    return limit === set.limit ? set : { ...set, limit };
  }

  /** Decodes, one after another, what is to be used and is not decoded yet. */
  async read(): Promise<void> {
    if (this.#reads) return;
    this.#reads = true;
    try {
      for (let due = this.#next(); due; due = this.#next()) await this.#readPhoto(due);
    } finally {
      this.#reads = false;
    }
  }

  async #readPhoto({ set, photo: next }: { set: PhotoSet; photo: SetPhoto }): Promise<void> {
    const { limit } = set;
    this.#reading.add(next.id);
    const colours = coloursOfSet(set) === "display-p3" ? "display-p3" : null;
    const decoded = await decode(next, limit, next.content?.turns, colours);
    this.#reading.delete(next.id);
    const { set: now } = this.#store.state;
    // Unless the photo was removed meanwhile, or is wanted at another size now.
    if (now?.limit === limit && now.photos.some(({ id }) => id === next.id)) {
      const photos = now.photos.map((photo) =>
        photo.id === next.id ? { ...photo, ...decoded, limit } : photo,
      );
      this.#store.set(asPair({ ...now, photos }));
    }
  }

  /** The next photo that is to be used and is not decoded yet. */
  #next(): { set: PhotoSet; photo: SetPhoto } | undefined {
    const { set } = this.#store.state;
    if (!set) return undefined;
    const unused = whyUnused(set);
    const photo = set.photos.find(
      (photo) => isDue(photo, set) && !unused.has(photo.id) && !this.#reading.has(photo.id),
    );
    return photo && { set, photo };
  }
}

async function decode(
  { file }: SetPhoto,
  limit: number,
  turns: number | undefined,
  colours: PredefinedColorSpace | null,
): Promise<Pick<SetPhoto, "content"> | Pick<SetPhoto, "problem">> {
  try {
    return { content: await decodePhoto(file, file.name, limit, turns, colours) };
  } catch (error) {
    return { problem: messageOf(error) };
  }
}

/** The set as it is while it has three photos or more, or one is being read; otherwise in the two slots. */
function asPair(set: PhotoSet): Pick<State, "set"> & Partial<State> {
  if (set.photos.length > 2 || isReading(set)) return { set };
  let slots: Slots = noSlots;
  let problems: State["problems"] = {};
  for (const [index, { file, origin, content, problem }] of set.photos.entries()) {
    const slot = photoSlots[index] ?? "reference";
    if (content) slots = { ...slots, [slot]: { file, origin, content } };
    else if (problem !== null) problems = { ...problems, [slot]: problem };
  }
  return { set: null, slots: withBelongings(slots, set.pair), problems };
}

/** Two photos with the depth maps that they had before, and the matches if they are the same two. */
function withBelongings(slots: Slots, pair: Slots): Slots {
  const had = (slot: "target" | "reference") => slots[slot]?.content === pair[slot]?.content;
  return {
    ...slots,
    ...(slots.target && had("target") && { targetDepth: pair.targetDepth }),
    ...(slots.reference && had("reference") && { referenceDepth: pair.referenceDepth }),
    ...(slots.target && had("target") && had("reference") && { matches: pair.matches }),
  };
}
