import { defaultSettings, slotNames, withArrivals } from "../state.js";
import type { Contents, DepthSettings, Loaded, SlotName, Slots, Store } from "../state.js";
import { studio } from "../studio/client.js";
import { UnusableFile } from "../unusable-file.js";
import { parseCase, type Case } from "./case-file.js";
import { parseMatches } from "./matches-file.js";
import { isCaseFile, sortFiles } from "./sort-files.js";

type Files = { readonly [K in SlotName]?: File };
type Origin = Loaded<unknown>["origin"];

/** Puts files into slots: decodes them, and keeps what a slot held when its file cannot be used. */
export class InputLoader {
  readonly #store: Store;
  /** The newest load of each slot; an older one that ends later is forgotten. */
  readonly #latest = new Map<SlotName, symbol>();

  constructor(store: Store) {
    this.#store = store;
  }

  /** One file chosen for one slot. */
  async loadOne(slot: SlotName, file: File): Promise<void> {
    await this.#load({ [slot]: file }, "own");
  }

  /** Several files at once, placed by their names. */
  async loadMany(files: readonly File[]): Promise<void> {
    try {
      const caseFile = files.find(isCaseFile);
      const theCase = caseFile ? parseCase(await caseFile.text(), caseFile.name) : null;
      const { placed, left } = sortFiles(files, theCase, this.#store.state.slots);
      const absent = theCase ? namesAbsent(theCase, placed) : [];
      if (theCase) this.#emptyOthers(placed);
      await this.#load(placed, "own", theCase?.depth);
      this.#tellLeftovers(left, absent, Object.keys(placed).length);
    } catch (error) {
      this.#store.set({ message: unusable(error, "These files were not taken.") });
    }
  }

  /** The case that comes with the page. */
  async loadSample(folder: URL): Promise<void> {
    try {
      const theCase = parseCase(await (await fetchFile(folder, "case.json")).text(), "case.json");
      const files: { [K in SlotName]?: File } = {};
      await Promise.all(
        slotNames.map(async (slot) => {
          const name = theCase.files[slot];
          if (name !== undefined) files[slot] = await fetchFile(folder, name);
        }),
      );
      this.#emptyOthers(files);
      await this.#load(files, "sample", theCase.depth);
    } catch (error) {
      this.#store.set({ message: unusable(error, "The example could not be loaded.") });
    }
  }

  /** Decodes the photos anew, after the limit of their size has changed. */
  async reloadPhotos(): Promise<void> {
    const { target, reference } = this.#store.state.slots;
    const files = {
      ...(target && { target: target.file }),
      ...(reference && { reference: reference.file }),
    };
    await this.#load(files, (target ?? reference)?.origin ?? "own");
  }

  clear(slots: readonly SlotName[]): void {
    const emptied: { [K in SlotName]?: null } = {};
    for (const slot of slots) {
      this.#latest.delete(slot);
      emptied[slot] = null;
    }
    const { state } = this.#store;
    this.#store.set({
      slots: { ...state.slots, ...emptied },
      problems: without(state.problems, slots),
      loading: new Set([...state.loading].filter((slot) => !slots.includes(slot))),
      message: null,
    });
  }

  /** A case brings everything that it has: what it lacks is emptied, what it brings is replaced on arrival. */
  #emptyOthers(files: Files): void {
    this.clear(slotNames.filter((slot) => !files[slot]));
  }

  /** `depth` says what the values of the depth maps among the files mean, where that is known. */
  async #load(files: Files, origin: Origin, depth?: DepthSettings): Promise<void> {
    const names = slotNames.filter((slot) => files[slot]);
    const token = Symbol();
    for (const slot of names) this.#latest.set(slot, token);
    const { state } = this.#store;
    this.#store.set({
      loading: new Set([...state.loading, ...names]),
      problems: without(state.problems, names),
      message: null,
    });

    const limit = state.settings.photoLimit;
    const outcomes = await Promise.all(
      names.map((slot) => attempt(slot, files[slot], origin, limit)),
    );

    const current = names.filter((slot) => this.#latest.get(slot) === token);
    let { slots, problems, settings } = this.#store.state;
    let arrived: Partial<Slots> = {};
    for (const [index, slot] of names.entries()) {
      const outcome = outcomes[index];
      if (!outcome || !current.includes(slot)) continue;
      if (typeof outcome === "string") problems = { ...problems, [slot]: outcome };
      else arrived = { ...arrived, ...outcome };
    }
    const sampleDepth = slots.targetDepth?.origin === "sample";
    slots = withArrivals(slots, arrived);
    if (sampleDepth && slots.target?.origin !== "sample") {
      // What the sample's values meant says nothing about the user's.
      settings = { ...settings, depth: defaultSettings.depth, depthSource: "photos" };
    }
    if (arrived.targetDepth ?? arrived.referenceDepth) {
      settings = { ...settings, depthSource: "files", depth: depth ?? settings.depth };
    }
    this.#store.set({
      slots,
      settings,
      problems,
      loading: new Set([...this.#store.state.loading].filter((slot) => !current.includes(slot))),
    });
  }

  #tellLeftovers(left: readonly File[], absent: readonly string[], placed: number): void {
    const names = left.map((file) => file.name).join(", ");
    if (placed === 0) {
      this.#store.set({
        message: {
          tone: "error",
          title: "None of these files fits anywhere.",
          advice: `Photos are JPEG, PNG or WebP; depth maps gray PNG, .npy or .pfm; matches a CSV file. Not taken: ${names || "nothing named"}.`,
        },
      });
    } else if (absent.length > 0) {
      this.#store.set({
        message: {
          tone: "error",
          title: "The case is not complete.",
          advice: `It names ${absent.join(", ")}: drop all files of the case together.`,
        },
      });
    } else if (left.length > 0) {
      this.#store.set({
        message: {
          tone: "note",
          title: "Some files were not needed.",
          advice: `Two photos are joined at a time. Left out: ${names}.`,
        },
      });
    }
  }
}

