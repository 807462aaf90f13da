import type { ImageOutput } from "depthstitch";
import type { Method } from "../run/methods.js";
import type { PairResult } from "../run/kept.js";
import type { Outcome } from "../state.js";
import type { Scene } from "./viewer.js";

/** What views can use of the page. */
export interface ViewContext {
  /** Redraws the current scene. */
  redraw(): void;
  /** Says in the caption why something cannot be shown. */
  fail(error: unknown): void;
  /** Opens the settings of the depth network. */
  offerDepth(): void;
  /** Stitches the photos of the outcome by another method, unless the result is cached. */
  resultBy(method: Method, outcome: Outcome): Promise<PairResult>;
  /** The mosaic with average blending, with exposure compensation as in the outcome. */
  averaged(outcome: Outcome): Promise<ImageOutput>;
}

/** A view that has been opened on an outcome. */
export interface Opened {
  readonly scene: Scene;
  /** One or two sentences. */
  readonly caption: string;
  readonly controls?: readonly Node[];
  /** Stops activities of the view. */
  close?(): void;
}

/** A visualization of an outcome: of two photos, unless it says otherwise. */
export interface View<O = Outcome> {
  readonly id: string;
  readonly label: string;
  /** The result, or a step of the method. */
  readonly group: "result" | "steps";
  /** Whether the view is available (default: always). */
  isAvailable?(outcome: O): boolean;
  open(outcome: O, view: ViewContext): Promise<Opened>;
}
