import type { ImageOutput, StitchResult } from "depthstitch";
import type { Method } from "../run/methods.js";
import type { Outcome } from "../state.js";
import type { Scene } from "./viewer.js";

/** What a view may ask of the page. */
export interface Desk {
  /** Draws the scene that is shown again. */
  redraw(): void;
  /** Leads to where depth maps can be had. */
  askForDepth(): void;
  /** Stitches the outcome's photos by another method, unless that is known already. */
  resultBy(method: Method, outcome: Outcome): Promise<StitchResult>;
  /** Both photos averaged where both are, the first one with its exposure fitted as in the outcome. */
  averaged(outcome: Outcome): Promise<ImageOutput>;
}

/** A view that has been opened on an outcome. */
export interface Opened {
  readonly scene: Scene;
  /** One or two sentences on what is seen. */
  readonly caption: string;
  readonly controls?: readonly Node[];
  /** Ends what goes on while the view is shown. */
  close?(): void;
}

/** One way to look at an outcome. */
export interface View {
  readonly id: string;
  readonly label: string;
  /** The result itself, or a step on the way to it. */
  readonly group: "result" | "steps";
  /** Whether there is something to see; a view without this always has. */
  has?(outcome: Outcome): boolean;
  open(outcome: Outcome, desk: Desk): Promise<Opened>;
}
