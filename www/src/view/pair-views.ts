/** Views of the two photos side by side. */
import type { DepthOutput } from "depthstitch";
import type { Held } from "../image-worker/contents.js";
import type { Outcome } from "../state.js";
import { count, percent } from "../text/numbers.js";
import { depthBitmap, pictureOf } from "./bitmaps.js";
import { checkbox } from "./controls.js";
import type { Picture } from "./picture.js";
import type { View } from "./view-types.js";
import type { Scene } from "./viewer.js";
import type { Extent } from "./viewport.js";

/** The layout of the two photos: side by side, or one below the other on narrow screens. */
interface Layout {
  readonly width: number;
  readonly height: number;
  readonly second: { readonly x: number; readonly y: number };
}

function layoutOf({ job: { target, reference } }: Outcome): Layout {
  const stacked = matchMedia("(max-width: 560px)").matches && target.width > target.height;
  const gap = 0.02 * Math.max(target.width, reference.width);
  return stacked
    ? {
        width: Math.max(target.width, reference.width),
        height: target.height + gap + reference.height,
        second: { x: 0, y: target.height + gap },
      }
    : {
        width: target.width + gap + reference.width,
        height: Math.max(target.height, reference.height),
        second: { x: target.width + gap, y: 0 },
      };
}

/** Draws one of two images to its place. */
type Draw = (context: CanvasRenderingContext2D, extent: Extent) => void;

/** A scene of two images side by side with an overlay. */
function pairScene(
  outcome: Outcome,
  images: () => readonly [Draw, Draw],
  over?: (context: CanvasRenderingContext2D, layout: Layout, pixel: number) => void,
): Scene {
  const { target, reference } = outcome.job;
  const layout = layoutOf(outcome);
  return {
    extent: { x: 0, y: 0, width: layout.width, height: layout.height },
    space: "pair",
    draw(context, pixel) {
      const [first, second] = images();
      first(context, { x: 0, y: 0, width: target.width, height: target.height });
      second(context, { ...layout.second, width: reference.width, height: reference.height });
      over?.(context, layout, pixel);
    },
  };
}

const inlierColour = "#35d0ba";
const outlierColour = "#ff7a45";
/** Maximum number of lines; more would be illegible. */
const maxLines = 250;

export const matchesView: View = {
  id: "matches",
  label: "Matches",
  group: "steps",
  async open(outcome, view) {
    const { job, result } = outcome;
    const { targetDepth, referenceDepth } = result;
    const photos = await both(
      drawn(pictureOf(job.target.pixels, outcome, view)),
      drawn(pictureOf(job.reference.pixels, outcome, view)),
    );
    const shown = { inliers: true, outliers: true, lines: false, depth: false };
    let depth: readonly [Draw, Draw] | null = null;
    const toggle = (key: keyof typeof shown, text: string, swatch = "") =>
      checkbox(
        text,
        shown[key],
        (on) => {
          shown[key] = on;
          view.redraw();
        },
        swatch,
      );
    const depthToggle = () =>
      checkbox("Depth", false, (on) => {
        shown.depth = on;
        if (!on || depth || !targetDepth || !referenceDepth) return view.redraw();
        both(drawnMap(targetDepth), drawnMap(referenceDepth)).then((maps) => {
          depth = maps;
          view.redraw();
        }, view.fail);
      });
    const { report } = result;
    return {
      scene: pairScene(
        outcome,
        () => (shown.depth && depth ? depth : photos),
        (context, layout, pixel) => drawMatches(context, outcome, layout, shown, pixel),
      ),
      caption:
        `Corresponding points: ${count(report.matches, "match", "matches")} ${job.matches ? "given" : "found"}. ` +
        `${report.inliers} (${percent(report.inliers / Math.max(1, report.matches))}) are inliers.`,
      controls: [
        toggle("inliers", "Inliers", "inlier"),
        toggle("outliers", "Outliers", "outlier"),
        toggle("lines", "Lines"),
        ...(targetDepth && referenceDepth ? [depthToggle()] : []),
      ],
    };
  },
};

function drawMatches(
  context: CanvasRenderingContext2D,
  { result: { matches, inliers } }: Outcome,
  { second }: Layout,
  shown: { readonly inliers: boolean; readonly outliers: boolean; readonly lines: boolean },
  pixel: number,
): void {
  // The radius grows with the zoom, within limits.
  const radius = Math.min(2.4 * pixel, Math.max(1.1 * pixel, 3));
  for (const agrees of [false, true]) {
    if (!(agrees ? shown.inliers : shown.outliers)) continue;
    const points = new Path2D();
    const lines = new Path2D();
    const step = Math.max(1, Math.ceil(inliers.length / maxLines));
    for (let i = 0; i < inliers.length; i++) {
      if (Boolean(inliers[i]) !== agrees) continue;
      const [xt = 0, yt = 0, xr = 0, yr = 0] = matches.subarray(4 * i, 4 * i + 4);
      const from = [xt + 0.5, yt + 0.5] as const;
      const to = [xr + 0.5 + second.x, yr + 0.5 + second.y] as const;
      for (const [x, y] of [from, to]) {
        points.moveTo(x + radius, y);
        points.arc(x, y, radius, 0, 2 * Math.PI);
      }
      if (i % step !== 0) continue;
      lines.moveTo(...from);
      lines.lineTo(...to);
    }
    const colour = agrees ? inlierColour : outlierColour;
    if (shown.lines) {
      context.lineWidth = pixel;
      context.globalAlpha = 0.55;
      context.strokeStyle = colour;
      context.stroke(lines);
      context.globalAlpha = 1;
    }
    context.lineWidth = 0.6 * radius;
    context.strokeStyle = "rgb(0 0 0 / 0.5)";
    context.stroke(points);
    context.fillStyle = colour;
    context.fill(points);
  }
}

export const depthView: View = {
  id: "depth",
  label: "Depth",
  group: "steps",
  isAvailable: ({ result }) => Boolean(result.targetDepth && result.referenceDepth),
  async open(outcome) {
    const { result, job, settings } = outcome;
    const { targetDepth, referenceDepth } = result;
    if (!targetDepth || !referenceDepth) throw new Error("This result has no depth.");
    const maps = await both(drawnMap(targetDepth), drawnMap(referenceDepth));
    const given = job.targetDepth ?? job.referenceDepth;
    const network = settings.depthModel === "onnx" ? "the custom network" : "Depth Anything";
    const source =
      settings.depthSource === "model" ? `estimated by ${network}` : "from the depth maps";
    return {
      scene: pairScene(outcome, () => maps),
      caption: given
        ? `Inverse depth ${source}, refined by stereo matching. Yellow is near, violet is far.`
        : "Inverse depth, computed from the two photos. Yellow is near, violet is far.",
    };
  },
};

async function drawn(picture: Promise<Picture>): Promise<Draw> {
  const made = await picture;
  return (context, extent) => made.draw(context, extent);
}

async function drawnMap(map: Held<DepthOutput>): Promise<Draw> {
  const bitmap = await depthBitmap(map);
  return (context, { x, y, width, height }) => context.drawImage(bitmap, x, y, width, height);
}

async function both(first: Promise<Draw>, second: Promise<Draw>): Promise<readonly [Draw, Draw]> {
  return Promise.all([first, second]);
}
