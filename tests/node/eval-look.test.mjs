// What the evaluation measures besides the overlap: looks, stability, the hidden part, a perceptual distance; and the sheet.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { decodeImage } from "../../dist/codecs.js";
import { appearance, instability } from "../../dist/eval/appearance.js";
import { divide } from "../../dist/eval/hidden.js";
import { perceptualDistance } from "../../dist/eval/lpips.js";
import { LETTER, drawText, wrapped } from "../../dist/eval/lettering.js";
import { onnx } from "../models/onnx-writer.mjs";
import { HEIGHT, WIDTH, writeCase } from "./rendered-case.mjs";

const MAIN = fileURLToPath(new URL("../../dist/eval/main.js", import.meta.url));

/** @type {string} */
let folder;
/** @type {string} */
let data;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "depthstitch-look-"));
  data = join(folder, "made-good");
  await writeCase(data);
});
after(() => rm(folder, { recursive: true, force: true }));

/** The rows of an evaluation of the rendered case, and what it printed. @param {string[]} args */
async function rows(...args) {
  const json = join(folder, "rows.json");
  const { status, stdout, stderr } = spawnSync(
    process.execPath,
    [MAIN, "--data", data, "--json", json, ...args],
    { encoding: "utf8" },
  );
  assert.equal(status, 0, stderr);
  /** @type {import("../../dist/eval/evaluate.js").Row[]} */
  const found = JSON.parse(await readFile(json, "utf8"));
  return { rows: found, stdout };
}

test("--look and --stability: a homography has no voids and bends nothing", async () => {
  const { rows: found, stdout } = await rows("--look", "--stability", "--mode", "baseline,default");
  const [flat, deep] = found;
  assert.ok(flat && deep);
  assert.deepEqual([flat.border_voids, flat.overlap_voids], [0, 0]);
  assert.ok((flat.bending ?? NaN) < 1e-3, String(flat.bending));
  for (const row of [flat, deep]) {
    assert.ok((row.seam_length ?? 0) > 0.3, String(row.seam_length));
    assert.ok((row.instability ?? NaN) < 0.01, String(row.instability));
    assert.equal(row.hidden_psnr, null);
    assert.ok((row.psnr_mask ?? 0) > 10);
  }
  // By default voids of the overlap lower the confidence and are not cut out.
  assert.ok((deep.overlap_voids ?? NaN) < 0.005, String(deep.overlap_voids));
  assert.match(stdout, /^case .* void_bord .* bending .* unstable .* ms$/m);
  assert.doesNotMatch(stdout, /psnr_bbox/);
});

test("--hidden: true depth shows what was hidden, a homography displaces it", async () => {
  const { rows: found, stdout } = await rows("--hidden", "--mode", "default,baseline");
  const [deep, flat] = found;
  assert.ok(deep && flat);
  assert.ok((deep.hidden_psnr ?? 0) > (flat.hidden_psnr ?? NaN) + 3, JSON.stringify(found));
  assert.ok((deep.hidden_ssim ?? 0) > (flat.hidden_ssim ?? NaN) + 0.1, JSON.stringify(found));
  assert.ok((deep.hidden_shown ?? 0) > 0.8, JSON.stringify(found));
  assert.ok((deep.hidden_shift?.[0] ?? NaN) < 0.5, JSON.stringify(found));
  assert.ok((flat.hidden_shift?.[1] ?? NaN) > 2, JSON.stringify(found));
  // Nothing else was asked for.
  assert.equal(deep.psnr_mask, null);
  assert.match(stdout, /^case .* hid_psnr .* hid med .* ms$/m);
});

test("--hidden: a stitch that fails shows nothing of the hidden part", async () => {
  const { rows: found } = await rows("--hidden", "--mode", "default", "--set", "maxTrials=-1");
  assert.deepEqual([found[0]?.hidden_shown, found[0]?.hidden_psnr], [0, null]);
  assert.deepEqual(found[0]?.warnings, ["hidden:invalid-argument"]);
});

