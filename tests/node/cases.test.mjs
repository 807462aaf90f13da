// The files of a case: matrices, matches and case.json.
import assert from "node:assert/strict";
import { test } from "node:test";
import { parseCase, parseMatches, parseNpy } from "depthstitch/cases";

/** @param {string} header @param {number[]} data @param {{ bytes?: number, major?: number }} [options] */
function npy(header, data, { bytes = 4, major = 1 } = {}) {
  const start = major === 1 ? 10 : 12;
  const file = new Uint8Array(start + header.length + data.length * bytes);
  const view = new DataView(file.buffer);
  file.set([0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, major, 0]);
  if (major === 1) view.setUint16(8, header.length, true);
  else view.setUint32(8, header.length, true);
  file.set(new TextEncoder().encode(header), start);
  for (const [i, value] of data.entries()) {
    const at = start + header.length + i * bytes;
    if (bytes === 4) view.setFloat32(at, value, true);
    else view.setFloat64(at, value, true);
  }
  return file;
}

test("npy: float32 and float64, one and two dimensions, versions 1 and 2", () => {
  const f4 = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n";
  const image = parseNpy(npy(f4, [1, 2, 3, 4, 5, 0.1]), "a.npy");
  assert.deepEqual(image, { data: new Float32Array([1, 2, 3, 4, 5, 0.1]), shape: [2, 3] });
  const f8 = "{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }\n";
  const line = parseNpy(npy(f8, [0.1, -Infinity], { bytes: 8, major: 2 }), "a.npy");
  assert.deepEqual(line, { data: new Float64Array([0.1, -Infinity]), shape: [2] });
});

test("npy: every type, in both byte orders, is read exactly", () => {
  /** @type {[string, number[], number[], Float32ArrayConstructor | Float64ArrayConstructor][]} */
  const types = [
    ["|u1", [7, 255], [7, 255], Float32Array],
    ["|i1", [0x80, 1], [-128, 1], Float32Array],
    ["<u2", [1, 2, 0xff, 0xff], [513, 65535], Float32Array],
    [">u2", [1, 2, 0xff, 0xff], [258, 65535], Float32Array],
    ["<i2", [0, 0x80, 1, 0], [-32768, 1], Float32Array],
    ["<i4", [0xff, 0xff, 0xff, 0xff, 1, 0, 0, 1], [-1, 16777217], Float64Array],
    [">u4", [0xff, 0xff, 0xff, 0xff, 1, 0, 0, 1], [4294967295, 16777217], Float64Array],
    [">f4", [0x3f, 0xc0, 0, 0, 0xff, 0x80, 0, 0], [1.5, -Infinity], Float32Array],
    ["<f2", [0, 0x3c, 1, 0], [1, 2 ** -24], Float32Array],
  ];
  for (const [descr, bytes, values, Data] of types) {
    const header = `{'descr': '${descr}', 'fortran_order': False, 'shape': (2,), }\n`;
    const file = Buffer.concat([npy(header, []), Buffer.from(bytes)]);
    assert.deepEqual(parseNpy(file, "a.npy"), { data: Data.from(values), shape: [2] }, descr);
  }
});

test("npy: anything else is refused with the file's name", () => {
  const header = (/** @type {string} */ descr, /** @type {string} */ order) =>
    `{'descr': '${descr}', 'fortran_order': ${order}, 'shape': (2,), }\n`;
  const good = npy(header("<f4", "False"), [1, 2]);
  const refused = [
    { bytes: new Uint8Array(3), reason: /is not an \.npy file/ },
    { bytes: good.subarray(0, 9), reason: /is not an \.npy file/ },
    { bytes: good.subarray(0, 40), reason: /is truncated/ },
    {
      bytes: good.subarray(0, good.length - 1),
      reason: /has 7 bytes of data, its shape implies 8/,
    },
    { bytes: npy(header("<c8", "False"), [1, 2]), reason: /unsupported type <c8/ },
    { bytes: npy(header("<f4", "True"), [1, 2]), reason: /Fortran order/ },
    { bytes: npy("{}", []), reason: /no valid header/ },
    { bytes: npy(header("<f4", "False"), [1, 2], { major: 9 }), reason: /version 9/ },
  ];
  for (const { bytes, reason } of refused) {
    assert.throws(() => parseNpy(bytes, "a.npy"), {
      name: "FileError",
      code: "invalid-npy",
      message: reason,
    });
  }
});

