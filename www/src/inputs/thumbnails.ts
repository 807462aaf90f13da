import type { Size } from "../image-worker/contents.js";
import { context2d, showOn } from "../dom.js";
import type { Slots, State } from "../state.js";
import { imageTask } from "../image-worker/client.js";
import { colours } from "../image-worker/depth-colours.js";

/** Twice the width of the widest card, for high-density screens. */
const width = 480;

/** Draws the thumbnail of a slot. */
export async function drawThumbnail(
  canvas: HTMLCanvasElement,
  slot: keyof Slots,
  { slots, settings }: State,
): Promise<void> {
  switch (slot) {
    case "target":
    case "reference":
      if (slots[slot]) showOn(canvas, slots[slot].content.preview);
      break;
    case "targetDepth":
    case "referenceDepth":
      if (slots[slot]) {
        const bitmap = await imageTask("depthBitmap", slots[slot].content, settings.depth, width);
        showOn(canvas, bitmap);
        bitmap.close();
      }
      break;
    case "matches":
      if (slots.matches) {
        drawMatches(canvas, slots.matches.content, slots.target?.content.original ?? null);
      }
      break;
  }
}

/** Draws each match as a line from its position in the target to that in the reference; longer ones are brighter. */
function drawMatches(canvas: HTMLCanvasElement, matches: Float32Array, photo: Size | null): void {
  const extent = photo ?? extentOf(matches);
  const scale = width / extent.width;
  canvas.width = width;
  canvas.height = Math.max(1, Math.round(extent.height * scale));
  const context = context2d(canvas);
  const lines = lineList(matches);
  const lengths = lines.map(([xt, yt, xr, yr]) => Math.hypot(xr - xt, yr - yt));
  const longest = [...lengths].sort((a, b) => a - b)[Math.floor(0.95 * (lengths.length - 1))] || 1;
  // A few hundred evenly sampled lines; more would be illegible.
  const step = Math.max(1, Math.ceil(lines.length / 400));
  context.lineWidth = 1.5;
  for (let i = 0; i < lines.length; i += step) {
    const [xt, yt, xr, yr] = lines[i] ?? [0, 0, 0, 0];
    const index = 3 * Math.round(255 * (0.25 + 0.75 * Math.min(1, (lengths[i] ?? 0) / longest)));
    const colour = `rgb(${colours.subarray(index, index + 3).join(" ")})`;
    context.strokeStyle = colour;
    context.fillStyle = colour;
    context.beginPath();
    context.moveTo(xt * scale, yt * scale);
    context.lineTo(xr * scale, yr * scale);
    context.stroke();
    context.fillRect(xt * scale - 2, yt * scale - 2, 4, 4);
  }
}

function lineList(matches: Float32Array): [number, number, number, number][] {
  return Array.from({ length: Math.floor(matches.length / 4) }, (_, i) => {
    const [xt = 0, yt = 0, xr = 0, yr = 0] = matches.subarray(4 * i, 4 * i + 4);
    return [xt, yt, xr, yr];
  });
}

function extentOf(matches: Float32Array): Size {
  let [right, bottom] = [1, 1];
  for (const [xt, yt] of lineList(matches)) {
    right = Math.max(right, xt);
    bottom = Math.max(bottom, yt);
  }
  return { width: right, height: Math.min(bottom, 2 * right) };
}
