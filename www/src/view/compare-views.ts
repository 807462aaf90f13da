/** Views that compare two images. */
import type { PairResult } from "../run/kept.js";
import { make } from "../dom.js";
import { isDegenerate, methods } from "../run/methods.js";
import { decibels, percent, similarity } from "../text/numbers.js";
import { pictureOf, shownReference } from "./bitmaps.js";
import { canvasExtent } from "./canvas-views.js";
import { selection } from "./controls.js";
import type { Picture } from "./picture.js";
import type { View } from "./view-types.js";
import type { Extent } from "./viewport.js";

/** The method that the result is compared with, and the position of the divider. */
export const comparison = { method: "homography", share: 0.5 };

/** The result of a method, to be drawn. */
interface Compared {
  readonly picture: Picture;
  readonly extent: Extent;
  readonly label: string;
}

export const compareView: View = {
  id: "compare",
  label: "Before and after",
  group: "result",
  async open(outcome, view) {
    const offered = methods.filter((method) => !isDegenerate(method, outcome));
    const after = await pictureOf(outcome.mosaic, outcome, view);
    const afterExtent = canvasExtent(outcome);
    const choose = async (id: string): Promise<Compared | null> => {
      const method = offered.find((offer) => offer.id === id) ?? offered[0];
      if (!method) return null;
      const result = await view.resultBy(method, outcome);
      const picture = await pictureOf(result.mosaic, outcome, view);
      comparison.method = method.id;
      const label = `${method.label} · ${qualityText(result)}`;
      return { picture, extent: canvasExtent({ result }), label };
    };
    // Without one, as it was cancelled or has failed, another one can be chosen.
    let before = await choose(comparison.method).catch(() => null);

    const slider = makeSlider();
    const move = (share: number) => {
      comparison.share = share;
      showShare(slider);
      view.redraw();
    };
    slider.addEventListener("input", () => move(slider.valueAsNumber / 1000));
    const choices = Object.fromEntries(offered.map(({ id, label }) => [id, label]));
    return {
      scene: {
        extent: before ? union(before.extent, afterExtent) : afterExtent,
        space: "canvas",
        split: {
          get: () => comparison.share,
          set: move,
        },
        draw(context) {
          const { width, height } = context.canvas;
          const at = comparison.share * width;
          clipped(context, [0, 0, at, height], () => {
            before?.picture.draw(context, before.extent);
          });
          clipped(context, [at, 0, width - at, height], () => after.draw(context, afterExtent));
          drawDivider(context, at);
          drawLabel(context, before?.label ?? "", at, "right");
          drawLabel(context, `depthstitch · ${qualityText(outcome.result)}`, at, "left");
        },
      },
      caption: "Left: the other method; right: depthstitch. Drag the divider, or use the slider.",
      controls: [
        slider,
        selection("Before:", choices, before ? comparison.method : "", async (id) => {
          before = await choose(id);
          view.redraw();
        }),
      ],
    };
  },
};

/** A slider for the divider, for use by keyboard. */
function makeSlider(): HTMLInputElement {
  const slider = make("input", {
    type: "range",
    min: "0",
    max: "1000",
    "aria-label": "Position of the divider",
  });
  showShare(slider);
  return slider;
}

function showShare(slider: HTMLInputElement): void {
  slider.value = String(1000 * comparison.share);
  slider.setAttribute("aria-valuetext", percent(comparison.share));
}

/** How well the photos agree in the overlap, and on how much of it that is known. */
export function qualityText({ quality: { psnrMask, ssimMask, coverage } }: PairResult): string {
  return `${decibels(psnrMask)} · SSIM ${similarity(ssimMask)} · covers ${percent(coverage)}`;
}

function union(a: Extent, b: Extent): Extent {
  const x = Math.min(a.x, b.x);
  const y = Math.min(a.y, b.y);
  return {
    x,
    y,
    width: Math.max(a.x + a.width, b.x + b.width) - x,
    height: Math.max(a.y + a.height, b.y + b.height) - y,
  };
}

/** Draws within a rectangle of the screen. */
function clipped(
  context: CanvasRenderingContext2D,
  [x, y, width, height]: readonly [number, number, number, number],
  draw: () => void,
): void {
  const transform = context.getTransform();
  context.save();
  context.resetTransform();
  context.beginPath();
  context.rect(x, y, width, height);
  context.clip();
  context.setTransform(transform);
  draw();
  context.restore();
}

