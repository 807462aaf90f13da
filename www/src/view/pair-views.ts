/** Views of the two photos beside each other, before anything is moved. */
import type { Outcome } from "../state.js";
import { count, percent } from "../words/numbers.js";
import { depthBitmap, pictureBitmap } from "./bitmaps.js";
import { checkbox } from "./controls.js";
import type { View } from "./view.js";
import type { Scene } from "./viewer.js";

/** Where the two photos lie: side by side, or on a narrow screen one below the other. */
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

/** Both photos, or what stands for them, and something over both. */
function pairScene(
  outcome: Outcome,
  bitmaps: () => readonly (readonly [ImageBitmap, ImageBitmap])[],
  over?: (context: CanvasRenderingContext2D, layout: Layout, pixel: number) => void,
): Scene {
  const { target, reference } = outcome.job;
  const layout = layoutOf(outcome);
  return {
    extent: { x: 0, y: 0, width: layout.width, height: layout.height },
    space: "pair",
    draw(context, pixel) {
      for (const [first, second] of bitmaps()) {
        context.drawImage(first, 0, 0, target.width, target.height);
        const { x, y } = layout.second;
        context.drawImage(second, x, y, reference.width, reference.height);
      }
      over?.(context, layout, pixel);
    },
  };
}

const inlierColour = "#35d0ba";
const outlierColour = "#ff7a45";
/** More lines than this would only be a blot; more points are fine. */
const mostLines = 250;

export const matchesView: View = {
  id: "matches",
  label: "Matches",
  group: "steps",
  async open(outcome, desk) {
    const { job, result } = outcome;
    const { targetDepth, referenceDepth } = result;
    const photos = await both(pictureBitmap(job.target), pictureBitmap(job.reference));
    const shown = { inliers: true, outliers: true, lines: false, depth: false };
    let depth: readonly [ImageBitmap, ImageBitmap] | null = null;
    const toggle = (key: keyof typeof shown, words: string, swatch = "") =>
      checkbox(
        words,
        shown[key],
        (on) => {
          shown[key] = on;
          desk.redraw();
        },
        swatch,
      );
    const depthToggle = () =>
      checkbox("Depth", false, (on) => {
        shown.depth = on;
        if (!on || depth || !targetDepth || !referenceDepth) return desk.redraw();
        void both(depthBitmap(targetDepth), depthBitmap(referenceDepth)).then((bitmaps) => {
          depth = bitmaps;
          desk.redraw();
        });
      });
    const { report } = result;
    return {
      scene: pairScene(
        outcome,
        () => [shown.depth && depth ? depth : photos],
        (context, layout, pixel) => drawMatches(context, outcome, layout, shown, pixel),
      ),
      caption:
        `The same points in both photos: ${count(report.matches, "match", "matches")} ${job.matches ? "given" : "found"}. ` +
        `${report.inliers} (${percent(report.inliers / Math.max(1, report.matches))}) agree with one geometry; the others were left out.`,
      controls: [
        toggle("inliers", "Agreeing", "inlier"),
        toggle("outliers", "Left out", "outlier"),
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
  // Small where many points share little room, larger when one looks closer.
  const radius = Math.min(2.4 * pixel, Math.max(1.1 * pixel, 3));
  for (const agrees of [false, true]) {
    if (!(agrees ? shown.inliers : shown.outliers)) continue;
    const points = new Path2D();
    const lines = new Path2D();
    const step = Math.max(1, Math.ceil(inliers.length / mostLines));
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
  has: ({ result }) => Boolean(result.targetDepth && result.referenceDepth),
  async open(outcome) {
    const { result, job, settings } = outcome;
    const { targetDepth, referenceDepth } = result;
    if (!targetDepth || !referenceDepth) throw new Error("This result has no depth.");
    const bitmaps = await both(depthBitmap(targetDepth), depthBitmap(referenceDepth));
    const given = job.targetDepth ?? job.referenceDepth;
    const network = settings.depthModel === "onnx" ? "your network" : "Depth Anything";
    const source =
      settings.depthSource === "model" ? `as ${network} sees it` : "as your depth maps say";
    return {
      scene: pairScene(outcome, () => [bitmaps]),
      caption: given
        ? `How near everything is, ${source}, made finer by comparing the photos. Yellow is near, violet far.`
        : "How near everything is, found by comparing the two photos: what moves more is nearer. Yellow is near, violet far.",
    };
  },
};

async function both(
  first: Promise<ImageBitmap>,
  second: Promise<ImageBitmap>,
): Promise<readonly [ImageBitmap, ImageBitmap]> {
  return Promise.all([first, second]);
}
