// How calls run: progress, abort, queue, transfer, and what happens after something broke.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { test } from "node:test";
import { stitch, StitchError } from "depthstitch";
import { rejection, sample } from "./sample.mjs";

/** @typedef {import("depthstitch").Progress} Progress */
/** @typedef {import("node:worker_threads").Worker} Worker */

const { target, reference, inputs } = await sample();
const { times: _, ...expected } = await stitch(target, reference, inputs);

/** Stitches the sample and checks that it comes out as ever. @param {import("depthstitch").StitchOptions} [options] */
async function works(options) {
  const { times: _, ...result } = await stitch(target, reference, { ...inputs, ...options });
  assert.deepEqual(result, expected);
}

/** The sample five times as wide and high, for tests that must act while the worker works. */
const large = (() => {
  const times = 5;
  /** @param {import("depthstitch").ImageOutput} image */
  const enlarge = ({ data, width, height }) => {
    const source = new Uint32Array(data.buffer);
    const pixels = new Uint32Array(source.length * times * times);
    for (let i = 0; i < pixels.length; i++) {
      const x = Math.floor((i % (width * times)) / times);
      const y = Math.floor(i / (width * times) / times);
      pixels[i] = source[y * width + x] ?? 0;
    }
    const bytes = new Uint8ClampedArray(pixels.buffer);
    return { data: bytes, width: width * times, height: height * times };
  };
  return {
    target: enlarge(target),
    reference: enlarge(reference),
    inputs: { ...inputs, matches: inputs.matches.map((value) => value * times) },
  };
})();

for (const worker of [true, false]) {
  const where = worker ? "in a worker" : "on the calling thread";

  test(`${where}: progress goes through the stages and never back`, async () => {
    /** @type {Progress[]} */
    const seen = [];
    await works({ worker, onProgress: (progress) => void seen.push(progress) });
    const stages = seen.map(({ stage }) => stage).filter((stage, i, all) => stage !== all[i - 1]);
    assert.deepEqual(stages, ["input", "estimate", "refine", "warp", "blend", "measure", "fill"]);
    seen.forEach(({ stage, fraction }, i) => {
      assert.ok(fraction >= 0 && fraction <= 1);
      const before = seen[i - 1];
      if (before?.stage === stage) assert.ok(fraction >= before.fraction);
    });
  });

  test(`${where}: a signal aborted before the call`, async () => {
    const reason = new Error("changed my mind");
    const signal = AbortSignal.abort(reason);
    const error = await rejection(stitch(target, reference, { ...inputs, worker, signal }));
    assert.equal(error.name, "AbortError");
    assert.equal(error.code, "aborted");
    assert.equal(error.cause, reason);
    await works({ worker });
  });

  test(`${where}: a signal aborted during the call`, async () => {
    const controller = new AbortController();
    /** @type {Progress[]} */
    const seen = [];
    const call = stitch(target, reference, {
      ...inputs,
      worker,
      signal: controller.signal,
      onProgress(progress) {
        seen.push(progress);
        if (progress.stage === "estimate") controller.abort();
      },
    });
    const error = await rejection(call);
    assert.equal(error.name, "AbortError");
    assert.equal(seen.at(-1)?.stage, "estimate");
    await works({ worker });
  });

  for (const mine of [new Error("mine"), "mine", undefined]) {
    test(`${where}: what onProgress throws rejects the call: ${mine}`, async () => {
      const onProgress = () => {
        throw mine;
      };
      const call = stitch(target, reference, { ...inputs, worker, onProgress });
      /** @param {unknown} error */
      const isMine = (error) => error === mine;
      await assert.rejects(call, isMine);
      await works({ worker });
    });
  }
}

test("aborting is at once: it does not wait for the worker", async () => {
  const controller = new AbortController();
  let settled = false;
  const { signal } = controller;
  const aborted = new Promise((resolve) => {
    const onProgress = () => {
      controller.abort();
      setImmediate(() => resolve(settled));
    };
    const options = { ...large.inputs, signal, onProgress };
    stitch(large.target, large.reference, options).catch(() => (settled = true));
  });
  assert.equal(await aborted, true);
  await works();
});

test("concurrent calls all come out, in order", async () => {
  /** @type {number[]} */
  const order = [];
  await Promise.all([1, 2, 3].map((i) => works().then(() => order.push(i))));
  assert.deepEqual(order, [1, 2, 3]);
});

test("aborting a waiting call leaves the others alone", async () => {
  const controller = new AbortController();
  const first = works();
  const second = rejection(stitch(target, reference, { ...inputs, signal: controller.signal }));
  const third = works();
  controller.abort();
  assert.equal((await second).code, "aborted");
  await Promise.all([first, third]);
});

test("a failing call leaves the waiting ones alone", async () => {
  const failing = rejection(stitch(target, reference, { matches: new Float32Array(4) }));
  await Promise.all([works(), works()]);
  assert.equal((await failing).code, "too-few-matches");
});

