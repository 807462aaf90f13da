// What the browser tests do, on the page's thread or in a worker.
import { stitch } from "depthstitch";
import { estimateDepth, loadDepthModel, loadOnnxDepth } from "depthstitch/depth";
import { loadInpainter } from "depthstitch/inpaint";

/** @typedef {import("depthstitch").ImageInput} ImageInput */

/** A picture with one colour in its left half and one in its right. @param {number[]} left @param {number[]} right */
function halves(left, right) {
  const [width, height] = [320, 200];
  const data = new Uint8ClampedArray(4 * width * height);
  for (let i = 0; i < width * height; i++)
    data.set([...(i % width < 160 ? left : right), 255], 4 * i);
  return { data, width, height };
}

/** A photo from the server, scaled as the browser does. @param {string} url */
async function photo(url) {
  const bitmap = await createImageBitmap(await (await fetch(url)).blob());
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
  if (!context) throw new Error("no canvas");
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

/** What is left of an error between threads and processes. @param {any} error */
const asRejection = ({ name, code, stage, message }) => ({ error: { name, code, stage, message } });

export const calls = {
  /** @param {{ left: number[], right: number[], options: any }} args */
  async depth({ left, right, options }) {
    /** @type {string[]} */
    const stages = [];
    const onProgress = (/** @type {{ stage: string }} */ { stage }) => void stages.push(stage);
    const depth = await estimateDepth(halves(left, right), { ...options, onProgress });
    const { data, width, height } = depth;
    return { data: [...data], width, height, stages: [...new Set(stages)] };
  },

  /** @param {{ url: string, options: any }} args */
  async onnxDepth({ url, options }) {
    const estimator = await loadOnnxDepth(options);
    const { data, width, height } = await estimator.estimate(await photo(url));
    await estimator.dispose();
    return { data: [...data], width, height };
  },

  /** @param {{ url: string, options: any, hole: { x: number, y: number, size: number } }} args */
  async inpaint({ url, options, hole }) {
    const picture = await photo(url);
    const { width, height } = picture;
    const voids = new Uint8Array(width * height);
    for (let i = 0; i < voids.length; i++) {
      const [x, y] = [i % width, Math.floor(i / width)];
      const inside = x >= hole.x && x < hole.x + hole.size && y >= hole.y && y < hole.y + hole.size;
      voids[i] = inside ? 255 : 0;
    }
    const data = picture.data.map((value, i) => (voids[i >> 2] ? 0 : value));
    const inpainter = await loadInpainter(options);
    const filled = await inpainter.inpaint({ data, width, height }, { data: voids, width, height });
    await inpainter.dispose();
    let [changed, empty, error] = [0, 0, 0];
    voids.forEach((hole, i) => {
      const pixel = filled.data.subarray(4 * i, 4 * i + 4);
      const truth = picture.data.subarray(4 * i, 4 * i + 4);
      if (!hole && pixel.some((value, c) => value !== truth[c])) changed++;
      if (hole && pixel[3] !== 255) empty++;
      for (let c = 0; hole && c < 3; c++) error += ((pixel[c] ?? 0) - (truth[c] ?? 0)) ** 2;
    });
    const psnr = 10 * Math.log10((255 * 255 * 3 * hole.size ** 2) / error);
    return { changed, empty, psnr };
  },

  /** Aborts a download on its way. @param {{ options: any }} args */
  async abort({ options }) {
    const controller = new AbortController();
    setTimeout(() => controller.abort(), 200);
    await loadDepthModel({ ...options, signal: controller.signal });
  },

  /** The main entry alone, with nothing to go by. */
  async main() {
    await stitch(halves([1, 2, 3], [4, 5, 6]), halves([1, 2, 3], [4, 5, 6]));
  },
};

/** @param {keyof typeof calls} name @param {any} args */
export const run = (name, args) => calls[name](args).catch(asRejection);
