// `crop` does not call the core, so it checks its arguments itself.
import assert from "node:assert/strict";
import { test } from "node:test";
import { crop, StitchError } from "depthstitch";

const image = {
  data: Uint8ClampedArray.from({ length: 4 * 5 * 3 }, (_, i) => i),
  width: 5,
  height: 3,
};

test("the pixels of the rectangle, as a copy", () => {
  const part = crop(image, { x: 1, y: 1, width: 2, height: 2 });
  const row = (/** @type {number} */ y) => [
    ...image.data.subarray(4 * (5 * y + 1), 4 * (5 * y + 3)),
  ];
  assert.deepEqual([...part.data], [...row(1), ...row(2)]);
  assert.deepEqual([part.width, part.height], [2, 2]);
  part.data.fill(0);
  assert.notEqual(image.data[4 * 6], 0);
  assert.deepEqual(crop(image, { x: 0, y: 0, width: 5, height: 3 }), image);
});

test("anything else is a typed error that names the number", () => {
  const rect = { x: 1, y: 1, width: 2, height: 2 };
  for (const [change, message, details] of /** @type {[object, RegExp, object][]} */ ([
    [{ x: 0.5 }, /rect\.x must be an integer of at least 0, got 0\.5/, { value: 0.5 }],
    [{ y: -1 }, /rect\.y/, { value: -1 }],
    [{ width: 0 }, /rect\.width must be an integer of at least 1, got 0/, { value: 0 }],
    [{ height: "2" }, /rect\.height .* got "2"/, {}],
    [{ height: NaN }, /rect\.height .* got NaN/, { value: NaN }],
    [{ x: undefined }, /rect\.x .* got undefined/, {}],
    [{ x: 4 }, /rect\.x \+ rect\.width must be at most 5, got 6/, { value: 6 }],
    [{ height: 3 }, /rect\.y \+ rect\.height must be at most 3, got 4/, { value: 4 }],
  ])) {
    const wrong = /** @type {any} */ ({ ...rect, ...change });
    assert.throws(
      () => crop(image, wrong),
      (error) => {
        assert.ok(error instanceof StitchError);
        assert.equal(error.code, "invalid-argument");
        assert.match(error.message, message);
        assert.deepEqual(error.details, details);
        return true;
      },
    );
  }
  const code = (/** @type {any} */ wrong, /** @type {any} */ part = rect) => {
    try {
      crop(wrong, part);
      return undefined;
    } catch (error) {
      return error instanceof StitchError && error.code;
    }
  };
  assert.equal(code({ ...image, data: image.data.subarray(4) }), "size-mismatch");
  assert.equal(code({ ...image, width: 5.5 }), "invalid-argument");
  assert.equal(code({ ...image, data: [1, 2] }), "invalid-argument");
  assert.equal(code(image, null), "invalid-argument");
});
