import type { DepthMap } from "./contents.js";

/** A depth map turned by 90° clockwise. */
export function turnDepth({ data, width, height }: DepthMap): DepthMap {
  const turned = data.slice();
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      turned[x * height + (height - 1 - y)] = data[y * width + x] ?? 0;
    }
  }
  return { data: turned, width: height, height: width };
}
