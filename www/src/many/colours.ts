/** A colour of its own for each photo, far from those of its neighbours in the list: RGB from 0 to 255. */
export function photoColour(index: number): readonly [number, number, number] {
  // Steps of the golden angle, and three lightnesses.
  const hue = (170 + 137.508 * index) % 360;
  const lightness = [0.5, 0.62, 0.4][index % 3] ?? 0.5;
  const channel = (shift: number) => {
    const k = (shift + hue / 30) % 12;
    const strength = 0.65 * Math.min(lightness, 1 - lightness);
    return Math.round(255 * (lightness - strength * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  };
  return [channel(0), channel(8), channel(4)];
}

/** The same for CSS and canvases. */
export function cssColour(index: number): string {
  return `rgb(${photoColour(index).join(" ")})`;
}
