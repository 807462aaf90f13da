import type { Size } from "../image-worker/contents.js";
import { byId, context2d } from "../dom.js";
import { clampView, fit, panned, zoomed, type Extent, type Viewport } from "./viewport.js";

/** A drawing in its own coordinates. */
export interface Scene {
  readonly extent: Extent;
  /** Scenes of the same space share coordinates and the viewport. */
  readonly space: "canvas" | "pair" | "graph";
  /** Draws the scene with the transform set; `pixel` is the size of a screen pixel. */
  draw(context: CanvasRenderingContext2D, pixel: number): void;
  /** The position of a divider that can be dragged, as a fraction of the frame's width. */
  readonly split?: { get(): number; set(share: number): void };
}

/** Shows a scene that can be panned and zoomed by pointer, wheel, touch and keyboard. */
export class Viewer {
  readonly #frame = byId("frame", HTMLElement);
  readonly #canvas = byId("picture", HTMLCanvasElement);
  readonly #level = byId("zoom-level", HTMLElement);
  readonly #views = new Map<Scene["space"], Viewport>();
  readonly #pointers = new Map<number, { x: number; y: number }>();
  #scene: Scene | null = null;
  #size: Size = { width: 1, height: 1 };
  #drawing = false;
  #dragsSplit = false;

  constructor() {
    new ResizeObserver(() => this.#resize()).observe(this.#frame);
    this.#resize();
    this.#bindPointers();
    this.#bindKeys();
    byId("zoom-in", HTMLElement).addEventListener("click", () => this.#zoom(1.5));
    byId("zoom-out", HTMLElement).addEventListener("click", () => this.#zoom(1 / 1.5));
    byId("zoom-fit", HTMLElement).addEventListener("click", () => this.reset());
  }

  show(scene: Scene | null): void {
    this.#scene = scene;
    this.redraw();
  }

  /** Fits the scene into the frame. */
  reset(): void {
    this.#views.clear();
    this.redraw();
  }

  redraw(): void {
    if (this.#drawing) return;
    this.#drawing = true;
    requestAnimationFrame(() => {
      this.#drawing = false;
      this.#draw();
    });
  }

  get #view(): Viewport {
    const scene = this.#scene;
    if (!scene) return { x: 0, y: 0, scale: 1 };
    const current = this.#views.get(scene.space);
    return current ? clampView(current, scene.extent, this.#size) : fit(scene.extent, this.#size);
  }

  #set(view: Viewport): void {
    if (!this.#scene) return;
    const whole = fit(this.#scene.extent, this.#size);
    // A fitted view stays fitted when the frame is resized.
    if (view.scale <= whole.scale * 1.001) this.#views.delete(this.#scene.space);
    else this.#views.set(this.#scene.space, view);
    this.redraw();
  }

  #zoom(factor: number, at = { x: this.#size.width / 2, y: this.#size.height / 2 }): void {
    if (this.#scene) this.#set(zoomed(this.#view, factor, at, this.#scene.extent, this.#size));
  }

  #pan(dx: number, dy: number): void {
    if (this.#scene) this.#set(panned(this.#view, dx, dy, this.#scene.extent, this.#size));
  }

  #resize(): void {
    this.#size = { width: this.#frame.clientWidth, height: this.#frame.clientHeight };
    const dense = window.devicePixelRatio;
    this.#canvas.width = Math.round(this.#size.width * dense);
    this.#canvas.height = Math.round(this.#size.height * dense);
    this.#draw();
  }

  #draw(): void {
    const context = context2d(this.#canvas);
    context.resetTransform();
    context.clearRect(0, 0, this.#canvas.width, this.#canvas.height);
    const scene = this.#scene;
    if (!scene) return;
    const view = this.#view;
    const dense = window.devicePixelRatio;
    const scale = view.scale * dense;
    context.setTransform(
      scale,
      0,
      0,
      scale,
      this.#canvas.width / 2 - view.x * scale,
      this.#canvas.height / 2 - view.y * scale,
    );
    // At high zoom, show individual pixels.
    context.imageSmoothingEnabled = view.scale < 3;
    context.imageSmoothingQuality = "high";
    scene.draw(context, 1 / view.scale);
    const zoomedIn = this.#views.has(scene.space);
    this.#frame.classList.toggle("zoomed", zoomedIn);
    this.#level.textContent = `${Math.round(100 * view.scale)}\u00a0%`;
  }

  #bindPointers(): void {
    const frame = this.#frame;
    const place = (event: MouseEvent) => {
      const box = frame.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    frame.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      const at = place(event);
      const split = this.#scene?.split;
      this.#dragsSplit =
        split !== undefined && Math.abs(split.get() * this.#size.width - at.x) < 28;
      this.#pointers.set(event.pointerId, at);
      frame.setPointerCapture(event.pointerId);
    });
    frame.addEventListener("pointermove", (event) => {
      const before = this.#pointers.get(event.pointerId);
      if (!before) return;
      const now = place(event);
      this.#pointers.set(event.pointerId, now);
      const other = [...this.#pointers].find(([id]) => id !== event.pointerId)?.[1];
      if (other) {
        const distance = (at: { x: number; y: number }) =>
          Math.hypot(at.x - other.x, at.y - other.y);
        this.#zoom(distance(now) / Math.max(1, distance(before)), other);
      } else if (this.#dragsSplit) {
        this.#scene?.split?.set(Math.min(1, Math.max(0, now.x / this.#size.width)));
      } else {
        this.#pan(now.x - before.x, now.y - before.y);
      }
    });
    const release = (event: PointerEvent) => void this.#pointers.delete(event.pointerId);
    frame.addEventListener("pointerup", release);
    frame.addEventListener("pointercancel", release);
    frame.addEventListener("dblclick", (event) => this.#zoom(2.5, place(event)));
    frame.addEventListener(
      "wheel",
      (event) => {
        // The wheel scrolls the page; with Ctrl, or by a pinch on a touchpad, it zooms.
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        this.#zoom(Math.exp(-event.deltaY / (event.deltaMode === 0 ? 200 : 8)), place(event));
      },
      { passive: false },
    );
  }

  #bindKeys(): void {
    const step = 60;
    const actions: Readonly<Record<string, () => void>> = {
      "+": () => this.#zoom(1.5),
      "=": () => this.#zoom(1.5),
      "-": () => this.#zoom(1 / 1.5),
      "0": () => this.reset(),
      ArrowLeft: () => this.#pan(step, 0),
      ArrowRight: () => this.#pan(-step, 0),
      ArrowUp: () => this.#pan(0, step),
      ArrowDown: () => this.#pan(0, -step),
    };
    this.#frame.addEventListener("keydown", (event) => {
      const action = actions[event.key];
      if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      action();
    });
  }
}
