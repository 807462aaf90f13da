/** Views in the coordinates of the second photo. */
import { make } from "../dom.js";
import { percent, size, count } from "../text/numbers.js";
import { imageTask } from "../image-worker/client.js";
import type { ManyOutcome, Outcome } from "../state.js";
import { fillSentence } from "../text/report.js";
import {
  gainFieldOf,
  gainPicture,
  pictureOf,
  seamPicture,
  shownReference,
  voidsPicture,
} from "./bitmaps.js";
import { checkbox, legend, scale } from "./controls.js";
import { cropOutline, drawOutline } from "./crop-outline.js";
import { drawGrid, gridOf } from "./grid.js";
import type { Picture } from "./picture.js";
import type { Opened, View, ViewContext } from "./view-types.js";
import type { Scene } from "./viewer.js";
import type { Extent } from "./viewport.js";

/** The extent of the canvas. */
export function canvasExtent({ result }: Pick<Outcome | ManyOutcome, "result">): Extent {
  const { offset, mosaic } = result;
  return { x: -offset.x, y: -offset.y, width: mosaic.width, height: mosaic.height };
}

/** A picture of the canvas, and what is drawn over it. */
export function canvasScene(
  outcome: Outcome | ManyOutcome,
  picture: Picture,
  drawOver?: Scene["draw"],
): Scene {
  const extent = canvasExtent(outcome);
  return {
    extent,
    space: "canvas",
    draw(context, pixel) {
      picture.draw(context, extent);
      drawOver?.(context, pixel);
    },
  };
}

/** The mosaic, of two photos or many, with the outline of what would be saved. */
export async function mosaicScene(
  outcome: Outcome | ManyOutcome,
  view: ViewContext,
): Promise<Pick<Opened, "scene" | "close">> {
  const picture = await pictureOf(outcome.mosaic, outcome, view);
  const saved = cropOutline(outcome, view);
  return { scene: canvasScene(outcome, picture, saved.draw), close: saved.close };
}

export const mosaicView: View = {
  id: "mosaic",
  label: "Mosaic",
  group: "result",
  async open(outcome, view) {
    const { job, result } = outcome;
    const uncertain = Boolean(result.targetDepth && !job.targetDepth);
    const offer = make("button", { type: "button" }, "Improve with a depth model…");
    offer.addEventListener("click", () => view.offerDepth());
    return {
      ...(await mosaicScene(outcome, view)),
      caption:
        `The mosaic of both photos, ${size(outcome.mosaic)} pixels.` +
        (uncertain ? " Distances are estimated where only the first photo is visible." : ""),
      controls: uncertain ? [offer] : [],
    };
  },
};

export const warpView: View = {
  id: "warp",
  label: "Aligned first photo",
  group: "steps",
  async open(outcome, view) {
    const { result } = outcome;
    const picture = await pictureOf(result.warped, outcome, view);
    const { width, height } = shownReference(outcome);
    // The grid's lines are straight between its nodes, and a frame is, on a plane only.
    const plane = result.projection === "plane";
    const mesh = plane ? await gridOf(outcome) : null;
    let [grid, outline] = [plane, plane];
    return {
      scene: canvasScene(outcome, picture, (context, pixel) => {
        if (grid && mesh) drawGrid(context, mesh, pixel);
        if (outline) drawOutline(context, { x: 0, y: 0, width, height }, pixel);
      }),
      caption:
        "The first photo as seen by the camera of the second" +
        (plane
          ? ", with a regular grid that is warped with it. The grid bends where parallax changes; "
          : "; ") +
        "empty areas were occluded in the first photo.",
      controls: !plane
        ? []
        : [
            checkbox("Grid", grid, (on) => {
              grid = on;
              view.redraw();
            }),
            checkbox("Frame of the second photo", outline, (on) => {
              outline = on;
              view.redraw();
            }),
          ],
    };
  },
};

export const gainView: View = {
  id: "gain",
  label: "Brightness",
  group: "steps",
  isAvailable: ({ result }) => result.gains.some((gain) => gain !== 1),
  async open(outcome, view) {
    const field = await gainFieldOf(outcome, () => view.averaged(outcome));
    const picture = await gainPicture(outcome, field, view);
    const most = 2 ** field.range;
    const [red, green, blue] = outcome.result.gains.map((value) => value.toFixed(2));
    return {
      scene: canvasScene(outcome, picture),
      caption: `Exposure compensation of the first photo. The mean factors of red, green and blue over the overlap, in linear light, are ${red}, ${green} and ${blue}.`,
      controls: [
        scale("gains", `darker, × ${(1 / most).toFixed(2)}`, `brighter, × ${most.toFixed(2)}`),
      ],
    };
  },
};

export const seamView: View = {
  id: "seam",
  label: "Seam",
  group: "steps",
  async open(outcome, view) {
    const { seam } = outcome.result;
    const picture = await seamPicture(outcome, seam, view);
    const both = await imageTask("includes", seam, 3);
    return {
      scene: canvasScene(outcome, picture),
      caption: both
        ? "Where the photos overlap, both are blended."
        : "The photo that each pixel comes from. The seam follows pixels where the photos differ least, which avoids ghosting.",
      controls: [
        legend(
          ["from-target", "first photo"],
          ["from-reference", "second photo"],
          ...(both ? [["from-both", "both"] as const] : []),
        ),
      ],
    };
  },
};

export const voidsView: View<Outcome | ManyOutcome> = {
  id: "voids",
  label: "Filled gaps",
  group: "steps",
  async open(outcome, view) {
    const picture = await voidsPicture(outcome, view);
    const { voids, voidMask } = outcome.result;
    const share = percent(voids / (voidMask.width * voidMask.height));
    return {
      scene: canvasScene(outcome, picture),
      caption:
        voids === 0
          ? `There are no gaps: all pixels inside the outline of ${outcome.kind === "many" ? "the photos" : "the first photo"} are visible in one of the photos.`
          : `${count(voids, "pixel", "pixels")} (${share}) ${voids === 1 ? "is" : "are"} visible in no photo and ${fillSentence(outcome.settings)}.`,
      controls: voids === 0 ? [] : [legend(["void", "visible in no photo"])],
    };
  },
};
