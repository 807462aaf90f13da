import {
  defaultSettings,
  depthSlot,
  photoSlots,
  slotNames,
  turnMatches,
  withLoaded,
} from "../state.js";
import type {
  DepthSettings,
  Loaded,
  Message,
  PhotoSlot,
  Settings,
  SlotName,
  Slots,
  State,
  Store,
} from "../state.js";
import { decodePhoto, imageTask } from "../image-worker/client.js";
import type { Photo } from "../image-worker/contents.js";
import { decodeSlot, inOneColourSpace, parsers, turnsOf } from "./decode-slots.js";
import type { Files } from "./decode-slots.js";
import { hiddenProblems, incompleteCase, unusable, unusedFiles } from "./file-messages.js";
import type { Case } from "./parse-files.js";
import { hasSize } from "../many/photo-set.js";
import type { SetLoader } from "../many/set-loader.js";
import { cameBack } from "../undo.js";
import { isCaseFile, sortFiles } from "./sort-files.js";
import { messageOf } from "../message-of.js";

type Origin = Loaded<unknown>["origin"];

/** Loads files into slots. A slot keeps its content if its new file cannot be used. */
export class InputLoader {
  readonly #store: Store;
  /** The latest load of each slot; earlier ones are given up. */
  readonly #latest = new Map<SlotName, AbortController>();
  #sets: Promise<SetLoader> | null = null;
  /** Ends when the files chosen so far are loaded; what is chosen meanwhile waits, so that it finds their places taken. */
  #queue: Promise<void> = Promise.resolve();
  /** How often loading was cancelled. */
  #cancelled = 0;

  constructor(store: Store) {
    this.#store = store;
  }