/** How a file becomes what its slot holds. Each rejects with an {@link UnusableFile} whose message is for the user. */
const decoders: { readonly [K in SlotName]: (file: File, limit: number) => Promise<Contents[K]> } =
  {
    target: (file, limit) => studio("decodePhoto", file, file.name, limit),
    reference: (file, limit) => studio("decodePhoto", file, file.name, limit),
    targetDepth: (file) => studio("decodeDepth", file, file.name),
    referenceDepth: (file) => studio("decodeDepth", file, file.name),
    matches: async (file) => parseMatches(await file.text(), file),
  };

/** The slot with its file decoded, or why that failed. */
async function attempt<K extends SlotName>(
  slot: K,
  file: File | undefined,
  origin: Origin,
  limit: number,
): Promise<Partial<Slots> | string | null> {
  if (!file) return null;
  try {
    return { [slot]: { file, content: await decoders[slot](file, limit), origin } };
  } catch (error) {
    return error instanceof Error ? error.message : String(error);
  }
}

function namesAbsent(theCase: Case, placed: Files): string[] {
  return slotNames.flatMap((slot) => {
    const name = theCase.files[slot];
    return name !== undefined && !placed[slot] ? [name] : [];
  });
}

async function fetchFile(folder: URL, name: string): Promise<File> {
  const response = await fetch(new URL(name, folder));
  if (!response.ok) throw new UnusableFile(`${name}: the server answered ${response.status}.`);
  const blob = await response.blob();
  return new File([blob], name, { type: blob.type });
}

function unusable(error: unknown, title: string) {
  const advice =
    error instanceof UnusableFile
      ? error.message
      : "Check the connection, or choose photos of your own.";
  return { tone: "error", title, advice } as const;
}

function without<T>(
  values: { readonly [K in SlotName]?: T },
  names: readonly SlotName[],
): { readonly [K in SlotName]?: T } {
  const out = { ...values };
  for (const name of names) delete out[name];
  return out;
}