function drawDivider(context: CanvasRenderingContext2D, at: number): void {
  const { height } = context.canvas;
  const dense = window.devicePixelRatio;
  context.save();
  context.resetTransform();
  context.fillStyle = "rgb(0 0 0 / 0.5)";
  context.fillRect(at - 2 * dense, 0, 4 * dense, height);
  context.fillStyle = "#fff";
  context.fillRect(at - dense, 0, 2 * dense, height);
  context.beginPath();
  context.arc(at, height / 2, 14 * dense, 0, 2 * Math.PI);
  context.shadowColor = "rgb(0 0 0 / 0.5)";
  context.shadowBlur = 6 * dense;
  context.fill();
  context.shadowBlur = 0;
  context.fillStyle = "#17625f";
  for (const side of [-1, 1]) {
    context.beginPath();
    context.moveTo(at + side * 9 * dense, height / 2);
    context.lineTo(at + side * 4 * dense, height / 2 - 4.5 * dense);
    context.lineTo(at + side * 4 * dense, height / 2 + 4.5 * dense);
    context.fill();
  }
  context.restore();
}

/** Draws a label beside the divider, if there is room. */
function drawLabel(
  context: CanvasRenderingContext2D,
  label: string,
  at: number,
  side: "left" | "right",
): void {
  const dense = window.devicePixelRatio;
  context.save();
  context.resetTransform();
  context.font = `500 ${12 * dense}px system-ui, sans-serif`;
  const room = side === "right" ? at : context.canvas.width - at;
  const fits = (text: string) => context.measureText(text).width + 32 * dense < room;
  const text = [label, label.split(" · ")[0] ?? ""].find(fits);
  if (text) {
    const width = context.measureText(text).width + 16 * dense;
    const x = side === "right" ? at - width - 8 * dense : at + 8 * dense;
    context.fillStyle = "rgb(0 0 0 / 0.65)";
    context.fillRect(x, 10 * dense, width, 24 * dense);
    context.fillStyle = "#fff";
    context.textBaseline = "middle";
    context.fillText(text, x + 8 * dense, 22 * dense);
  }
  context.restore();
}

/** Milliseconds that each photo is shown. */
const blinkTime = 700;

export const blinkView: View = {
  id: "blink",
  label: "Blink",
  group: "result",
  async open(outcome, view) {
    const { result } = outcome;
    const shown = shownReference(outcome);
    const [warped, reference] = await Promise.all([
      pictureOf(result.warped, outcome, view),
      pictureOf(shown, outcome, view),
    ]);
    const { width, height } = shown;
    let first = false;
    let timer = 0;
    const names = ["Second photo, the reference", "First photo, aligned"];
    const words = () => names[Number(first)] ?? "";
    const which = make("output", {}, words());
    const flip = () => {
      first = !first;
      which.textContent = words();
      view.redraw();
    };
    const button = make("button", { type: "button" });
    const run = (on: boolean) => {
      clearInterval(timer);
      timer = on ? window.setInterval(flip, blinkTime) : 0;
      // Said by screen readers when asked for, but not twice a second.
      which.setAttribute("aria-live", on ? "off" : "polite");
      button.textContent = on ? "Stop" : "Blink";
    };
    button.addEventListener("click", () => run(timer === 0));
    const step = make("button", { type: "button" }, "Other photo");
    step.addEventListener("click", () => {
      run(false);
      flip();
    });
    run(!matchMedia("(prefers-reduced-motion: reduce)").matches);
    return {
      scene: {
        extent: { x: 0, y: 0, width, height },
        space: "canvas",
        draw(context) {
          context.save();
          context.beginPath();
          context.rect(0, 0, width, height);
          context.clip();
          reference.draw(context, { x: 0, y: 0, width, height });
          if (first) warped.draw(context, canvasExtent(outcome));
          context.restore();
          drawLabel(context, words(), 0, "left");
        },
      },
      caption:
        "The overlap of the warped first photo and the second photo, shown alternately. Misaligned areas appear to move.",
      controls: [which, button, step],
      close: () => run(false),
    };
  },
};