  /** Loads one file into one slot. */
  async loadOne(slot: SlotName, file: File): Promise<void> {
    const before = this.#store.state;
    const load = this.#load({ [slot]: file }, "own");
    this.#queue = Promise.all([this.#queue, load]).then(() => undefined);
    await load;
    const replaced = before.slots[slot];
    if (replaced?.origin !== "own" || this.#store.state.slots[slot]?.file !== file) return;
    this.#offerBack(before, `${replaced.file.name} was replaced.`);
  }

  /**
   * Loads several files, assigned by their names. Three photos or more become a set, to which further ones are added. Two
   * photos replace the two that are there, unless they are to be added.
   */
  loadMany(files: readonly File[], how: "replace" | "add" = "replace"): Promise<void> {
    const cancelled = this.#cancelled;
    this.#queue = this.#queue.then(() => {
      return this.#cancelled === cancelled ? this.#loadMany(files, how) : undefined;
    });
    return this.#queue;
  }

  async #loadMany(files: readonly File[], how: "replace" | "add"): Promise<void> {
    try {
      const caseFile = files.find(isCaseFile);
      const theCase = caseFile ? await (await parsers()).readCase(caseFile) : null;
      const before = this.#store.state;
      const { photos, placed, left } = sortFiles(files, theCase, before.slots);
      const own = photoSlots.filter((slot) => before.slots[slot]?.origin === "own");
      const adds = how === "add" || photos.length === 1;
      const total = photos.length + (adds ? own.length : 0);
      if (!theCase && (before.set || total > 2)) {
        const loader = await this.sets();
        if (before.set) loader.add(photos);
        else loader.start(photos, adds);
        this.#giveUp();
        if (!before.set && !adds) this.#reportReplaced(before, photos, own.length);
        const others = files.filter((file) => !photos.includes(file) && !isCaseFile(file));
        this.#say(unusedFiles(others, photos.length, this.#store.state.set !== null));
        return;
      }
      const absent = theCase ? namesAbsent(theCase, placed) : [];
      if (!(await this.#load(placed, "own", theCase))) return;
      this.#say(hiddenProblems(this.#store.state.problems, placed));
      // A single photo has taken a free place, and files that are no photos have taken that of none.
      this.#reportReplaced(before, photos, theCase || photos.length > 1 ? own.length : 0);
      const count = Object.keys(placed).length;
      this.#say(
        count > 0 && absent.length > 0 ? incompleteCase(absent) : unusedFiles(left, count, false),
      );
    } catch (error) {
      this.refuse(error);
    }
  }

  /** Says why chosen files could not be loaded. */
  refuse(error: unknown): void {
    this.#store.set({ message: unusable(error, "These files could not be loaded.") });
  }

  /** Loads the case that is part of the page, unless files are chosen before it has arrived. */
  async loadSample(folder: URL): Promise<void> {
    const limit = this.#store.state.settings.photoLimit;
    const loads = slotNames.map((slot) => ({ slot, signal: this.#begin(slot) }));
    const fetching = new AbortController();
    for (const { signal } of loads) signal.addEventListener("abort", () => fetching.abort());
    this.#store.set({ loading: new Set(slotNames) });
    let fetched;
    try {
      const { fetchCase } = await import("./fetch-case.js");
      fetched = await fetchCase(folder, fetching.signal);
    } catch (error) {
      const current = loads.filter(({ signal }) => !signal.aborted).map(({ slot }) => slot);
      this.#store.set({ loading: this.#loadingExcept(current) });
      if (!fetching.signal.aborted) {
        this.#store.set({ message: unusable(error, "The example could not be loaded.") });
      }
      // What was to be replaced stays.
      if (current.length > 0) await this.#followLimit(limit);
      return;
    }
    const before = this.#store.state;
    if (!(await this.#load(fetched.files, "sample", fetched))) return;
    const own = photoSlots.filter((slot) => before.slots[slot]?.origin === "own");
    this.#reportReplaced(before, [], own.length);
  }

  /** Turns a photo by 90° clockwise, with its depth map and the matches. */
  async turn(slot: PhotoSlot): Promise<void> {
    const { state } = this.#store;
    const loaded = state.slots[slot];
    if (!loaded || state.loading.has(slot)) return;
    const signal = this.#begin(slot);
    this.#store.set({ loading: new Set([...state.loading, slot]), undo: null });
    await this.#turn(slot, loaded, signal);
  }

  async #turn(slot: PhotoSlot, loaded: Loaded<Photo>, signal: AbortSignal): Promise<void> {
    const { slots, settings } = this.#store.state;
    const { file, content } = loaded;
    const { turns, colourSpace } = content;
    const map = slots[depthSlot[slot]];
    const limit = settings.photoLimit;
    const [turned, depth] = await Promise.all([
      decodePhoto(file, file.name, limit, (turns + 1) % 4, colourSpace),
      map && imageTask("turnDepth", map.content),
    ]).catch((error: unknown) => [messageOf(error)] as const);
    if (signal.aborted) return;
    const now = this.#store.state;
    const present = now.slots[slot];
    // Meanwhile it was read in the colour space of the other photo, or has got another depth map.
    if (present && (present !== loaded || now.slots[depthSlot[slot]] !== map)) {
      return this.#turn(slot, present, signal);
    }
    const loading = this.#loadingExcept([slot]);
    if (!present || typeof turned === "string") {
      // A file that was moved or changed since.
      const problems =
        typeof turned === "string" ? { ...now.problems, [slot]: turned } : now.problems;
      this.#store.set({ loading, problems });
      return;
    }
    const { matches } = now.slots;
    this.#store.set({
      slots: {
        ...now.slots,
        [slot]: { ...loaded, content: turned },
        ...(map && depth && { [depthSlot[slot]]: { ...map, content: depth } }),
        matches: matches && {
          ...matches,
          content: turnMatches(matches.content, slot, content.original.height),
        },
      },
      loading,
    });
    await this.#followLimit(limit);
  }

  /** Decodes photos again that the size limit, when it has changed, gives another size; those that are being read follow. */
  reloadPhotos(): Promise<void> {
    return this.#reload(true);
  }

  /** `failed`: also those that could not be read at another size. */
  async #reload(failed: boolean): Promise<void> {
    const { set, slots, problems, loading, settings } = this.#store.state;
    if (set) return (await this.sets()).reload();
    const due = photoSlots.flatMap((slot) => {
      const loaded = slots[slot];
      if (!loaded || loading.has(slot)) return [];
      const again = failed && problems[slot] !== undefined;
      return hasSize(loaded.content, settings.photoLimit) && !again ? [] : [{ slot, ...loaded }];
    });
    const files = Object.fromEntries(due.map(({ slot, file }) => [slot, file]));
    if (due[0]) await this.#load(files, due[0].origin);
  }

  /** After something was read with a size limit: has it follow the present one. */
  async #followLimit(limit: number): Promise<void> {
    if (this.#store.state.settings.photoLimit !== limit) await this.reloadPhotos();
  }

  /** What loads three photos or more. */
  sets(): Promise<SetLoader> {
    this.#sets ??= import("../many/set-loader.js").then(
      ({ SetLoader }) => new SetLoader(this.#store, () => this.#forget()),
    );
    return this.#sets;
  }

  /** Offers the way back after photos have taken the place of others, and to keep both. */
  #reportReplaced(before: State, photos: readonly File[], replaced: number): void {
    if (replaced === 0 && !before.set) return;
    const one = replaced === 1 && !before.set;
    this.#offerBack(
      before,
      one ? "The earlier photo was replaced." : "The earlier photos were replaced.",
      photos,
    );
  }

  /** Offers to come back to an earlier state, and then to add photos if there are any. */
  #offerBack(before: State, text: string, photos: readonly File[] = []): void {
    const run = () => this.comeBack(before);
    const keep = () => {
      run();
      void this.loadMany(photos, "add");
    };
    const keepAll = photos.length > 0 ? [{ label: "Keep all", run: keep }] : [];
    this.#store.set({ undo: { text, choices: [...keepAll, { label: "Undo", run }] } });
  }

  /** Comes back to the photos and the result of an earlier state; a set that was being read is read on. */
  comeBack(before: State): void {
    this.#forget();
    this.#store.set(cameBack(before, this.#store.state));
    void this.#reload(false);
  }

  clear(slots: readonly SlotName[]): void {
    for (const slot of slots) this.#latest.get(slot)?.abort();
    const { state } = this.#store;
    this.#store.set({
      slots: { ...state.slots, ...emptied(slots) },
      problems: without(state.problems, slots),
      loading: this.#loadingExcept(slots),
      message: null,
    });
  }

  /** Gives up what is being read: slots keep what they had. */
  cancel(): void {
    const { loading, set } = this.#store.state;
    this.#forget();
    if (set) void this.sets().then((loader) => loader.cancel());
    if (loading.size > 0) this.#store.set({ status: "Cancelled" });
  }

  /** Gives up what is being read for slots, and what waits for that. */
  #forget(): void {
    this.#cancelled += 1;
    this.#queue = Promise.resolve();
    this.#giveUp();
  }

  #giveUp(): void {
    for (const slot of this.#store.state.loading) this.#latest.get(slot)?.abort();
    this.#store.set({ loading: new Set() });
  }

  /** The slots that are being loaded besides these. */
  #loadingExcept(slots: readonly SlotName[]): ReadonlySet<SlotName> {
    return new Set([...this.#store.state.loading].filter((slot) => !slots.includes(slot)));
  }

  /** Begins to load a slot, and gives up what was being loaded there. */
  #begin(slot: SlotName): AbortSignal {
    this.#latest.get(slot)?.abort();
    const controller = new AbortController();
    this.#latest.set(slot, controller);
    return controller.signal;
  }

  /**
   * Loads files into their slots; those of a case take the place of all that is there. Returns false if all were given up or have been
   * replaced meanwhile.
   */
  async #load(
    files: Files,
    origin: Origin,
    theCase?: Pick<Case, "depth"> | null,
  ): Promise<boolean> {
    const names = slotNames.filter((slot) => files[slot]);
    const others = theCase ? slotNames.filter((slot) => !files[slot]) : [];
    const loads = names.map((slot) => ({ slot, signal: this.#begin(slot) }));
    const { state } = this.#store;
    this.#store.set({
      loading: new Set([...state.loading, ...names]),
      problems: without(state.problems, names),
      message: null,
      undo: null,
    });
    const limit = state.settings.photoLimit;
    const decoded = await Promise.all(
      loads.map(async ({ slot, signal }) => {
        const turns = turnsOf(state, slot, files);
        const how = { limit, turns, signal };
        return { slot, signal, outcome: await decodeSlot(slot, files[slot], origin, how) };
      }),
    );
    const current = () => decoded.filter(({ signal }) => !signal.aborted);
    const loaded = (): Partial<Slots> =>
      Object.assign({}, ...current().map(({ outcome }) => typeof outcome !== "string" && outcome));
    const filled = () => withLoaded({ ...this.#store.state.slots, ...emptied(others) }, loaded());
    const recoloured = await inOneColourSpace(filled, limit);
    if (names.length > 0 && current().length === 0) return false;
    for (const slot of others) this.#latest.get(slot)?.abort();
    let slots = filled();
    let problems = without(this.#store.state.problems, others);
    for (const { slot, outcome } of current()) {
      if (typeof outcome === "string") problems = { ...problems, [slot]: outcome };
    }
    for (const slot of photoSlots) {
      const again = recoloured[slot];
      if (again === undefined) continue;
      // In two colour spaces the photos cannot be stitched.
      slots = { ...slots, [slot]: typeof again === "string" ? null : again };
      if (typeof again === "string") problems = { ...problems, [slot]: again };
    }
    this.#store.set({
      ...(theCase && { set: null }),
      slots,
      settings: depthSettingsAfter(this.#store.state, slots, loaded(), theCase?.depth),
      problems,
      loading: this.#loadingExcept([...current().map(({ slot }) => slot), ...others]),
    });
    await this.#followLimit(limit);
    return true;
  }

  #say(message: Message | null): void {
    if (message) this.#store.set({ message });
  }
}

/** The settings after loading: they follow the depth maps that have come or gone. */
function depthSettingsAfter(
  { slots: before, settings }: State,
  slots: Slots,
  loaded: Partial<Slots>,
  depth: DepthSettings | undefined,
): Settings {
  let after = settings;
  if (before.targetDepth?.origin === "sample" && slots.target?.origin !== "sample") {
    // The meaning of the sample's values does not apply to files of the user.
    after = { ...after, depth: defaultSettings.depth, depthSource: "photos" };
  }
  if (loaded.targetDepth ?? loaded.referenceDepth) {
    after = { ...after, depthSource: "files", depth: depth ?? after.depth };
  }
  return after;
}

function namesAbsent(theCase: Case, placed: Files): string[] {
  return slotNames.flatMap((slot) => {
    const name = theCase.files[slot];
    return name !== undefined && !placed[slot] ? [name] : [];
  });
}

function emptied(names: readonly SlotName[]): { [K in SlotName]?: null } {
  return Object.fromEntries(names.map((name) => [name, null]));
}

function without<T>(
  values: { readonly [K in SlotName]?: T },
  names: readonly SlotName[],
): { readonly [K in SlotName]?: T } {
  const out = { ...values };
  for (const name of names) delete out[name];
  return out;
}
