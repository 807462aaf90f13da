// `npm run fuzz -- --cases N --seed S`: calls the built package with arguments of every kind, and counts what it throws. Every
// error has to be a StitchError with a code that its types name.
import { parseArgs } from "node:util";
import { isMain } from "./shared.mjs";

/** Errors that a caller can expect; "internal" stands for a bug. */
const expected = new Set(
  [
    "invalid-argument size-mismatch too-few-matches no-consensus degenerate-geometry no-overlap",
    "too-large out-of-memory decode-failed aborted",
  ]
    .join(" ")
    .split(" "),
);

/** What an argument that throws when it is read throws. */
class OwnError extends Error {}

/** Deterministic numbers from 0 to 1 (mulberry32). @param {number} seed */
function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = state;
    t = Math.imul(t ^ (t >>> 15), t | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** @typedef {ReturnType<typeof generator>} Generator */

/** Values by chance. @param {() => number} next */
function generator(next) {
  /** @template T @param {readonly T[]} list @returns {T} */
  const pick = (list) => /** @type {T} */ (list[below(list.length)]);
  const below = (/** @type {number} */ limit) => Math.floor(next() * limit);
  const chance = (/** @type {number} */ share) => next() < share;

  const numbers = [0, -1, 1, 0.5, 2, 3, 16, 24, 1e9, 2 ** 31, 2 ** 53, NaN, Infinity, -Infinity];
  const arrays = [
    (/** @type {ArrayBuffer} */ buffer) => new Uint8Array(buffer),
    (/** @type {ArrayBuffer} */ buffer) => new Uint8ClampedArray(buffer),
    (/** @type {ArrayBuffer} */ buffer) => new Uint16Array(buffer),
    (/** @type {ArrayBuffer} */ buffer) => new Float32Array(buffer),
    (/** @type {ArrayBuffer} */ buffer) => new Float64Array(buffer),
    (/** @type {ArrayBuffer} */ buffer) => new Int8Array(buffer),
    (/** @type {ArrayBuffer} */ buffer) => new DataView(buffer),
  ];
  const detached = () => {
    const array = new Uint8ClampedArray(24 * 16 * 4);
    structuredClone(array, { transfer: [array.buffer] });
    return array;
  };
  const revoked = () => {
    const { proxy, revoke } = Proxy.revocable({}, {});
    revoke();
    return proxy;
  };
  const throwing = () =>
    new Proxy(
      {},
      {
        get() {
          throw new OwnError();
        },
      },
    );
  /** Anything at all. @returns {any} */
  const anything = () =>
    pick([
      () => undefined,
      () => null,
      () => pick(numbers),
      () => pick(["", "none", "x".repeat(1000), "\u0000", "constructor", "__proto__"]),
      () => chance(0.5),
      () => 10n,
      () => Symbol("s"),
      () => () => 1,
      () => [],
      () => [anything(), anything()],
      () => ({}),
      () => Object.create(null),
      () => Object.assign(Object.create(null), image()),
      () => new Date(NaN),
      () => new Map([["width", 1]]),
      () => new ArrayBuffer(8),
      () => new SharedArrayBuffer(8),
      () => pick(arrays)(new ArrayBuffer(pick([0, 8, 24, 1536]))),
      detached,
      revoked,
      throwing,
      () => new Proxy(image(), {}),
      () => ({ data: detached(), width: 24, height: 16 }),
      () => ({
        get width() {
          throw new OwnError();
        },
      }),
      () => ({
        toString() {
          throw new OwnError();
        },
      }),
      () => AbortSignal.abort(),
    ])();

  /** `value`, or once in a while something else. @param {unknown} value @returns {any} */
  const maybe = (value, share = 0.08) => (chance(share) ? anything() : value);

  const texture = () => Uint8ClampedArray.from({ length: 24 * 16 * 4 }, () => 256 * next());
  const image = () => ({ data: maybe(texture()), width: maybe(24), height: maybe(16) });
  const mask = () => ({
    data: maybe(new Uint8Array(24 * 16)),
    width: maybe(24),
    height: maybe(16),
  });
  const depth = () => ({
    data: maybe(Float32Array.from({ length: 24 * 16 }, next)),
    width: maybe(24),
    height: maybe(16),
    kind: maybe(pick(["inverse", "metric"])),
    invalid: maybe(pick([undefined, null, 0])),
  });
  const matches = () =>
    Float32Array.from({ length: pick([0, 3, 4, 40, 160]) }, () =>
      chance(0.01) ? pick(numbers) : 24 * next(),
    );
  const model = () => ({
    h: maybe(Float64Array.of(1, 0, 3 * next(), 0, 1, 0, 0, 0, 1)),
    e: maybe(Float64Array.of(chance(0.1) ? pick(numbers) : next(), 0, 0)),
  });
  const models = () => ({ forward: maybe(model()), reverse: maybe(model()) });
  const warped = () => ({
    warped: maybe(image()),
    footprint: maybe(mask()),
    confidence: maybe(chance(0.5) ? mask() : undefined),
    offset: maybe({ x: maybe(0), y: maybe(0) }),
    clipped: maybe(false),
  });
  const size = () => ({ width: maybe(24), height: maybe(16) });
  return {
    pick,
    below,
    chance,
    anything,
    maybe,
    image,
    mask,
    depth,
    matches,
    models,
    warped,
    size,
  };
}

/**
 * The calls, each with arguments by chance.
 *
 * @param {Generator} g
 * @param {typeof import("depthstitch")} api
 * @param {typeof import("depthstitch/codecs")} codecs
 * @param {string[]} names of options
 * @param {Uint8Array[]} files
 */
function calls(g, api, codecs, names, files) {
  const { maybe, image, mask, anything } = g;
  const options = (/** @type {object} */ more = {}) => {
    /** @type {Record<string, unknown>} */
    const all = { worker: maybe(false, 0.02), transfer: maybe(g.chance(0.1)), ...more };
    for (let i = g.pick([0, 0, 1, 2]); i > 0; i--) all[g.pick(names)] = anything();
    if (g.chance(0.05)) all.onProgress = anything();
    if (g.chance(0.05)) all.signal = anything();
    return maybe(all, 0.03);
  };
  const depths = () => ({
    ...(g.chance(0.3) && { targetDepth: maybe(g.depth()) }),
    ...(g.chance(0.3) && { referenceDepth: maybe(g.depth()) }),
  });
  const inputs = () => ({ ...(g.chance(0.7) && { matches: maybe(g.matches()) }), ...depths() });
  const features = () =>
    maybe({
      keypoints: maybe(new Float32Array(g.pick([0, 4, 5, 40]))),
      descriptors: maybe(new Uint8Array(g.pick([0, 128, 1280]))),
      ...g.size(),
    });
  // Files with a few wrong bytes, or an end that is missing.
  const bytes = () => {
    const file = g.pick(files).slice(0, g.chance(0.2) ? g.pick([0, 1, 8, 60, 300]) : undefined);
    for (let i = g.pick([0, 1, 1, 4, 30]); i > 0; i--) file[g.below(file.length)] = g.below(256);
    return maybe(file);
  };
  /** @type {Record<string, () => unknown>} */
  return {
    stitch: () => api.stitch(maybe(image()), maybe(image()), options(inputs())),
    align: () => api.align(maybe(image()), maybe(image()), options(inputs())),
    stitchMany: () =>
      api.stitchMany(
        maybe([maybe(image()), maybe(image()), image()]),
        options({ reference: anything() }),
      ),
    detect: () => api.detect(maybe(image()), options()),
    match: () => api.match(features(), features(), options()),
    matchImages: () => api.matchImages(maybe(image()), maybe(image()), options()),
    estimate: () =>
      api.estimate(
        maybe({
          targetSize: maybe(g.size()),
          referenceSize: g.size(),
          matches: g.matches(),
          ...depths(),
        }),
        options(),
      ),
    warp: () => api.warp(maybe(image()), maybe(image()), maybe(g.models()), options(depths())),
    blend: () => api.blend(maybe(g.warped()), maybe(image()), options({ reliable: maybe(mask()) })),
    fill: () => api.fill(maybe(image()), maybe(mask()), options()),
    measure: () => api.measure(maybe(g.warped()), maybe(image()), options({ gains: anything() })),
    crop: () => api.crop(maybe(image()), maybe({ x: maybe(0), y: maybe(0), ...g.size() })),
    defaultOptions: () => api.defaultOptions(anything()),
    decodeImage: () => codecs.decodeImage(bytes(), g.chance(0.3) ? anything() : undefined),
    decodeDepth: () => codecs.decodeDepth(bytes(), g.chance(0.3) ? anything() : undefined),
    readMetadata: () => codecs.readMetadata(bytes(), g.chance(0.3) ? anything() : undefined),
    convertColours: () => codecs.convertColours(maybe(image()), maybe(bytes()), maybe(bytes())),
    encodePng: () => codecs.encodePng(maybe(image()), g.chance(0.3) ? anything() : undefined),
    encodeGrayPng: () => codecs.encodeGrayPng(maybe(mask())),
    encodeJpeg: () => codecs.encodeJpeg(maybe(image()), g.chance(0.3) ? anything() : undefined),
  };
}

/**
 * Makes `cases` calls.
 *
 * @param {number} cases
 * @param {number} seed
 * @returns {Promise<{ results: number, codes: Map<string, number>, untyped: Map<string, number> }>} how many calls gave a result,
 *   how many each code, and what else was thrown
 */
export async function fuzz(cases, seed) {
  const api = await import("depthstitch");
  const codecs = await import("depthstitch/codecs");
  const names = Object.keys(await api.defaultOptions());
  const g = generator(random(seed));
  const photo = { data: new Uint8ClampedArray(48 * 32 * 4).fill(90), width: 48, height: 32 };
  const files = [await codecs.encodePng(photo), await codecs.encodeJpeg(photo)];
  const all = Object.entries(calls(g, api, codecs, names, files));
  const codes = new Map();
  const untyped = new Map();
  let results = 0;
  const add = (/** @type {Map<string, number>} */ map, /** @type {string} */ key) =>
    map.set(key, (map.get(key) ?? 0) + 1);
  for (let i = 0; i < cases; i++) {
    const [name, make] = g.pick(all);
    try {
      await make();
      results += 1;
    } catch (error) {
      if (error instanceof api.StitchError && expected.has(error.code)) add(codes, error.code);
      else add(untyped, `${name}: ${where(error)}`);
    }
  }
  return { results, codes, untyped };
}

/** What was thrown, and by which lines. @param {unknown} error */
function where(error) {
  return error instanceof Error ? error.stack?.split("\n").slice(0, 3).join(" ") : typeof error;
}

if (isMain(import.meta.url)) {
  const { values } = parseArgs({
    options: {
      cases: { type: "string", default: "2000" },
      seed: { type: "string", default: "1" },
    },
  });
  const { results, codes, untyped } = await fuzz(Number(values.cases), Number(values.seed));
  console.log(`${values.cases} calls with seed ${values.seed}: ${results} results`);
  for (const [code, count] of [...codes].sort((a, b) => b[1] - a[1]))
    console.log(`  ${code}: ${count}`);
  for (const [message, count] of untyped) console.log(`  NOT TYPED, ${count}: ${message}`);
  process.exit(untyped.size > 0 ? 1 : 0);
}