test("the outer part of the overlap is hidden, on the side where the mosaic reaches out", () => {
  const reference = { width: 100, height: 50 };
  /** @param {{ x: number, y: number }} offset @param {[number, number]} size @param {(x: number, y: number) => boolean} shown in the reference's frame */
  const warped = (offset, [width, height], shown) => {
    const pixels = Array.from({ length: width * height }, (_, i) => {
      const alpha = shown((i % width) - offset.x, Math.floor(i / width) - offset.y) ? 255 : 0;
      return [9, 9, 9, alpha];
    });
    return { warped: { data: Uint8ClampedArray.from(pixels.flat()), width, height }, offset };
  };
  // 60 columns of overlap on the left: nine tenths are 54, of which 40 % are 22.
  const left = divide(
    reference,
    warped({ x: 40, y: 0 }, [140, 50], (x) => x < 60),
  );
  assert.deepEqual(left, {
    hidden: { x: 0, y: 0, width: 22, height: 50 },
    left: { x: 22, y: 0, width: 78, height: 50 },
    covered: 1,
  });
  // The right half of it is void there.
  const right = divide(
    reference,
    warped({ x: 0, y: 0 }, [140, 50], (x, y) => x >= 40 && y < 25),
  );
  assert.deepEqual(right, {
    hidden: { x: 78, y: 0, width: 22, height: 50 },
    left: { x: 0, y: 0, width: 78, height: 50 },
    covered: 0.5,
  });
  // Below, where 20 rows would be needed.
  const narrow = warped({ x: 0, y: 0 }, [100, 90], (_, y) => y >= 5);
  assert.equal(divide(reference, narrow), undefined);
  const tall = { width: 100, height: 60 };
  assert.deepEqual(
    divide(
      tall,
      warped({ x: 0, y: 0 }, [100, 99], () => true),
    )?.hidden,
    {
      x: 0,
      y: 38,
      width: 100,
      height: 22,
    },
  );
});

test("instability: 1 less intersection over union outside the reference", () => {
  /** @param {number} width @param {{ x: number, y: number }} offset @param {(x: number) => boolean} shown */
  const placed = (width, offset, shown) => {
    const pixels = Array.from({ length: width * 10 }, (_, i) => [
      0,
      0,
      0,
      shown(i % width) ? 255 : 0,
    ]);
    return { mosaic: { data: Uint8ClampedArray.from(pixels.flat()), width, height: 10 }, offset };
  };
  const size = { width: 20, height: 10 };
  const far = placed(50, { x: 30, y: 0 }, () => true);
  const near = placed(35, { x: 15, y: 0 }, () => true);
  assert.equal(instability(far, far, size), 0);
  assert.equal(instability(far, near, size), 0.5);
  assert.equal(instability(near, far, size), 0.5);
  // What differs over the reference does not count; nothing outside is as stable as can be.
  assert.equal(
    instability(
      near,
      placed(35, { x: 15, y: 0 }, (x) => x < 15),
      size,
    ),
    0,
  );
  const none = placed(20, { x: 0, y: 0 }, () => true);
  assert.equal(instability(none, none, size), 0);
});

/** A stitch result of a target of one colour that covers the reference whole, moved by its model. @param {[number, number, number]} e */
function plain(e) {
  const [width, height] = [60, 40];
  const image = { data: new Uint8ClampedArray(4 * width * height).fill(255), width, height };
  const mask = (/** @type {number} */ value) => ({
    data: new Uint8Array(width * height).fill(value),
    width,
    height,
  });
  const model = { h: Float64Array.of(1, 0, 0, 0, 1, 0, 0, 0, 1), e: Float64Array.from(e) };
  return {
    image,
    result: /** @type {any} */ ({
      warped: image,
      footprint: mask(255),
      offset: { x: 0, y: 0 },
      clipped: false,
      mosaic: image,
      voidMask: mask(0),
      seam: mask(2),
      forward: model,
    }),
  };
}

test("appearance: null where there is too little to judge; what does not fit is refused", async () => {
  const { image, result } = plain([0, 0, 0]);
  assert.deepEqual(await appearance(image, image, result), {
    border_voids: 0,
    overlap_voids: 0,
    seam_on_border: null,
    seam_length: 0,
    visible_steps: null,
    steps_elsewhere: null,
    broken_inside: null,
    broken_across: null,
    broken_outside: null,
    bending: null,
  });
  const small = { data: new Uint8Array(4), width: 2, height: 2 };
  await assert.rejects(appearance(image, image, { ...result, seam: small }), {
    code: "size-mismatch",
  });
  await assert.rejects(appearance(image, image, plain([1, 0, 0]).result), {
    code: "invalid-argument",
    message: /targetDepth/,
  });
});

/** The mean squared difference of two pictures: what LPIPS would be without a network in between. */
const network = onnx({
  inputs: {
    a: { type: "float32", dims: [1, 3, "height", "width"] },
    b: { type: "float32", dims: [1, 3, "height", "width"] },
  },
  outputs: { distance: { type: "float32", dims: [1, 1, 1, 1] } },
  constants: {},
  nodes: [
    { op: "Sub", inputs: ["a", "b"], outputs: ["difference"] },
    { op: "Mul", inputs: ["difference", "difference"], outputs: ["square"] },
    {
      op: "ReduceMean",
      inputs: ["square"],
      outputs: ["distance"],
      attributes: { axes: [1, 2, 3], keepdims: 1 },
    },
  ],
});

