// File names that are not UTF-8, on the command line.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { fileURLToPath } from "node:url";
import { nameOf, systemPath } from "../../dist/cases/file-names.js";

const main = fileURLToPath(new URL("../../dist/cli/main.js", import.meta.url));
const small = fileURLToPath(new URL("../../target/sample-small/", import.meta.url));

test("every name of bytes is a string and the same bytes again", () => {
  const names = [
    ...["a.jpg", "Grüße 東京 🏛.png", "\ufffd.png"].map((name) => Buffer.from(name)),
    ...["ff", "61e9", "c3", "e282", "eda080", "f4908080", "c0af", "f09f8f"].map((hex) =>
      Buffer.from(hex, "hex"),
    ),
    ...Array.from({ length: 200 }, (_, i) =>
      Buffer.from(Array.from({ length: 8 }, (_, k) => (i * 97 + k * 61 + i * k * 13) % 256)),
    ),
  ];
  for (const bytes of names) {
    assert.deepEqual(Buffer.from(systemPath(nameOf(bytes))), bytes, bytes.toString("hex"));
  }
  const plain = "Grüße 東京 🏛.png";
  assert.equal(nameOf(Buffer.from(plain)), plain);
  assert.equal(systemPath(plain), plain);
});

test("photos and outputs may have names that are not UTF-8", (t) => {
  if (process.platform !== "linux") {
    t.skip("file names are UTF-8 here");
    return;
  }
  const folder = mkdtempSync(join(tmpdir(), "depthstitch-names-"));
  after(() => rmSync(folder, { recursive: true }));
  const inFolder = (/** @type {string} */ name) =>
    Buffer.concat([Buffer.from(`${folder}/`), Buffer.from(name, "latin1")]);
  copyFileSync(join(small, "target.jpg"), inFolder("a\xff.jpg"));
  // Node would replace the bytes of this name by those of the other's.
  copyFileSync(join(small, "reference.jpg"), inFolder("a\xfe.jpg"));
  copyFileSync(join(small, "target.jpg"), join(folder, "a.jpg"));
  copyFileSync(join(small, "reference.jpg"), join(folder, "b.jpg"));
  const run = (/** @type {string} */ args) => {
    // A shell, as Node passes strings only.
    const command = `"$0" "$1" ${args}`;
    return spawnSync("sh", ["-c", command, process.execPath, main], {
      cwd: folder,
      encoding: "utf8",
    });
  };
  const photos = `"$(printf 'a\\377.jpg')" "$(printf 'a\\376.jpg')"`;

  const { status, stderr } = run(`${photos} -o "$(printf 'm\\351.png')" --report r.json -q`);
  assert.equal(status, 0, stderr);
  assert.equal(run("a.jpg b.jpg -o plain.png -q").status, 0);
  const made = readFileSync(inFolder("m\xe9.png"));
  assert.ok(made.equals(readFileSync(join(folder, "plain.png"))), "the same picture");
  const left = readdirSync(folder, "buffer").map((name) => name.toString("latin1"));
  assert.deepEqual(left.sort(), [
    "a.jpg",
    "a\xfe.jpg",
    "a\xff.jpg",
    "b.jpg",
    "m\xe9.png",
    "plain.png",
    "r.json",
  ]);

  const same = run(`${photos} -o "$(printf 'a\\376.jpg')"`);
  assert.deepEqual([same.status, /it is an input/.test(same.stderr)], [2, true]);
  const missing = run(`"$(printf 'x\\377.jpg')" b.jpg -o o.png`);
  assert.deepEqual([missing.status, /not-found: x\ufffd\.jpg/.test(missing.stderr)], [1, true]);
});
