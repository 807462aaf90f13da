import type { Options, Progress, StitchManyResult } from "depthstitch";
import type { DepthMap, Photo } from "./image-worker/contents.js";
import { defaultLimit, type PhotoSet, type SetPhoto } from "./many/photo-set.js";
import type { DepthModelName, OnnxDepth } from "./networks/requests.js";
import type { Job } from "./run/job.js";
import type { Kept, PairResult } from "./run/kept.js";
import type { PhotoSlot, SlotName, Slots } from "./slots.js";

export * from "./slots.js";

/** Meaning of the values of depth maps from files. */
export interface DepthSettings {
  readonly kind: "inverse" | "metric";
  /** The value that means "unknown", if any. */
  readonly invalid: number | null;
}

/** Source of depth: the two photos, files, or a network that runs in the browser. */
export type DepthSource = "photos" | "files" | "model";

/** What fills the voids: the core, or a network that runs in the browser. */
export type FillMethod = "core" | "migan" | "lama";

/** Everything the user can choose except files. */
export interface Settings {
  /** Longer side in pixels to which photos are downscaled; 0 for no limit. */
  readonly photoLimit: number;
  readonly depthSource: DepthSource;
  readonly depth: DepthSettings;
  readonly depthModel: DepthModelName;
  /** Host of depth networks; empty for the default of the library. */
  readonly depthHost: string;
  readonly depthOnnx: OnnxDepth;
  readonly fillMethod: FillMethod;
  /** URL of the weights of the inpainting network; empty for where they were published. */
  readonly fillAddress: string;
  /** Only those that differ from the defaults of their mode. */
  readonly options: Partial<Options>;
}

/** Identifies the selected depth network. */
export function depthNetworkOf({ depthModel, depthOnnx }: Settings): string {
  const { address, colours, output } = depthOnnx;
  return depthModel === "onnx" ? [address, colours, output].join(" ") : depthModel;
}

/** Depth maps estimated by networks, by photo. */
export type NetworkDepths = ReadonlyMap<Photo, { readonly model: string; readonly map: DepthMap }>;

/** A message to the user: what happened, and what to do next. */
export interface Message {
  readonly tone: "error" | "note";
  readonly title: string;
  readonly advice: string;
  /** Whether it is about files, so that it stays while others are stitched. */
  readonly lasting?: boolean;
}

/** What is left of the message when a run begins or ends well. */
export function lastingMessage({ message }: State): Message | null {
  return message?.lasting ? message : null;
}

/** A result of two photos with its inputs. */
export interface Outcome {
  readonly kind: "pair";
  readonly result: PairResult;
  /** The mosaic as shown and saved: that of the result, or with voids inpainted by a network. */
  readonly mosaic: PairResult["mosaic"];
  readonly job: Job;
  readonly slots: Slots;
  readonly settings: Settings;
  /** Milliseconds from click to result, including copies to and from the worker. */
  readonly elapsed: number;
}

/** A result of three photos or more with its inputs. */
export interface ManyOutcome {
  readonly kind: "many";
  readonly result: Kept<StitchManyResult>;
  /** The mosaic as shown and saved, as of two photos. */
  readonly mosaic: Kept<StitchManyResult>["mosaic"];
  /** Those that were stitched, in the order of the result. */
  readonly photos: readonly SetPhoto[];
  readonly set: PhotoSet;
  readonly settings: Settings;
  readonly elapsed: number;
}

/** The colour space of a result, which is that of all its photos. */
export function coloursOf(outcome: Outcome | ManyOutcome): PredefinedColorSpace {
  const photo = outcome.kind === "many" ? outcome.photos[0]?.content : outcome.job.reference;
  return photo?.colourSpace ?? "srgb";
}

/** The task in progress: a stage of the core, or a network. */
export interface Running {
  readonly stage: Progress["stage"] | "model-depth" | "model-fill";
  readonly fraction: number;
  /** Status text, if different from that of the stage. */
  readonly text?: string;
  /** What it is at within the stage: too frequent to be announced. */
  readonly detail?: string;
}

/** The way back from something that the user may not have meant, or another one. */
export interface Undo {
  readonly text: string;
  readonly choices: readonly { readonly label: string; run(): void }[];
}

export interface State {
  readonly slots: Slots;
  /** Three photos or more, in place of those in the slots. */
  readonly set: PhotoSet | null;
  /** Why the last file of a slot was rejected. */
  readonly problems: { readonly [K in SlotName]?: string };
  /** Slots whose file is being decoded. */
  readonly loading: ReadonlySet<SlotName>;
  readonly settings: Settings;
  readonly networkDepths: NetworkDepths;
  readonly running: Running | null;
  readonly message: Message | null;
  /** It is shown until the next one is available. */
  readonly outcome: Outcome | ManyOutcome | null;
  /** The last one whose picture was saved, copied or shared. */
  readonly saved: Outcome | ManyOutcome | null;
  readonly undo: Undo | null;
  /** Status text while idle. */
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
  photoLimit: defaultLimit,
  depthSource: "photos",
  depth: { kind: "inverse", invalid: null },
  depthModel: "small",
  depthHost: "",
  depthOnnx: { address: "", colours: "imagenet", output: "inverse" },
  fillMethod: "core",
  fillAddress: "",
  options: {},
};

export const initialState: State = {
  slots: noSlots,
  set: null,
  problems: {},
  loading: new Set(),
  settings: defaultSettings,
  networkDepths: new Map(),
  running: null,
  message: null,
  outcome: null,
  saved: null,
  undo: null,
  status: "",
};

type Listener = (state: State, before: State) => void;

/** The state of the page. Subscribers update what has changed. */
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

  /** Changes settings. What the page said about the earlier ones is no longer true. */
  change(settings: Partial<Settings>): void {
    this.set({ settings: { ...this.#state.settings, ...settings }, message: null });
  }

  /** Calls `listener` now and after every change. */
  subscribe(listener: Listener): void {
    this.#listeners.push(listener);
    listener(this.#state, initialState);
  }
}

/** The slots after loading `loaded`. A photo of the user removes all files of the sample. */
export function withLoaded(slots: Slots, loaded: Partial<Slots>): Slots {
  const ownPhoto = [loaded.target, loaded.reference].some((photo) => photo?.origin === "own");
  return { ...(ownPhoto ? withoutSample(slots) : slots), ...loaded };
}

function withoutSample(slots: Slots): Slots {
  const entries = Object.entries(slots).filter(([, slot]) => slot?.origin === "own");
  return { ...noSlots, ...Object.fromEntries(entries) };
}

/** Swaps target and reference with their depth maps and matches. */
export function swapped({ target, reference, targetDepth, referenceDepth, matches }: Slots): Slots {
  return {
    target: reference,
    reference: target,
    targetDepth: referenceDepth,
    referenceDepth: targetDepth,
    matches: matches && { ...matches, content: swapMatches(matches.content) },
  };
}

/** The matches after one of the photos was turned by 90° clockwise. `height` is that of its original before. */
export function turnMatches(matches: Float32Array, slot: PhotoSlot, height: number): Float32Array {
  const first = slot === "target" ? 0 : 2;
  return matches.map((at, i) => {
    if (i % 4 === first) return height - 1 - (matches[i + 1] ?? 0);
    return i % 4 === first + 1 ? (matches[i - 1] ?? 0) : at;
  });
}

function swapMatches(matches: Float32Array): Float32Array {
  return matches.map((_, i) => matches[i % 4 < 2 ? i + 2 : i - 2] ?? 0);
}