test("matches: numbers by row; what is wrong is named with its line", () => {
  const text = "xt, yt ,xr,yr\r\n1,2.5,-3,4e1\r\n\r\n5,6,7,8\n";
  assert.deepEqual(parseMatches(text, "m.csv"), new Float32Array([1, 2.5, -3, 40, 5, 6, 7, 8]));
  assert.deepEqual(parseMatches("xt,yt,xr,yr", "m.csv"), new Float32Array());
  const refused = [
    { text: "", reason: /line 1 must be the header/ },
    { text: "1,2,3,4", reason: /line 1 must be the header/ },
    { text: "xr,yr,xt,yt\n1,2,3,4", reason: /line 1 must be the header/ },
    { text: "xt,yt,xr,yr\n1,2,3", reason: /line 2 has 3 values/ },
    { text: "xt,yt,xr,yr\n\n1,2,3,x", reason: /line 3: "x" is not a number/ },
    { text: "xt,yt,xr,yr\n1,2,,4", reason: /line 2: "" is not a number/ },
    { text: "xt,yt,xr,yr\n1,2,nan,4", reason: /line 2: "nan" is not a number/ },
    { text: "xt,yt,xr,yr\n1,2,1e999,4", reason: /line 2: "1e999" is not a number/ },
  ];
  for (const { text, reason } of refused) {
    assert.throws(() => parseMatches(text, "m.csv"), { code: "invalid-matches", message: reason });
  }
});

test("case.json: every wrong key is named", () => {
  const good = {
    target: "t.png",
    reference: "r.png",
    matches: "m.csv",
    target_depth: "a.png",
    reference_depth: "b.png",
    depth: { kind: "metric", scale: 2, invalid: 0 },
    truth_map: {
      H_inf: [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
      ],
      e_prime: [1, 2, 3],
    },
  };
  const parse = (/** @type {object} */ change) =>
    parseCase(JSON.stringify({ ...good, ...change }), "case.json");
  const parsed = parse({});
  assert.deepEqual(parsed.truth, { h: [1, 0, 0, 0, 1, 0, 0, 0, 1], e: [1, 2, 3], ownDepth: true });
  assert.deepEqual(parsed.depth, {
    kind: "metric",
    scale: 2,
    invalid: 0,
    target: "a.png",
    reference: "b.png",
  });
  assert.equal(parse({ depth: null }).depth, null);
  assert.equal(parse({ reference_depth: undefined }).depth?.reference, null);
  assert.equal(parse({ matches: undefined }).matches, null);
  assert.equal(parse({ depth: { kind: "metric" } }).depth?.scale, 1);
  assert.equal(parse({ truth: good.truth_map }).truth?.ownDepth, false);
  const refused = [
    { change: { target: 5 }, reason: /"target" must be a file name/ },
    { change: { target_depth: 7 }, reason: /"target_depth" must be a file name/ },
    {
      change: { target_depth: undefined, reference_depth: null },
      reason: /"depth" needs "target_depth" or "reference_depth"/,
    },
    { change: { depth: [] }, reason: /"depth" must be an object/ },
    { change: { depth: { kind: "far", scale: 1 } }, reason: /"depth.kind"/ },
    { change: { depth: { kind: "metric", scale: 0 } }, reason: /"depth.scale"/ },
    { change: { depth: { kind: "metric", scale: 1, invalid: "0" } }, reason: /"depth.invalid"/ },
    { change: { truth: { H_inf: [1], e_prime: [1, 2, 3] } }, reason: /"H_inf" must be 9 numbers/ },
    { change: { truth: { H_inf: Array(9).fill("1"), e_prime: [] } }, reason: /"H_inf"/ },
  ];
  for (const { change, reason } of refused) {
    assert.throws(() => parse(change), { code: "invalid-case", message: reason });
  }
  assert.throws(() => parseCase("{", "case.json"), { code: "invalid-case" });
});
