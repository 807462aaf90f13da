import { byId } from "../dom.js";
import { savedPart } from "../panels/save-size.js";
import type { ManyOutcome, Outcome } from "../state.js";
import type { ViewContext } from "./view-types.js";
import type { Extent } from "./viewport.js";

/** Draws what will be saved over a view of the mosaic, while it is a part of it. */
export function cropOutline(outcome: Outcome | ManyOutcome, view: ViewContext) {
  const choice = byId("save-crop", HTMLSelectElement);
  choice.addEventListener("change", view.redraw);
  return {
    draw(context: CanvasRenderingContext2D, pixel: number): void {
      const { x, y, width, height } = savedPart(outcome, choice.value);
      const { mosaic, result } = outcome;
      if (width === mosaic.width && height === mosaic.height) return;
      drawOutline(
        context,
        { x: x - result.offset.x, y: y - result.offset.y, width, height },
        pixel,
      );
    },
    close: () => choice.removeEventListener("change", view.redraw),
  };
}

/** Draws a dashed frame that is seen on any ground. */
export function drawOutline(
  context: CanvasRenderingContext2D,
  { x, y, width, height }: Extent,
  pixel: number,
): void {
  for (const [colour, dash] of [
    ["rgb(0 0 0 / 0.6)", []],
    ["#fff", [6 * pixel, 4 * pixel]],
  ] as const) {
    context.strokeStyle = colour;
    context.lineWidth = 1.5 * pixel;
    context.setLineDash([...dash]);
    context.strokeRect(x, y, width, height);
  }
  context.setLineDash([]);
}
