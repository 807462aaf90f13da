// Writes small ONNX files: as much of the format (onnx.proto3) as the networks of the tests need.

/** @typedef {{ type: "float32" | "uint8", dims: (number | string)[] }} Shape */
/** @typedef {{ op: string, inputs: string[], outputs: string[], attributes?: Record<string, number | number[]> }} Node */
/**
 * @typedef {object} Graph
 * @property {Record<string, Shape>} inputs
 * @property {Record<string, Shape>} outputs
 * @property {Record<string, { dims: number[], data: Float32Array | BigInt64Array }>} constants
 * @property {Node[]} nodes
 */

const ELEMENT = { float32: 1, uint8: 2, int64: 7 };
const ATTRIBUTE = { INT: 2, INTS: 7 };

/** The bytes of a network. @param {Graph} graph */
export function onnx({ inputs, outputs, constants, nodes }) {
  const graph = join(
    ...nodes.map((node) => bytes(1, nodeProto(node))),
    bytes(2, "graph"),
    ...Object.entries(constants).map(([name, tensor]) => bytes(5, tensorProto(name, tensor))),
    ...Object.entries(inputs).map(([name, shape]) => bytes(11, valueInfo(name, shape))),
    ...Object.entries(outputs).map(([name, shape]) => bytes(12, valueInfo(name, shape))),
  );
  const opset = join(bytes(1, ""), integer(2, 17));
  return join(integer(1, 8), bytes(2, "depthstitch tests"), bytes(7, graph), bytes(8, opset));
}

/** @param {Node} node */
function nodeProto({ op, inputs, outputs, attributes = {} }) {
  return join(
    ...inputs.map((name) => bytes(1, name)),
    ...outputs.map((name) => bytes(2, name)),
    bytes(4, op),
    ...Object.entries(attributes).map(([name, value]) => {
      const kind = Array.isArray(value)
        ? [...value.map((item) => integer(8, item)), integer(20, ATTRIBUTE.INTS)]
        : [integer(3, value), integer(20, ATTRIBUTE.INT)];
      return bytes(5, join(bytes(1, name), ...kind));
    }),
  );
}

/** @param {string} name @param {{ dims: number[], data: Float32Array | BigInt64Array }} tensor */
function tensorProto(name, { dims, data }) {
  const type = data instanceof Float32Array ? ELEMENT.float32 : ELEMENT.int64;
  const raw = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  return join(
    ...dims.map((dim) => integer(1, dim)),
    integer(2, type),
    bytes(8, name),
    bytes(9, raw),
  );
}

/** @param {string} name @param {Shape} shape */
function valueInfo(name, { type, dims }) {
  const sides = dims.map((dim) =>
    bytes(1, typeof dim === "number" ? integer(1, dim) : bytes(2, dim)),
  );
  const tensor = join(integer(1, ELEMENT[type]), bytes(2, join(...sides)));
  return join(bytes(1, name), bytes(2, bytes(1, tensor)));
}

/** A field of protobuf's wire type 0. @param {number} field @param {number} value */
function integer(field, value) {
  return join(varint(field << 3), varint(value));
}

/** A field of protobuf's wire type 2. @param {number} field @param {string | Uint8Array} value */
function bytes(field, value) {
  const data = typeof value === "string" ? new TextEncoder().encode(value) : value;
  return join(varint((field << 3) | 2), varint(data.length), data);
}

/** @param {number} value not negative */
function varint(value) {
  const out = [];
  for (; value > 127; value = Math.floor(value / 128)) out.push((value % 128) | 128);
  return Uint8Array.from([...out, value]);
}

/** @param {Uint8Array[]} parts */
function join(...parts) {
  return new Uint8Array(Buffer.concat(parts));
}