test("inputs are copied: they may change as soon as the call is made", async () => {
  const given = await sample();
  const call = stitch(given.target, given.reference, given.inputs);
  given.target.data.fill(0);
  given.inputs.matches.fill(0);
  const { times: _, ...result } = await call;
  assert.deepEqual(result, expected);
  assert.ok(given.reference.data.length > 0);
});

test("transfer takes the buffers, and only those used as a whole", async () => {
  const given = await sample();
  const { matches } = given.inputs;
  const part = new Float32Array(matches.length + 8);
  part.set(matches, 8);
  const call = stitch(given.target, given.reference, {
    ...given.inputs,
    matches: part.subarray(8),
    transfer: true,
  });
  assert.equal(given.target.data.length, 0);
  assert.equal(given.reference.data.length, 0);
  assert.equal(given.inputs.targetDepth.data.length, 0);
  assert.equal(part.length, matches.length + 8);
  const { times: _, ...result } = await call;
  assert.deepEqual(result, expected);
});

test("a refused call takes nothing", async () => {
  const given = await sample();
  await rejection(
    stitch(given.target, given.reference, /** @type {any} */ ({ transfer: true, seed: {} })),
  );
  assert.ok(given.target.data.length > 0);
});

test("one array may be passed twice", async () => {
  const given = await sample();
  const options = { ...given.inputs, referenceDepth: given.inputs.targetDepth, transfer: true };
  const once = await stitch(target, reference, { ...inputs, referenceDepth: inputs.targetDepth });
  const twice = await stitch(given.target, given.reference, options);
  assert.deepEqual(twice.mosaic, once.mosaic);
});

test("arrays over shared memory and over a part of a buffer", async () => {
  const shared = new Uint8ClampedArray(new SharedArrayBuffer(target.data.length));
  shared.set(target.data);
  const padded = Buffer.concat([
    Buffer.alloc(12),
    Buffer.from(reference.data.buffer),
    Buffer.alloc(4),
  ]);
  const part = padded.subarray(12, 12 + reference.data.length);

  for (const worker of [true, false]) {
    const result = await stitch(
      { ...target, data: shared },
      { ...reference, data: part },
      { ...inputs, worker },
    );
    assert.deepEqual(result.mosaic, expected.mosaic);
  }
});

test("a worker that dies rejects its call; the next one works", async () => {
  /** @type {Worker | undefined} */
  let current;
  /** @param {Worker} worker */
  const remember = (worker) => void (current = worker);
  process.on("worker", remember);
  // Aborting ends the worker there is, so the next call starts the one to be seen.
  const controller = new AbortController();
  const aborted = rejection(stitch(target, reference, { ...inputs, signal: controller.signal }));
  controller.abort();
  await aborted;
  const onProgress = () => void current?.terminate();
  const call = stitch(large.target, large.reference, { ...large.inputs, onProgress });
  const error = await rejection(call);
  process.off("worker", remember);
  assert.ok(current);
  assert.equal(error.code, "internal");
  assert.match(error.message, /worker/);
  await works();
});

for (const { thrown, code, says } of [
  {
    thrown: new WebAssembly.RuntimeError("unreachable"),
    code: "internal",
    says: "the core failed unexpectedly: unreachable",
  },
  {
    thrown: new RangeError("could not allocate memory"),
    code: "out-of-memory",
    says: "out of memory: could not allocate memory",
  },
]) {
  test(`an exception inside the core makes it start afresh: ${code}`, async () => {
    const { now } = Performance.prototype;
    Performance.prototype.now = () => {
      throw thrown;
    };
    let error;
    try {
      error = await rejection(stitch(target, reference, { ...inputs, worker: false }));
    } finally {
      Performance.prototype.now = now;
    }
    assert.ok(error instanceof StitchError);
    assert.equal(error.code, code);
    assert.equal(error.message, says);
    await works({ worker: false });
  });
}

test("a program ends when its work is done, and not before", () => {
  const program = `
    import { stitch } from "depthstitch";
    import { sample } from "./tests/node/sample.mjs";
    const { target, reference, inputs } = await sample();
    const result = await stitch(target, reference, inputs);
    console.log(result.mosaic.width);`;
  const { status, stdout, stderr } = spawnSync(
    process.execPath,
    ["--input-type=module", "--eval", program],
    { cwd: new URL("../..", import.meta.url), encoding: "utf8", timeout: 60_000 },
  );
  assert.equal(stderr, "");
  assert.equal(status, 0);
  assert.equal(Number(stdout), expected.mosaic.width);
});

test("importing the package does nothing", () => {
  const program = `
    const refuse = () => { throw new Error("something was started"); };
    process.on("worker", refuse);
    WebAssembly.compile = WebAssembly.instantiate = globalThis.fetch = refuse;
    await import("depthstitch");
    await import("depthstitch/codecs");
    await import("depthstitch/depth");
    await import("depthstitch/inpaint");`;
  const { status, stderr } = spawnSync(
    process.execPath,
    ["--input-type=module", "--eval", program],
    { cwd: new URL("../..", import.meta.url), encoding: "utf8" },
  );
  assert.equal(stderr, "");
  assert.equal(status, 0);
});
