/** Views in the mosaic's own coordinates: the second photo begins at 0, 0. */
import { make } from "../dom.js";
import { percent, size, count } from "../words/numbers.js";
import { countSet } from "../words/report.js";
import type { Outcome } from "../state.js";
import { gainBitmap, pictureBitmap, seamBitmap, voidsBitmap } from "./bitmaps.js";
import { checkbox, legend, scale } from "./controls.js";
import { drawGrid } from "./grid.js";
import type { View } from "./view.js";
import type { Extent } from "./viewport.js";

/** Where a picture of the outcome's canvas lies. */
export function canvasExtent({ result }: Pick<Outcome, "result">): Extent {
  const { offset, mosaic } = result;
  return { x: -offset.x, y: -offset.y, width: mosaic.width, height: mosaic.height };
}

/** A bitmap of the outcome's canvas, at its place. */
export function drawCanvas(
  context: CanvasRenderingContext2D,
  bitmap: ImageBitmap,
  { x, y, width, height }: Extent,
): void {
  context.drawImage(bitmap, x, y, width, height);
}

export const mosaicView: View = {
  id: "mosaic",
  label: "Picture",
  group: "result",
  async open(outcome, desk) {
    const bitmap = await pictureBitmap(outcome.mosaic);
    const extent = canvasExtent(outcome);
    const guessed = outcome.result.report.model === "two-view";
    const offer = make("button", { type: "button" }, "Make it again with depth maps…");
    offer.addEventListener("click", () => desk.askForDepth());
    return {
      scene: { extent, space: "canvas", draw: (context) => drawCanvas(context, bitmap, extent) },
      caption:
        `Both photos in one picture, ${size(outcome.mosaic)} pixels.` +
        (guessed ? " Where only the first photo looks, how far things are is a guess." : ""),
      controls: guessed ? [offer] : [],
    };
  },
};

export const warpView: View = {
  id: "warp",
  label: "Warp",
  group: "steps",
  async open(outcome, desk) {
    const { result, job } = outcome;
    const bitmap = await pictureBitmap(result.warped);
    const extent = canvasExtent(outcome);
    let [grid, outline] = [true, true];
    return {
      scene: {
        extent,
        space: "canvas",
        draw(context, pixel) {
          drawCanvas(context, bitmap, extent);
          if (grid) drawGrid(context, outcome, pixel);
          if (outline) drawOutline(context, job.reference, pixel);
        },
      },
      caption:
        "The first photo as the second one's camera would see it, with a regular grid carried along. Where the grid bends, near things move against far ones; empty places were hidden from the first camera.",
      controls: [
        checkbox("Grid", grid, (on) => {
          grid = on;
          desk.redraw();
        }),
        checkbox("Frame of the second photo", outline, (on) => {
          outline = on;
          desk.redraw();
        }),
      ],
    };
  },
};

function drawOutline(
  context: CanvasRenderingContext2D,
  { width, height }: { readonly width: number; readonly height: number },
  pixel: number,
): void {
  for (const [colour, dash] of [
    ["rgb(0 0 0 / 0.6)", []],
    ["#fff", [6 * pixel, 4 * pixel]],
  ] as const) {
    context.strokeStyle = colour;
    context.lineWidth = 1.5 * pixel;
    context.setLineDash([...dash]);
    context.strokeRect(0, 0, width, height);
  }
  context.setLineDash([]);
}

export const gainView: View = {
  id: "gain",
  label: "Gain",
  group: "steps",
  has: ({ result }) => result.gains.some((gain) => gain !== 1),
  async open(outcome, desk) {
    const { bitmap, most } = await gainBitmap(outcome, () => desk.averaged(outcome));
    const extent = canvasExtent(outcome);
    const [red, green, blue] = outcome.result.gains.map((value) => value.toFixed(2));
    return {
      scene: { extent, space: "canvas", draw: (context) => drawCanvas(context, bitmap, extent) },
      caption: `By how much the first photo was made brighter or darker to fit the second. On average over the overlap its red, green and blue were multiplied by ${red}, ${green} and ${blue}, as light.`,
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
  async open(outcome) {
    const { seam } = outcome.result;
    const bitmap = await seamBitmap(outcome, seam);
    const extent = canvasExtent(outcome);
    const both = seam.data.includes(3);
    return {
      scene: { extent, space: "canvas", draw: (context) => drawCanvas(context, bitmap, extent) },
      caption: both
        ? "Where the photos overlap, both are mixed."
        : "Which photo shows where. The seam runs where the photos differ least, so that nothing is seen twice.",
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

export const voidsView: View = {
  id: "voids",
  label: "Voids",
  group: "steps",
  async open(outcome) {
    const bitmap = await voidsBitmap(outcome);
    const extent = canvasExtent(outcome);
    const { voidMask } = outcome.result;
    const voids = countSet(voidMask.data);
    const share = percent(voids / voidMask.data.length);
    return {
      scene: { extent, space: "canvas", draw: (context) => drawCanvas(context, bitmap, extent) },
      caption:
        voids === 0
          ? "Every place inside the first photo's outline was seen by one of the photos: nothing had to be invented."
          : `${count(voids, "pixel", "pixels")} (${share}) ${voids === 1 ? "was" : "were"} seen by neither photo. What the picture shows there is invented from what surrounds it.`,
      controls: voids === 0 ? [] : [legend(["void", "seen by neither photo"])],
    };
  },
};