test("--lpips: the network sees the overlap's box, red, green and blue from -1 to 1", async () => {
  const file = join(folder, "network.onnx");
  await writeFile(file, network);
  const { rows: found, stdout } = await rows("--lpips", file, "--mode", "paper,backward");
  for (const row of found) {
    // The published PSNR is of the same box, with 0 to 255 for -1 to 1.
    const expected = 4 * 10 ** (-(row.psnr_bbox ?? NaN) / 10);
    const error = Math.abs((row.lpips ?? NaN) - expected);
    assert.ok(error < 1e-4 + 1e-3 * expected, `${row.lpips} instead of ${expected}`);
  }
  assert.ok((found[0]?.lpips ?? NaN) < (found[1]?.lpips ?? NaN));
  assert.match(stdout, /^case +lpips +ms$/m);
});

test("lpips: order of channels and rows; nothing without an overlap", async () => {
  // Takes out one value: green of the second row's first pixel.
  const pick = onnx({
    inputs: {
      a: { type: "float32", dims: [1, 3, "height", "width"] },
      b: { type: "float32", dims: [1, 3, "height", "width"] },
    },
    outputs: { distance: { type: "float32", dims: [1, 1, 1, 1] } },
    constants: {
      starts: { dims: [3], data: BigInt64Array.of(1n, 1n, 0n) },
      ends: { dims: [3], data: BigInt64Array.of(2n, 2n, 1n) },
      axes: { dims: [3], data: BigInt64Array.of(1n, 2n, 3n) },
    },
    nodes: [
      { op: "Sub", inputs: ["a", "b"], outputs: ["difference"] },
      { op: "Slice", inputs: ["difference", "starts", "ends", "axes"], outputs: ["distance"] },
    ],
  });
  const distance = await perceptualDistance(pick);
  const reference = { data: new Uint8ClampedArray(4 * 6).fill(0), width: 3, height: 2 };
  const warped = { data: new Uint8ClampedArray(4 * 12), width: 4, height: 3 };
  const offset = { x: 1, y: 1 };
  assert.equal(await distance.measure({ warped, offset }, reference), null);
  // Two columns of overlap, the reference's last ones; in the box's second row and first column green is 255.
  for (const [x, y] of [
    [2, 1],
    [3, 1],
    [2, 2],
    [3, 2],
  ]) {
    warped.data[4 * ((y ?? 0) * 4 + (x ?? 0)) + 3] = 255;
  }
  warped.data[4 * (2 * 4 + 2) + 1] = 255;
  assert.equal(await distance.measure({ warped, offset }, reference), 2);
  await distance.dispose();
});

test("--sheet: target, reference, homography and ours side by side, with names and figures", async () => {
  const file = join(folder, "sheet.png");
  const { rows: found } = await rows("--look", "--sheet", file);
  assert.deepEqual(
    found.map(({ mode }) => mode),
    ["baseline", "default"],
  );
  const sheet = await decodeImage(await readFile(file));
  const target = await decodeImage(await readFile(join(data, "target.png")));
  const reference = await decodeImage(await readFile(join(data, "reference.png")));
  assert.equal(sheet.width, 4 * 650 + 10);
  const pixel = (
    /** @type {import("depthstitch").ImageOutput} */ { data, width },
    x = 0,
    y = 0,
  ) => [...data.subarray(4 * (y * width + x), 4 * (y * width + x) + 3)];
  for (const [x, y] of [
    [0, 0],
    [WIDTH - 1, HEIGHT - 1],
    [77, 101],
  ]) {
    const [u, v] = [(x ?? 0) + 10, (y ?? 0) + 10];
    assert.deepEqual(pixel(sheet, u, v), pixel(target, x, y));
    assert.deepEqual(pixel(sheet, u + 650, v), pixel(reference, x, y));
  }
  // The name is written below the target: as many black dots as its letters have.
  const drawn = new Set();
  drawText("made-good", 10, 10 + HEIGHT + 5, (x, y) => drawn.add(`${x},${y}`));
  let dots = 0;
  for (let y = 10 + HEIGHT + 5; y < 10 + HEIGHT + 5 + LETTER.height; y++) {
    for (let x = 10; x < 10 + 9 * LETTER.width; x++) {
      if (pixel(sheet, x, y)[0] === 0) {
        assert.ok(drawn.has(`${x},${y}`), `${x}, ${y}`);
        dots++;
      }
    }
  }
  assert.equal(dots, drawn.size);
});

test("labels: words on as many lines as they need", () => {
  assert.deepEqual(wrapped(["one", "two", "three", "four"], 8), ["one  two", "three", "four"]);
  assert.deepEqual(wrapped(["longer than a line"], 4), ["longer than a line"]);
  assert.deepEqual(wrapped([], 4), []);
});
