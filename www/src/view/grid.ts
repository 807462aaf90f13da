import type { Model } from "depthstitch";
import { imageTask } from "../image-worker/client.js";
import type { Outcome } from "../state.js";
import { cached } from "./bitmaps.js";

/** Cells along the longer side of the photo, on a wide screen and on a narrow one. */
const cells = { wide: 40, narrow: 24 };

export interface Grid {
  readonly columns: number;
  readonly rows: number;
  /** x, y of each vertex in row-major order; NaN if undefined. */
  readonly at: Float64Array;
}

/** A regular grid over the target, warped by the forward model. */
export function gridOf(outcome: Outcome): Promise<Grid> {
  return cached(outcome.result, "grid", () => makeGrid(outcome));
}

export function drawGrid(context: CanvasRenderingContext2D, mesh: Grid, pixel: number): void {
  const path = new Path2D();
  const edge = (from: number, to: number) => {
    const [x0 = NaN, y0 = NaN] = mesh.at.subarray(2 * from, 2 * from + 2);
    const [x1 = NaN, y1 = NaN] = mesh.at.subarray(2 * to, 2 * to + 2);
    if (Number.isNaN(x0 + x1)) return;
    path.moveTo(x0, y0);
    path.lineTo(x1, y1);
  };
  for (let row = 0; row < mesh.rows; row++) {
    for (let column = 0; column < mesh.columns; column++) {
      const here = row * mesh.columns + column;
      if (column + 1 < mesh.columns) edge(here, here + 1);
      if (row + 1 < mesh.rows) edge(here, here + mesh.columns);
    }
  }
  context.lineWidth = 2.5 * pixel;
  context.strokeStyle = "rgb(0 0 0 / 0.35)";
  context.stroke(path);
  context.lineWidth = pixel;
  context.strokeStyle = "rgb(120 235 215 / 0.95)";
  context.stroke(path);
}

async function makeGrid({ job, result }: Outcome): Promise<Grid> {
  const { width, height } = job.target;
  const count = matchMedia("(max-width: 560px)").matches ? cells.narrow : cells.wide;
  const cell = Math.max(width, height) / count;
  const columns = Math.round(width / cell) + 1;
  const rows = Math.round(height / cell) + 1;
  const nodes = Float64Array.from({ length: 2 * columns * rows }, (_, i) => {
    const node = Math.floor(i / 2);
    const [column, row] = [node % columns, Math.floor(node / columns)];
    return i % 2 === 0 ? (column / (columns - 1)) * (width - 1) : (row / (rows - 1)) * (height - 1);
  });
  const { targetDepth } = result;
  const depth = targetDepth && (await imageTask("valuesAt", targetDepth, nodes));
  const at = new Float64Array(nodes.length);
  for (let node = 0; node < columns * rows; node++) {
    const [x = 0, y = 0] = nodes.subarray(2 * node, 2 * node + 2);
    const [u, v] = mapped(result.forward, x, y, depth?.[node] ?? 0);
    // Pixel centres are integers in the model and half-integers on the canvas.
    at.set([u + 0.5, v + 0.5], 2 * node);
  }
  return { columns, rows, at };
}

/** x' ~ h·(x, y, 1) + e·d; NaN behind the camera. */
function mapped({ h, e }: Model, x: number, y: number, d: number): readonly [number, number] {
  const along = (row: number) =>
    (h[3 * row] ?? 0) * x + (h[3 * row + 1] ?? 0) * y + (h[3 * row + 2] ?? 0) + (e[row] ?? 0) * d;
  const w = along(2);
  return w > 0 ? [along(0) / w, along(1) / w] : [Number.NaN, Number.NaN];
}
