// Reading files one after another.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { test } from "node:test";
import { inTurn } from "../../dist/cases/in-turn.js";
import { withDecoder } from "../../dist/cli/decoding.js";
import { rejection, sample } from "./sample.mjs";

const photo = await readFile(new URL("../../target/sample-small/target.jpg", import.meta.url));

test("files are read in turn, and said to be", async () => {
  /** @type {string[]} */
  const heard = [];
  const read = inTurn((path) => heard.push(`begin ${path}`));
  const load = async (/** @type {string} */ path) => {
    await new Promise((resolve) => setTimeout(resolve, path === "a" ? 20 : 0));
    heard.push(`end ${path}`);
    return path.toUpperCase();
  };
  const all = await Promise.all(["a", "b", "c"].map((path) => read(path, load)));
  assert.deepEqual(all, ["A", "B", "C"]);
  assert.deepEqual(heard, ["begin a", "end a", "begin b", "end b", "begin c", "end c"]);
});

test("no file is read after one that could not be", async () => {
  /** @type {string[]} */
  const heard = [];
  const read = inTurn((path) => heard.push(path));
  const mine = new Error("mine");
  const load = async (/** @type {string} */ path) => {
    if (path === "b") throw mine;
  };
  const reading = ["a", "b", "c"].map((path) => read(path, load));
  const outcomes = await Promise.allSettled(reading);
  assert.deepEqual(
    outcomes.map((outcome) => ("reason" in outcome ? outcome.reason : undefined)),
    [undefined, mine, mine],
  );
  assert.deepEqual(heard, ["a", "b"]);
});

test("a thread decodes what it is given, in turn, and says what it cannot", async () => {
  const { target } = await sample();
  const [first, error, second] = await withDecoder((by) =>
    Promise.all([by.photo(photo), rejection(by.depth(new Uint8Array(9))), by.photo(photo)]),
  );
  assert.deepEqual([first.image, second.image], [target, target]);
  assert.equal(error.code, "decode-failed");
});
