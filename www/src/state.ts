import type { Options, Progress, StitchResult } from "depthstitch";

/** A depth map as its file has it; what its values mean is said by {@link DepthSettings}. */
export interface DepthMap {
  readonly data: Uint8Array | Uint16Array;
  readonly width: number;
  readonly height: number;
}

/** What each input holds once its file is decoded. */
export interface Contents {
  target: ImageData;
  reference: ImageData;
  targetDepth: DepthMap;
  referenceDepth: DepthMap;
  /** xt, yt, xr, yr of one match after the other. */
  matches: Float32Array;
}

export type SlotName = keyof Contents;

export const slotNames: readonly SlotName[] = [
  "target",
  "reference",
  "targetDepth",
  "referenceDepth",
  "matches",
];

export interface Loaded<T> {
  readonly file: string;
  readonly content: T;
  /** The sample's files go together: they leave when the first photo of the user's own arrives. */
  readonly origin: "sample" | "own";
}

export type Slots = { readonly [K in SlotName]: Loaded<Contents[K]> | null };

/** What the values of both depth maps mean. */
export interface DepthSettings {
  readonly kind: "inverse" | "metric";
  /** The value that stands for "unknown", if there is one. */
  readonly invalid: number | null;
}

/** Something to tell the user: what happened, and what to do next. */
export interface Message {
  readonly tone: "error" | "note";
  readonly title: string;
  readonly advice: string;
}

/** A result with what it was made from; it stays on the page until the next one is there. */
export interface Outcome {
  readonly result: StitchResult;
  readonly slots: Slots;
  readonly options: Partial<Options>;
  /** Milliseconds from click to result, with worker and copies. */
  readonly elapsed: number;
}

export interface State {
  readonly slots: Slots;
  /** Why a slot's last file was not taken. */
  readonly problems: { readonly [K in SlotName]?: string };
  /** Slots whose file is being decoded. */
  readonly loading: ReadonlySet<SlotName>;
  readonly depth: DepthSettings;
  readonly running: Progress | null;
  readonly message: Message | null;
  readonly outcome: Outcome | null;
  /** What the status line says while nothing runs. */
  readonly status: string;
}

export const noSlots: Slots = {
  target: null,
  reference: null,
  targetDepth: null,
  referenceDepth: null,
  matches: null,
};

export const initialState: State = {
  slots: noSlots,
  problems: {},
  loading: new Set(),
  depth: { kind: "inverse", invalid: null },
  running: null,
  message: null,
  outcome: null,
  status: "Loading the sample…",
};

type Listener = (state: State, before: State) => void;

/** The page's one state. Views subscribe and draw what changed. */
export class Store {
  #state = initialState;
  readonly #listeners: Listener[] = [];

  get state(): State {
    return this.#state;
  }

  set(change: Partial<State>): void {
    const before = this.#state;
    this.#state = { ...before, ...change };
    for (const listener of this.#listeners) listener(this.#state, before);
  }

  /** Calls `listener` now and after every change. */
  subscribe(listener: Listener): void {
    this.#listeners.push(listener);
    listener(this.#state, initialState);
  }
}

/** The slots after `arrived`: a photo of the user's own takes the sample's other files away. */
export function withArrivals(slots: Slots, arrived: Partial<Slots>): Slots {
  const ownPhoto = [arrived.target, arrived.reference].some((photo) => photo?.origin === "own");
  const kept = ownPhoto ? withoutSample(slots) : slots;
  return { ...kept, ...arrived };
}

function withoutSample(slots: Slots): Slots {
  const entries = Object.entries(slots).filter(([, slot]) => slot?.origin === "own");
  return { ...noSlots, ...Object.fromEntries(entries) };
}

/** What is still needed before the photos can be stitched, in words; `null` when all is there. */
export function missing({
  target,
  reference,
  targetDepth,
  referenceDepth,
  matches,
}: Slots): Message | null {
  const note = (title: string, advice: string): Message => ({ tone: "note", title, advice });
  if (!target && !reference) {
    return note(
      "Two photos are needed.",
      "Choose a target and a reference, or go back to the sample.",
    );
  }
  if (!target)
    return note("The target photo is missing.", "Choose the photo that is to be warped.");
  if (!reference)
    return note("The reference photo is missing.", "Choose the photo that stays as it is.");
  if (!matches) {
    return note(
      "A matches file is needed.",
      "This version does not look for matches itself. Choose a CSV file with the header xt,yt,xr,yr and one pair of points " +
        "a line, in pixels of the target and of the reference.",
    );
  }
  if (targetDepth && !referenceDepth) {
    return note(
      "The reference's depth map is missing.",
      "Depth is needed for both photos: add it, or remove the target's.",
    );
  }
  if (referenceDepth && !targetDepth) {
    return note(
      "The target's depth map is missing.",
      "Depth is needed for both photos: add it, or remove the reference's.",
    );
  }
  return null;
}
