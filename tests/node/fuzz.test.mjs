// Arguments of every kind, by chance: see js/tools/fuzz.mjs.
import assert from "node:assert/strict";
import { test } from "node:test";
import { fuzz } from "../../js/tools/fuzz.mjs";

test("whatever the arguments are, an error is a StitchError that says what is wrong", async () => {
  const { results, codes, untyped } = await fuzz(4000, 7);
  assert.deepEqual([...untyped], []);
  assert.ok(results > 200, `${results} results`);
  for (const code of ["invalid-argument", "size-mismatch", "decode-failed", "too-few-matches"]) {
    assert.ok((codes.get(code) ?? 0) > 5, code);
  }
});
