import type { Rect, Size } from "../image-worker/contents.js";
import type { Shown } from "../image-worker/paint.js";
import type { Extent } from "./viewport.js";

/** Pixels that are drawn whole: more than most screens have. */
const mostWhole = 4e6;
/** By how much more than what is seen is made, of its width and height on each side, so that panning finds it there. */
const margin = 0.25;

/** Makes a part of a picture at the size that it is shown in. */
type Render = (shown: Shown) => Promise<ImageBitmap>;

/**
 * A picture of any size for drawing: whole at a size at which drawing is fast, and where that is too coarse the part that is seen, which is
 * made when it is first drawn.
 */
export class Picture {
  readonly #whole: ImageBitmap;
  readonly #render: Render;
  readonly #redraw: () => void;
  #detail: { readonly part: Rect; readonly bitmap: ImageBitmap } | null = null;
  #rendering = false;

  private constructor(
    readonly width: number,
    readonly height: number,
    whole: ImageBitmap,
    render: Render,
    redraw: () => void,
  ) {
    this.#whole = whole;
    this.#render = render;
    this.#redraw = redraw;
  }

  /** `redraw` is called when there is more detail. */
  static async of({ width, height }: Size, render: Render, redraw: () => void): Promise<Picture> {
    const scale = Math.min(1, Math.sqrt(mostWhole / (width * height)));
    const part = { x: 0, y: 0, width, height };
    const whole = await render({ part, size: scaled(part, scale) });
    return new Picture(width, height, whole, render, redraw);
  }

  /** Draws the picture to a place in the coordinates of the context. */
  draw(context: CanvasRenderingContext2D, { x, y, width, height }: Extent): void {
    context.drawImage(this.#whole, x, y, width, height);
    // Pixels of the screen per pixel of the picture.
    const scale = Math.min(1, (context.getTransform().a * width) / this.width);
    if (scale * this.width <= 1.1 * this.#whole.width) return;
    const [across, down] = [width / this.width, height / this.height];
    if (this.#detail) {
      const { part, bitmap } = this.#detail;
      const [left, top] = [x + part.x * across, y + part.y * down];
      context.drawImage(bitmap, left, top, part.width * across, part.height * down);
    }
    this.#see(seen(context, { x, y, width, height }, this), scale);
  }

  /** Makes a part unless it is there. */
  #see(part: Rect, scale: number): void {
    if (this.#rendering || part.width <= 0 || part.height <= 0) return;
    if (this.#detail && this.#isIn(this.#detail, part, scale)) return;
    const [right, bottom] = [part.width, part.height].map((side) => Math.ceil(margin * side)) as [
      number,
      number,
    ];
    const wider = within(
      part.x - right,
      part.y - bottom,
      part.width + 2 * right,
      part.height + 2 * bottom,
      this,
    );
    this.#rendering = true;
    void this.#render({ part: wider, size: scaled(wider, scale) })
      .then((bitmap) => {
        this.#detail?.bitmap.close();
        this.#detail = { part: wider, bitmap };
        this.#redraw();
      })
      // The whole is shown as before.
      .catch(() => undefined)
      .finally(() => (this.#rendering = false));
  }

  #isIn(
    { part, bitmap }: { part: Rect; bitmap: ImageBitmap },
    wanted: Rect,
    scale: number,
  ): boolean {
    const fine = 1.1 * bitmap.width >= scale * part.width;
    const [right, bottom] = [wanted.x + wanted.width, wanted.y + wanted.height];
    const around = part.x <= wanted.x && part.y <= wanted.y;
    return fine && around && part.x + part.width >= right && part.y + part.height >= bottom;
  }
}

/** The part of a picture that is on the canvas. */
function seen(context: CanvasRenderingContext2D, at: Extent, whole: Size): Rect {
  const inverse = context.getTransform().inverse();
  const { width, height } = context.canvas;
  const corners = [new DOMPoint(0, 0), new DOMPoint(width, height)];
  const [first, last] = corners.map((corner) => inverse.transformPoint(corner));
  const [across, down] = [whole.width / at.width, whole.height / at.height];
  const along = (p: number, start: number, pixels: number) => (p - start) * pixels;
  const left = Math.floor(along(first?.x ?? 0, at.x, across));
  const top = Math.floor(along(first?.y ?? 0, at.y, down));
  const right = Math.ceil(along(last?.x ?? 0, at.x, across));
  const bottom = Math.ceil(along(last?.y ?? 0, at.y, down));
  return within(left, top, right - left, bottom - top, whole);
}

/** The part of a rectangle that is in the picture. */
function within(x: number, y: number, width: number, height: number, whole: Size): Rect {
  const [left, top] = [Math.max(0, x), Math.max(0, y)];
  const [right, bottom] = [Math.min(whole.width, x + width), Math.min(whole.height, y + height)];
  return { x: left, y: top, width: right - left, height: bottom - top };
}

function scaled({ width, height }: Size, scale: number): Size {
  const side = (pixels: number) => Math.max(1, Math.round(pixels * scale));
  return { width: side(width), height: side(height) };
}
