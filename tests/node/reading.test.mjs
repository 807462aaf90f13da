// Reading files one after another, until a signal.
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
  const read = inTurn({ onFile: (path) => heard.push(`begin ${path}`) });
  const load = async (/** @type {string} */ path) => {
    await new Promise((resolve) => setTimeout(resolve, path === "a" ? 20 : 0));
    heard.push(`end ${path}`);
    return path.toUpperCase();
  };
  const all = await Promise.all(["a", "b", "c"].map((path) => read(path, load)));
  assert.deepEqual(all, ["A", "B", "C"]);
  assert.deepEqual(heard, ["begin a", "end a", "begin b", "end b", "begin c", "end c"]);
});

test("a signal during the first file keeps the second from being read", async (t) => {
  if (process.platform === "win32") {
    t.skip("processes do not send each other signals here");
    return;
  }
  const controller = new AbortController();
  process.once("SIGUSR2", () => controller.abort());
  /** @type {string[]} */
  const begun = [];
  const read = inTurn({ signal: controller.signal, onFile: (path) => begun.push(path) });
  const load = async () => {
    // A decoder does not let go of the thread.
    process.kill(process.pid, "SIGUSR2");
    for (const end = Date.now() + 50; Date.now() < end;);
  };
  const [first, second] = await Promise.allSettled(["a", "b"].map((path) => read(path, load)));
  assert.equal(first?.status, "fulfilled");
  assert.equal(second?.status, "rejected");
  assert.deepEqual(begun, ["a"]);
});

test("a thread decodes what it is given, in turn, and says what it cannot", async () => {
  const { target } = await sample();
  const { signal } = new AbortController();
  const [first, error, second] = await withDecoder(signal, (by) =>
    Promise.all([by.photo(photo), rejection(by.depth(new Uint8Array(9))), by.photo(photo)]),
  );
  assert.deepEqual([first.image, second.image], [target, target]);
  assert.equal(error.code, "decode-failed");
});

test("a signal does not wait for the decoder", async () => {
  const controller = new AbortController();
  const reason = new Error("changed my mind");
  const decoding = withDecoder(controller.signal, (by) => {
    const decoded = by.photo(photo);
    controller.abort(reason);
    return decoded;
  });
  await assert.rejects(decoding, reason);
});
