// A CommonJS module.
import type { ImageInput, StitchResult } from "depthstitch" with { "resolution-mode": "import" };

export async function stitchTwo(target: ImageInput, reference: ImageInput): Promise<StitchResult> {
  const { stitch } = await import("depthstitch");
  return stitch(target, reference);
}
