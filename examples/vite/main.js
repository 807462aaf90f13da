import { stitch } from "depthstitch";

const status = document.querySelector("#status");
const canvas = document.querySelector("#mosaic");

/** The pixels of an image file, with its EXIF orientation applied. */
async function load(url) {
  const bitmap = await createImageBitmap(await (await fetch(url)).blob());
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

try {
  const { mosaic, report } = await stitch(await load("left.jpg"), await load("right.jpg"), {
    onProgress: ({ stage, fraction }) =>
      (status.textContent = `${stage}: ${Math.round(100 * fraction)} %`),
  });
  const { data, width, height } = mosaic;
  Object.assign(canvas, { width, height });
  canvas.getContext("2d").putImageData(new ImageData(data, width, height), 0, 0);
  status.textContent = `Done: ${report.inliers} inliers.`;
} catch (error) {
  status.textContent = `Failed: ${error.message}`;
}
