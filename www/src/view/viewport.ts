import type { Size } from "../image-worker/contents.js";

/** The part of a scene shown in the frame: its centre in scene coordinates, and frame pixels per unit. */
export interface Viewport {
  readonly x: number;
  readonly y: number;
  readonly scale: number;
}

/** The bounds of a scene. */
export interface Extent extends Size {
  readonly x: number;
  readonly y: number;
}

/** Maximum number of screen pixels per image pixel. */
const maxScale = 32;
/** Margin around a fitted scene, in pixels of the frame. */
const margin = 8;

/** The viewport that shows the whole scene. */
export function fit(extent: Extent, frame: Size): Viewport {
  const room = (side: keyof Size) => Math.max(1, frame[side] - 2 * margin) / extent[side];
  return {
    x: extent.x + extent.width / 2,
    y: extent.y + extent.height / 2,
    scale: Math.min(room("width"), room("height")),
  };
}

/** Zooms by `factor` around a point of the frame. */
export function zoomed(
  view: Viewport,
  factor: number,
  at: { readonly x: number; readonly y: number },
  extent: Extent,
  frame: Size,
): Viewport {
  const least = fit(extent, frame).scale;
  const scale = Math.min(Math.max(view.scale * factor, least), Math.max(maxScale, least));
  // Offset of the fixed point from the centre, before and after.
  const shift = 1 / view.scale - 1 / scale;
  const moved = {
    x: view.x + (at.x - frame.width / 2) * shift,
    y: view.y + (at.y - frame.height / 2) * shift,
    scale,
  };
  return clampView(moved, extent, frame);
}

/** Pans by a number of pixels of the frame. */
export function panned(
  view: Viewport,
  dx: number,
  dy: number,
  extent: Extent,
  frame: Size,
): Viewport {
  return clampView(
    { ...view, x: view.x - dx / view.scale, y: view.y - dy / view.scale },
    extent,
    frame,
  );
}

/** Moves a viewport so that it does not leave the scene. */
export function clampView(view: Viewport, extent: Extent, frame: Size): Viewport {
  const along = (at: number, from: number, length: number, room: number) => {
    const half = Math.max(0, room / 2 - margin) / view.scale;
    // A dimension that fits is centred; otherwise the frame is filled.
    if (length <= 2 * half) return from + length / 2;
    return Math.min(Math.max(at, from + half), from + length - half);
  };
  return {
    x: along(view.x, extent.x, extent.width, frame.width),
    y: along(view.y, extent.y, extent.height, frame.height),
    scale: view.scale,
  };
}
