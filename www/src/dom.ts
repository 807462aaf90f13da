/** The element with this id. The page is known to contain it; its class is checked. */
export function byId<T extends HTMLElement>(id: string, kind: new () => T): T {
  return checked(document.getElementById(id), kind, `#${id}`);
}

/** The first match of `selector` below `parent`. */
export function find<T extends HTMLElement>(
  parent: ParentNode,
  selector: string,
  kind: new () => T,
): T {
  return checked(parent.querySelector(selector), kind, selector);
}

function checked<T extends HTMLElement>(
  element: Element | null,
  kind: new () => T,
  name: string,
): T {
  if (element instanceof kind) return element;
  throw new Error(`the page has no ${kind.name} ${name}`);
}

/** Creates an element with attributes and children. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Readonly<Record<string, string>> = {},
  ...children: readonly (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Enables or disables a button. A disabled button stays in the tab order and keeps the focus. */
export function setEnabled(button: HTMLButtonElement, enabled: boolean): void {
  button.setAttribute("aria-disabled", String(!enabled));
}

/** Calls `action` on clicks while the button is enabled. */
export function onClick(button: HTMLButtonElement, action: () => void): void {
  button.addEventListener("click", () => {
    if (button.getAttribute("aria-disabled") !== "true") action();
  });
}

/** Has a canvas show a picture, at its size. */
export function showOn(canvas: HTMLCanvasElement, picture: ImageBitmap): void {
  canvas.width = picture.width;
  canvas.height = picture.height;
  context2d(canvas).drawImage(picture, 0, 0);
}

export function context2d(
  canvas: HTMLCanvasElement,
  settings?: CanvasRenderingContext2DSettings,
): CanvasRenderingContext2D {
  const context = canvas.getContext("2d", settings);
  // Browsers return null for canvases above their size limit.
  if (!context) {
    throw new Error(`This browser cannot draw ${canvas.width} × ${canvas.height} pixels.`);
  }
  return context;
}
