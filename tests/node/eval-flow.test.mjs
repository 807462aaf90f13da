// The dense optical flow of the evaluation, and the comparison that rests on it, on pictures moved by known amounts.
import assert from "node:assert/strict";
import { test } from "node:test";
import { compare } from "../../dist/eval/comparison.js";
import { denseFlow } from "../../dist/eval/flow/index.js";
import { median, percentile } from "../../dist/eval/statistics.js";

const WIDTH = 240;
const HEIGHT = 180;

/** Gray levels with detail of every size. @param {number} x @param {number} y */
function texture(x, y) {
  let value = 128;
  for (const [period, height, turn] of [
    [90, 40, 0.3],
    [37, 30, 1.9],
    [19, 25, 4.1],
    [11, 15, 2.6],
    [7, 10, 5.2],
  ]) {
    const [c, s] = [Math.cos(turn ?? 0), Math.sin(turn ?? 0)];
    const wave = (/** @type {number} */ t) => Math.sin((2 * Math.PI * t) / (period ?? 1));
    value += (height ?? 0) * wave(x * c + y * s + 5 * wave(y / 3)) * wave(y * c - x * s);
  }
  return value;
}

/** The texture as seen where `place` leads. @param {(x: number, y: number) => [number, number]} place */
function plane(place) {
  const data = new Float32Array(WIDTH * HEIGHT).map((_, i) =>
    texture(...place(i % WIDTH, Math.floor(i / WIDTH))),
  );
  return { data, width: WIDTH, height: HEIGHT };
}

/**
 * Errors of the flow from the texture to the texture moved by `motion`, at the places that stay inside.
 *
 * @param {(x: number, y: number) => [u: number, v: number]} motion of the place in the first picture
 * @param {(x: number, y: number) => [x: number, y: number]} back from the second picture to the first
 */
function errors(motion, back) {
  const flow = denseFlow(
    plane((x, y) => [x, y]),
    plane(back),
  );
  const found = [];
  for (let y = 0; y < HEIGHT; y++) {
    for (let x = 0; x < WIDTH; x++) {
      const [u, v] = motion(x, y);
      if (x + u < 0 || y + v < 0 || x + u > WIDTH - 1 || y + v > HEIGHT - 1) continue;
      const i = y * WIDTH + x;
      found.push(Math.hypot((flow.u.data[i] ?? NaN) - u, (flow.v.data[i] ?? NaN) - v));
    }
  }
  return found;
}

for (const [u, v] of /** @type {[number, number][]} */ ([
  [0, 0],
  [1.3, -0.7],
  [-6.4, 3.2],
  [17.5, -9.25],
])) {
  test(`flow of a shift by ${u}, ${v}`, () => {
    const off = errors(
      () => [u, v],
      (x, y) => [x - u, y - v],
    );
    assert.ok(median(off) < 0.1, `median ${median(off)}`);
    assert.ok(percentile(off, 90) < 0.5, `p90 ${percentile(off, 90)}`);
  });
}

test("flow of a turn and a change of size", () => {
  const [scale, angle] = [1.04, 0.05];
  const [c, s] = [scale * Math.cos(angle), scale * Math.sin(angle)];
  const [mx, my] = [WIDTH / 2, HEIGHT / 2];
  const off = errors(
    (x, y) => [c * (x - mx) - s * (y - my) + mx - x, s * (x - mx) + c * (y - my) + my - y],
    (x, y) => {
      const [dx, dy] = [x - mx, y - my];
      const square = scale * scale;
      return [(c * dx + s * dy) / square + mx, (c * dy - s * dx) / square + my];
    },
  );
  assert.ok(median(off) < 0.15, `median ${median(off)}`);
  assert.ok(percentile(off, 90) < 0.6, `p90 ${percentile(off, 90)}`);
});

test("flow of pictures smaller than a patch", () => {
  const data = new Float32Array(12).fill(5);
  const flow = denseFlow({ data, width: 4, height: 3 }, { data, width: 4, height: 3 });
  assert.deepEqual([...flow.u.data, ...flow.v.data], new Array(24).fill(0));
});

/** @param {(x: number, y: number) => number[]} colour */
function picture(colour) {
  const data = new Uint8ClampedArray(4 * WIDTH * HEIGHT);
  for (let i = 0; i < WIDTH * HEIGHT; i++) {
    data.set(colour(i % WIDTH, Math.floor(i / WIDTH)), 4 * i);
  }
  return { data, width: WIDTH, height: HEIGHT };
}

const truth = picture((x, y) => {
  const value = texture(x, y);
  return [value, 0.8 * value, 255 - value, 255];
});

test("comparison: the same picture, another exposure, a part of it", () => {
  const same = compare(truth, truth);
  assert.ok(same);
  assert.ok(same.psnr > 100 && same.ssim > 0.9999 && same.share === 1, JSON.stringify(same));
  assert.ok(same.shift[1] < 1e-6);

  // Exposure is taken out channel by channel; what is not valid plays no part.
  const darker = picture((x, y) => {
    const value = texture(x, y);
    if (x < WIDTH / 4) return [0, 0, 0, 0];
    return [0.7 * value, 0.6 * value, 0.9 * (255 - value), 255];
  });
  const found = compare(darker, truth);
  assert.ok(found);
  assert.equal(found.share, 0.75);
  assert.ok(found.psnr > 45 && found.ssim > 0.99, JSON.stringify(found));
  assert.ok(found.shift[0] < 0.05, JSON.stringify(found));
  assert.equal(
    compare(
      picture(() => [0, 0, 0, 0]),
      truth,
    ),
    undefined,
  );
});

test("comparison: what is displaced, and how good a known error is", () => {
  const moved = picture((x, y) => {
    const value = texture(x + 5, y - 2);
    return [value, 0.8 * value, 255 - value, 255];
  });
  const found = compare(moved, truth);
  assert.ok(found);
  assert.ok(Math.abs(found.shift[0] - Math.hypot(5, 2)) < 0.2, JSON.stringify(found));
  assert.ok(found.psnr < 25 && found.ssim < 0.9, JSON.stringify(found));

  // ±4 on every channel of a flat picture: an error of 16, 20·log10(255/4) dB.
  const flat = picture(() => [100, 100, 100, 255]);
  const dotted = picture((x, y) => new Array(3).fill(100 + ((x + y) % 2 ? 4 : -4)).concat(255));
  const psnr = compare(dotted, flat)?.psnr ?? NaN;
  assert.ok(Math.abs(psnr - 20 * Math.log10(255 / 4)) < 1e-6, String(psnr));
});
