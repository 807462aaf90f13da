import type { Size } from "../studio/contents.js";

/** Which part of a picture's own coordinates a frame shows: what lies at its middle, and frame pixels per unit. */
export interface Viewport {
  readonly x: number;
  readonly y: number;
  readonly scale: number;
}

/** Where a picture lies in its coordinates. */
export interface Extent extends Size {
  readonly x: number;
  readonly y: number;
}

/** Pixels of a photo may grow to this many of the screen. */
const closest = 32;
/** Room around a whole picture, in pixels of the frame. */
const margin = 8;

/** The whole picture, as large as the frame allows. */
export function fit(extent: Extent, frame: Size): Viewport {
  const room = (side: keyof Size) => Math.max(1, frame[side] - 2 * margin) / extent[side];
  return {
    x: extent.x + extent.width / 2,
    y: extent.y + extent.height / 2,
    scale: Math.min(room("width"), room("height")),
  };
}

/** Zoomed by `factor` so that what lies at the frame's point stays there. */
export function zoomed(
  view: Viewport,
  factor: number,
  at: { readonly x: number; readonly y: number },
  extent: Extent,
  frame: Size,
): Viewport {
  const least = fit(extent, frame).scale;
  const scale = Math.min(Math.max(view.scale * factor, least), Math.max(closest, least));
  // Distance of the fixed point from the frame's middle, before and after.
  const shift = 1 / view.scale - 1 / scale;
  const moved = {
    x: view.x + (at.x - frame.width / 2) * shift,
    y: view.y + (at.y - frame.height / 2) * shift,
    scale,
  };
  return kept(moved, extent, frame);
}

/** Moved by so many pixels of the frame. */
export function panned(
  view: Viewport,
  dx: number,
  dy: number,
  extent: Extent,
  frame: Size,
): Viewport {
  return kept({ ...view, x: view.x - dx / view.scale, y: view.y - dy / view.scale }, extent, frame);
}

/** The nearest viewport that does not leave the picture. */
export function kept(view: Viewport, extent: Extent, frame: Size): Viewport {
  const along = (at: number, from: number, length: number, room: number) => {
    const half = Math.max(0, room / 2 - margin) / view.scale;
    // A side that fits is centred; one that does not fills the frame.
    if (length <= 2 * half) return from + length / 2;
    return Math.min(Math.max(at, from + half), from + length - half);
  };
  return {
    x: along(view.x, extent.x, extent.width, frame.width),
    y: along(view.y, extent.y, extent.height, frame.height),
    scale: view.scale,
  };
}
