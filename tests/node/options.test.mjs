// The table of options describes what the core does: its defaults in both modes, and the range of every option.
import assert from "node:assert/strict";
import { test } from "node:test";
import { defaultOptions, detect } from "depthstitch";
import { OPTION_LIST } from "depthstitch/options";
import { rejection } from "./sample.mjs";

const image = { data: new Uint8Array(4 * 32 * 32).fill(255), width: 32, height: 32 };

/** Whether the core accepts a value: options are checked before anything else. @param {object} options */
const accepts = (options) =>
  detect(image, { worker: false, .../** @type {any} */ (options) }).then(
    () => true,
    (error) => error.code !== "invalid-argument",
  );

test("defaults are those of the core, in both modes", async () => {
  const table = (/** @type {boolean} */ paper) =>
    Object.fromEntries(
      OPTION_LIST.map(([name, spec]) => [name, (paper ? spec.paper : undefined) ?? spec.default]),
    );
  assert.deepEqual(table(false), await defaultOptions());
  assert.deepEqual(table(true), await defaultOptions("paper"));
});

test("the core accepts the ends of every range and nothing beyond", async () => {
  for (const [name, spec] of OPTION_LIST) {
    // The limit of memory is exceeded by any image at its lower end.
    const check = async (/** @type {unknown} */ value, /** @type {boolean} */ expected) =>
      assert.equal(await accepts({ [name]: value }), expected, `${name}: ${String(value)}`);
    if (spec.type === "boolean") {
      for (const value of [true, false]) await check(value, true);
      for (const value of [0, "true"]) await check(value, false);
    } else if (spec.type === "choice") {
      for (const value of Object.keys(spec.choices)) await check(value, true);
      for (const value of ["", "constructor", 0]) await check(value, false);
    } else {
      const step = spec.type === "integer" ? 1 : 1e-9;
      await check(spec.min, !spec.exclusiveMin);
      await check(spec.min - step, false);
      const inside = spec.min + (spec.exclusiveMin ? step : 0);
      await check(inside, true);
      if (spec.max !== undefined) {
        await check(spec.max, !spec.exclusiveMax);
        await check(spec.max + Math.max(step, spec.max * 1e-9), false);
      } else {
        await check(Number.MAX_VALUE, true);
        await check(Infinity, false);
      }
      if (spec.type === "integer") await check(spec.min + 0.5, false);
      if (spec.keyword !== undefined) await check(spec.keyword, true);
      await check("many", false);
      await check(NaN, false);
    }
  }
});

test("the message of a wrong value quotes it", async () => {
  for (const [options, message] of /** @type {const} */ ([
    [{ seam: "zigzag" }, /seam must be 'aligned', 'cut' or 'none', got "zigzag"/],
    [{ seam: 3 }, /seam must be .*, got 3/],
    [{ maxTrials: "many" }, /maxTrials must be an integer from 1 to 1000000, got "many"/],
    [{ confidence: NaN }, /confidence must be .*, got NaN/],
    [{ mutual: "yes" }, /mutual must be true or false, got "yes"/],
  ])) {
    const error = await rejection(detect(image, /** @type {any} */ (options)));
    assert.match(error.message, message);
  }
});
