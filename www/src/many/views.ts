/** Views of the mosaic of many photos, in the coordinates of the reference. */
import { make } from "../dom.js";
import type { ManyOutcome } from "../state.js";
import { count, size } from "../text/numbers.js";
import { labelsPicture } from "../view/bitmaps.js";
import { canvasScene, mosaicScene } from "../view/canvas-views.js";
import { checkbox } from "../view/controls.js";
import type { View } from "../view/view-types.js";
import { cssColour, photoColour } from "./colours.js";
import { usedCount } from "./report-text.js";

export const manyMosaicView: View<ManyOutcome> = {
  id: "mosaic",
  label: "Mosaic",
  group: "result",
  async open(outcome, view) {
    const { result, photos } = outcome;
    const reference = photos[result.reference]?.file.name ?? "";
    return {
      ...(await mosaicScene(outcome, view)),
      caption: `The mosaic of ${count(usedCount(outcome), "photo", "photos")}, seen from ${reference}, ${size(outcome.mosaic)} pixels.`,
    };
  },
};

export const manySeamView: View<ManyOutcome> = {
  id: "seam",
  label: "Seam",
  group: "steps",
  async open(outcome, view) {
    const { result, photos } = outcome;
    const colours = Uint8Array.from(photos.flatMap((_, index) => photoColour(index)));
    const picture = await labelsPicture(outcome, colours, view);
    let frames = false;
    const entries = photos.flatMap(({ file }, index) => {
      if (!result.photos[index]?.used) return [];
      const swatch = make("i");
      swatch.style.background = cssColour(index);
      return [make("li", { title: file.name }, swatch, `${index + 1}\u00a0${file.name}`)];
    });
    return {
      scene: canvasScene(outcome, picture, (context, pixel) => {
        if (frames) drawFrames(context, outcome, pixel);
      }),
      caption:
        "The photo that each pixel comes from. The seams follow pixels where the photos differ least, which avoids ghosting.",
      controls: [
        checkbox("Extent of each photo", frames, (on) => {
          frames = on;
          view.redraw();
        }),
        make("ul", { class: "swatches names" }, ...entries),
      ],
    };
  },
};

/** Draws the rectangle around each photo, in its colour, with its number. */
function drawFrames(
  context: CanvasRenderingContext2D,
  { result }: ManyOutcome,
  pixel: number,
): void {
  for (const [index, { extent }] of result.photos.entries()) {
    if (!extent) continue;
    const { x, y, width, height } = extent;
    for (const [colour, line] of [
      ["rgb(0 0 0 / 0.6)", 4],
      [cssColour(index), 2],
    ] as const) {
      context.strokeStyle = colour;
      context.lineWidth = line * pixel;
      context.strokeRect(x, y, width, height);
    }
    context.font = `600 ${14 * pixel}px system-ui, sans-serif`;
    context.textBaseline = "top";
    context.lineWidth = 3 * pixel;
    context.strokeStyle = "rgb(0 0 0 / 0.7)";
    const at = [x + 6 * pixel, y + 6 * pixel] as const;
    context.strokeText(String(index + 1), ...at);
    context.fillStyle = "#fff";
    context.fillText(String(index + 1), ...at);
  }
}
