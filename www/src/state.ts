import type { Options, Progress, StitchResult } from "depthstitch";
import type { DepthModelName, OnnxDepth } from "./networks/requests.js";
import type { Job } from "./run/job.js";
import type { DepthMap, Photo } from "./studio/contents.js";

/** What each input holds once its file is decoded. */
export interface Contents {
  target: Photo;
  reference: Photo;
  targetDepth: DepthMap;
  referenceDepth: DepthMap;
  /** xt, yt, xr, yr of one match after the other, in pixels of the photos as they are in their files. */
  matches: Float32Array;
}

export type SlotName = keyof Contents;
export type PhotoSlot = "target" | "reference";

export const photoSlots: readonly PhotoSlot[] = ["target", "reference"];
export const slotNames: readonly SlotName[] = [
  ...photoSlots,
  "targetDepth",
  "referenceDepth",
  "matches",
];
export const depthSlot = { target: "targetDepth", reference: "referenceDepth" } as const;

export interface Loaded<T> {
  readonly file: File;
  readonly content: T;
  /** The sample's files go together: they leave when the first photo of the user's own arrives. */
  readonly origin: "sample" | "own";
}

export type Slots = { readonly [K in SlotName]: Loaded<Contents[K]> | null };

/** What the values of the depth maps from files mean. */
export interface DepthSettings {
  readonly kind: "inverse" | "metric";
  /** The value that stands for "unknown", if there is one. */
  readonly invalid: number | null;
}

/** Where depth comes from: from the two photos alone, from files, or from a network that runs in this browser. */
export type DepthSource = "photos" | "files" | "model";

/** What fills the voids that neither photo saw: the core itself, or a network that runs in this browser. */
export type Filler = "core" | "migan" | "lama";

/** Everything that the user chose besides files; a link can carry it. */
export interface Settings {
  /** Longer side in pixels that photos are scaled down to, 0 for none. */
  readonly photoLimit: number;
  readonly depthSource: DepthSource;
  readonly depth: DepthSettings;
  readonly depthModel: DepthModelName;
  /** Where depth networks are fetched from; empty for the library's own choice. */
  readonly depthHost: string;
  readonly depthOnnx: OnnxDepth;
  readonly filler: Filler;
  /** Where the filling network's weights are; empty for where its authors published them. */
  readonly fillAddress: string;
  /** Only those that differ from their mode's defaults. */
  readonly options: Partial<Options>;
}

/** What tells the chosen depth network from others. */
export function depthNetworkOf({ depthModel, depthOnnx }: Settings): string {
  const { address, colours, output } = depthOnnx;
  return depthModel === "onnx" ? [address, colours, output].join(" ") : depthModel;
}

/** Depth maps that the network made, by photo, and which network it was. */
export type ModelDepths = ReadonlyMap<Photo, { readonly model: string; readonly map: DepthMap }>;

/** Something to tell the user: what happened, and what to do next. */
export interface Message {
  readonly tone: "error" | "note";
  readonly title: string;
  readonly advice: string;
}

/** A result with what it was made from; it stays on the page until the next one is there. */
export interface Outcome {
  readonly result: StitchResult;
  /** The mosaic as it is shown and saved: the result's, or with its voids filled by a network. */
  readonly mosaic: StitchResult["mosaic"];
  readonly job: Job;
  readonly slots: Slots;
  readonly settings: Settings;
  /** Milliseconds from click to result, with worker and copies. */
  readonly elapsed: number;
}

/** What runs now: a stage of the core, or a network. */
export interface Running {
  readonly stage: Progress["stage"] | "model-depth" | "model-fill";
  readonly fraction: number;
  /** What the status says instead of the stage's usual words. */
  readonly words?: string;
}

export interface State {
  readonly slots: Slots;
  /** Why a slot's last file was not taken. */
  readonly problems: { readonly [K in SlotName]?: string };
  /** Slots whose file is being decoded. */
  readonly loading: ReadonlySet<SlotName>;
  readonly settings: Settings;
  readonly modelDepths: ModelDepths;
  readonly running: Running | null;
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

export const defaultSettings: Settings = {
  photoLimit: 2048,
  depthSource: "photos",
  depth: { kind: "inverse", invalid: null },
  depthModel: "small",
  depthHost: "",
  depthOnnx: { address: "", colours: "imagenet", output: "inverse" },
  filler: "core",
  fillAddress: "",
  options: {},
};

export const initialState: State = {
  slots: noSlots,
  problems: {},
  loading: new Set(),
  settings: defaultSettings,
  modelDepths: new Map(),
  running: null,
  message: null,
  outcome: null,
  status: "",
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

  change(settings: Partial<Settings>): void {
    this.set({ settings: { ...this.#state.settings, ...settings } });
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

/** Target and reference exchanged, with all that belongs to them. */
export function swapped({ target, reference, targetDepth, referenceDepth, matches }: Slots): Slots {
  return {
    target: reference,
    reference: target,
    targetDepth: referenceDepth,
    referenceDepth: targetDepth,
    matches: matches && { ...matches, content: swapMatches(matches.content) },
  };
}

function swapMatches(matches: Float32Array): Float32Array {
  return matches.map((_, i) => matches[i % 4 < 2 ? i + 2 : i - 2] ?? 0);
}
