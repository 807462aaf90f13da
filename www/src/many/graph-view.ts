/** The graph of pairs: photos in a circle, joined where they have points in common. */
import type { ManyOutcome } from "../state.js";
import { count } from "../text/numbers.js";
import { legend } from "../view/controls.js";
import type { View } from "../view/view-types.js";

/** Sides of the drawing and of the thumbnails in it, in its own units. */
const side = 1000;

export const graphView: View<ManyOutcome> = {
  id: "graph",
  label: "Graph",
  group: "result",
  open(outcome) {
    const { pairs } = outcome.result;
    const linked = pairs.filter((pair) => pair.linked).length;
    return Promise.resolve({
      scene: {
        extent: { x: 0, y: 0, width: 1.5 * side, height: side },
        space: "graph",
        draw: (context, pixel) => drawGraph(context, outcome, pixel),
      },
      caption:
        `${count(linked, "pair", "pairs")} of the ${pairs.length} that were compared ${linked === 1 ? "has" : "have"} enough points in common: ` +
        "the thicker the line, the more inliers, whose number it bears. All numbers are in the table of pairs below.",
      controls: [legend(["linked", "enough points in common"], ["unlinked", "too few"])],
    });
  },
};

function drawGraph(
  context: CanvasRenderingContext2D,
  { result, photos }: ManyOutcome,
  pixel: number,
): void {
  const thumb = Math.min(220, 900 / Math.max(3, photos.length));
  const places = photos.map((_, index) => {
    const angle = (2 * Math.PI * index) / photos.length - Math.PI / 2;
    return {
      x: (0.75 + 0.62 * Math.cos(angle)) * side,
      y: (0.5 + 0.4 * Math.sin(angle)) * side,
    };
  });
  const most = Math.max(1, ...result.pairs.map(({ inliers }) => inliers));
  const numbers: { text: string; x: number; y: number }[] = [];
  // Those with the most inliers are drawn last.
  for (const { photos: pair, inliers, linked } of [...result.pairs].sort(
    (a, b) => Number(a.linked) - Number(b.linked) || a.inliers - b.inliers,
  )) {
    const [a, b] = pair.map((index) => places[index]);
    if (!a || !b || inliers === 0) continue;
    context.beginPath();
    context.moveTo(a.x, a.y);
    context.lineTo(b.x, b.y);
    context.setLineDash(linked ? [] : [5 * pixel, 5 * pixel]);
    context.lineWidth = linked ? (1.5 + 6.5 * Math.sqrt(inliers / most)) * pixel : 1.5 * pixel;
    context.strokeStyle = linked ? "#1f9c8b" : "#8b9192";
    context.stroke();
    // Not in the middle, where the lines of a circle cross.
    const at = (from: number, to: number) => 0.64 * from + 0.36 * to;
    if (linked) numbers.push({ text: String(inliers), x: at(a.x, b.x), y: at(a.y, b.y) });
  }
  context.setLineDash([]);
  // Numbers of more lines would cover each other.
  if (numbers.length <= 24) for (const number of numbers) drawBadge(context, number, pixel, false);
  for (const [index, { content }] of photos.entries()) {
    const place = places[index];
    if (!content || !place) continue;
    const { preview } = content;
    const scale = thumb / Math.max(preview.width, preview.height);
    const [width, height] = [preview.width * scale, preview.height * scale];
    const [x, y] = [place.x - width / 2, place.y - height / 2];
    const used = result.photos[index]?.used === true;
    context.globalAlpha = used ? 1 : 0.45;
    context.drawImage(preview, x, y, width, height);
    context.globalAlpha = 1;
    context.lineWidth = (index === result.reference ? 4 : 1.5) * pixel;
    context.strokeStyle = used ? "#1f9c8b" : "#c4513f";
    context.strokeRect(x, y, width, height);
    drawBadge(
      context,
      { text: String(index + 1), x: x + 12 * pixel, y: y + 12 * pixel },
      pixel,
      true,
    );
  }
}

/** A number on a dark ground. */
function drawBadge(
  context: CanvasRenderingContext2D,
  { text, x, y }: { readonly text: string; readonly x: number; readonly y: number },
  pixel: number,
  strong: boolean,
): void {
  context.font = `${strong ? 700 : 500} ${12 * pixel}px system-ui, sans-serif`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  const width = Math.max(18 * pixel, context.measureText(text).width + 8 * pixel);
  context.fillStyle = strong ? "#17625f" : "rgb(20 24 26 / 0.85)";
  context.fillRect(x - width / 2, y - 9 * pixel, width, 18 * pixel);
  context.fillStyle = "#fff";
  context.fillText(text, x, y);
  context.textAlign = "start";
}
