// The user's own files: by button and by drop, the right ones and the wrong ones.
import assert from "node:assert/strict";
import { copyFileSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { encodeGrayPng } from "depthstitch/codecs";
import { assertSame, canvasPixels, drop, sampleFile, startSite, stitchAgain } from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

/** @type {Awaited<ReturnType<typeof startSite>>} */
let site;
before(async () => {
  site = await startSite();
});
after(() => site.close());

const scratch = mkdtempSync(join(tmpdir(), "depthstitch-files-"));
after(() => rmSync(scratch, { recursive: true }));

/** A copy of a file of the sample under another name. @param {string} name @param {string} as */
function copied(name, as) {
  const path = join(scratch, as);
  copyFileSync(sampleFile(name), path);
  return path;
}

/** A new file. @param {string} name @param {string | Uint8Array} content */
function written(name, content) {
  const path = join(scratch, name);
  writeFileSync(path, content);
  return path;
}

/** What a card says. @param {Page} page @param {string} slot @param {"file" | "note" | "size"} part */
const said = async (page, slot, part) =>
  (await page.locator(`[data-slot="${slot}"] [data-part="${part}"]`).textContent()) ?? "";

/** Waits until a card has taken a file. @param {Page} page @param {string} slot @param {string} name */
const taken = (page, slot, name) =>
  page.locator(`[data-slot="${slot}"] [data-part="file"]`, { hasText: name }).waitFor();

/** Waits until no card is reading. @param {Page} page */
const settled = (page) =>
  page.locator('.card[aria-busy="true"]').first().waitFor({ state: "detached" });

const message = (/** @type {Page} */ page) => page.locator("#message").textContent();

test("takes photos, depth maps and matches by button", async () => {
  const { page, complaints, close } = await site.open();
  const sample = await canvasPixels(page, "#mosaic");
  await page.setInputFiles("#target-file", copied("target.jpg", "left.jpg"));
  await page.setInputFiles("#reference-file", copied("reference.jpg", "right.jpg"));
  await settled(page);
  assert.equal(await said(page, "target", "file"), "left.jpg");
  assert.equal(await said(page, "matches", "size"), "", "the sample's matches are not the user's");
  assert.ok(await page.isChecked('input[name="depth-kind"][value="inverse"]'));
  assert.equal(await page.inputValue("#depth-invalid"), "", "nor is what its depth values mean");

  await page.locator("#run").click();
  assert.match((await message(page)) ?? "", /matches file is needed.*xt,yt,xr,yr/);

  await page.setInputFiles("#matches-file", sampleFile("matches.csv"));
  await page.setInputFiles("#targetDepth-file", sampleFile("target_depth.png"));
  await settled(page);
  await page.locator("#run").click();
  assert.match(
    (await message(page)) ?? "",
    /reference's depth map is missing.*remove the target's/,
  );

  await page.setInputFiles("#referenceDepth-file", sampleFile("reference_depth.png"));
  await settled(page);
  await useSampleDepthMeaning(page);
  await stitchAgain(page);
  assert.equal(await message(page), "");
  assert.match(
    (await page.locator("#result-source").textContent()) ?? "",
    /left\.jpg onto right\.jpg/,
  );
  const own = await canvasPixels(page, "#mosaic");
  assertSame(own, sample);
  assert.deepEqual(await complaints(), []);
  await close();
});

/** Sets kind and invalid value as the sample's case file has them. @param {Page} page */
async function useSampleDepthMeaning(page) {
  const { depth } = JSON.parse(await readFile(sampleFile("case.json"), "utf8"));
  await page.check(`input[name="depth-kind"][value="${depth.kind}"]`);
  await page.fill("#depth-invalid", depth.invalid === null ? "" : String(depth.invalid));
  await page.locator("#depth-invalid").blur();
}

test("without depth maps aligns by a homography and says so", async () => {
  const { page, close } = await site.open();
  await page.locator('[data-slot="targetDepth"] [data-part="remove"]').click();
  await page.locator('[data-slot="referenceDepth"] [data-part="remove"]').click();
  await stitchAgain(page);
  assert.equal(await page.locator('[data-figure="model"]').textContent(), "Homography");
  assert.match((await page.locator("#warnings").textContent()) ?? "", /depth/i);
  await close();
});

test("takes one file dropped on its card", async () => {
  const { page, close } = await site.open();
  const card = page.locator('[data-slot="reference"]');
  await drop(page, '[data-slot="reference"]', [copied("reference.jpg", "second.jpg")], async () => {
    assert.match(
      (await card.getAttribute("class")) ?? "",
      /over/,
      "the card shows that it would take the file",
    );
  });
  await taken(page, "reference", "second.jpg");
  assert.doesNotMatch((await card.getAttribute("class")) ?? "", /over/);
  assert.equal(await said(page, "target", "size"), "", "the sample leaves with its first photo");
  await close();
});

test("places the files of a whole case by their names, dropped as files or as a folder", async () => {
  const { page, complaints, close } = await site.open();
  const sample = await canvasPixels(page, "#mosaic");
  const names = [
    "case.json",
    "matches.csv",
    "reference.jpg",
    "reference_depth.png",
    "target.jpg",
    "target_depth.png",
  ];
  for (const paths of [names.map(sampleFile), [dirname(sampleFile("case.json"))]]) {
    await page.locator("#clear-inputs").click();
    await drop(page, "#mosaic", paths, () => page.locator("#drop-veil").waitFor());
    await page.locator("#drop-veil").waitFor({ state: "hidden" });
    await taken(page, "target", "target.jpg");
    await settled(page);
    await stitchAgain(page);
    assertSame(await canvasPixels(page, "#mosaic"), sample);
  }
  assert.deepEqual(await complaints(), []);
  await close();
});

test("places photos whose names say nothing in the order of their names", async () => {
  const { page, close } = await site.open();
  await drop(page, "#mosaic", [
    copied("reference.jpg", "IMG_10.jpg"),
    copied("target.jpg", "IMG_9.jpg"),
    copied("matches.csv", "points.csv"),
  ]);
  await taken(page, "target", "IMG_9.jpg");
  await taken(page, "reference", "IMG_10.jpg");
  await settled(page);
  await stitchAgain(page);
  await close();
});

test("says what is wrong with a file and keeps what was there", async () => {
  const { page, close } = await site.open();
  const before = await canvasPixels(page, "#mosaic");
  const text = written("notes.txt", "no picture");
  await page.setInputFiles("#target-file", text);
  await settled(page);
  assert.match(
    await said(page, "target", "note"),
    /notes\.txt is not a picture.*JPEG, PNG or WebP/,
  );
  assert.equal(await said(page, "target", "file"), "target.jpg");

  await page.setInputFiles("#targetDepth-file", text);
  await settled(page);
  assert.match(await said(page, "targetDepth", "note"), /notes\.txt cannot be read as a depth map/);

  await page.setInputFiles("#matches-file", sampleFile("target.jpg"));
  await settled(page);
  assert.match(await said(page, "matches", "note"), /is a picture/);
  for (const [content, words] of /** @type {const} */ ([
    ["", /is empty/],
    ["1,2,3,4\n", /does not begin with the header/],
    ["xt,yt,xr,yr\n1,2,3,4\n1,2,x,4\n", /Line 3 of m\.csv/],
    ["xt,yt,xr,yr\n", /no matches/],
  ])) {
    await page.setInputFiles("#matches-file", written("m.csv", content));
    await settled(page);
    assert.match(await said(page, "matches", "note"), words);
  }

  await drop(page, "#mosaic", [written("song.mp3", "la")]);
  await page.locator("#message", { hasText: "song.mp3" }).waitFor();
  assert.match((await message(page)) ?? "", /None of these files fits/);

  assertSame(await canvasPixels(page, "#mosaic"), before);
  await stitchAgain(page);
  assertSame(await canvasPixels(page, "#mosaic"), before);
  await close();
});

test("warns of a depth map of another shape than its photo", async () => {
  const { page, close } = await site.open();
  const [width, height] = [60, 90];
  const png = await encodeGrayPng({ data: new Uint8Array(width * height).fill(80), width, height });
  await page.setInputFiles("#targetDepth-file", written("turned.png", png));
  await settled(page);
  assert.match(await said(page, "targetDepth", "note"), /60.×.90.*shapes differ/);
  await close();
});

test("hatches unknown depth, and doubts a map that is mostly unknown", async () => {
  const { page, close } = await site.open();
  const [width, height] = [96, 64];
  // A ramp whose upper two thirds have no value.
  const data = Uint8Array.from({ length: width * height }, (_, i) =>
    i < (2 * width * height) / 3 ? 0 : 1 + (i % 200),
  );
  await page.setInputFiles(
    "#targetDepth-file",
    written("holes.png", await encodeGrayPng({ data, width, height })),
  );
  await settled(page);
  assert.ok(Math.abs((await grayShare(page)) - 2 / 3) < 0.05, "metric depth of 0 is unknown");
  assert.match(await said(page, "targetDepth", "note"), /6\d.% of this map is unknown/);

  await page.check('input[name="depth-kind"][value="inverse"]');
  await page.fill("#depth-invalid", "");
  await page.locator("#depth-invalid").blur();
  assert.ok((await grayShare(page)) < 0.05, "an inverse depth of 0 is very far");
  assert.equal(await said(page, "targetDepth", "note"), "");
  await close();
});

/** Share of gray pixels in the picture of the target's depth: the colours of known depth are never gray. @param {Page} page */
async function grayShare(page) {
  const { data } = await canvasPixels(page, '[data-slot="targetDepth"] canvas');
  let gray = 0;
  for (let i = 0; i < data.length; i += 4)
    if (data[i] === data[i + 1] && data[i] === data[i + 2]) gray++;
  return (4 * gray) / data.length;
}

test("puts the core's errors in words and keeps the earlier result", async () => {
  const { page, close } = await site.open();
  const before = await canvasPixels(page, "#mosaic");
  await page.setInputFiles("#matches-file", written("few.csv", "xt,yt,xr,yr\n1,1,1,1\n9,9,9,9\n"));
  await settled(page);
  await page.locator("#run").click();
  await page.locator("#message", { hasText: /of 2 can be used/ }).waitFor();
  assertSame(await canvasPixels(page, "#mosaic"), before);
  assert.match((await page.locator("#status").textContent()) ?? "", /earlier/);

  // Matches that have nothing to do with the photos.
  const noise = ["xt,yt,xr,yr"];
  for (let i = 0, seed = 1; i < 60; i++) {
    const cells = Array.from({ length: 4 }, () => (seed = (seed * 16807) % 2147483647) % 200);
    noise.push(cells.join(","));
  }
  await page.setInputFiles("#matches-file", written("noise.csv", noise.join("\n")));
  await settled(page);
  await page.locator("#run").click();
  await page.locator("#message", { hasText: /agree on one geometry/ }).waitFor();

  await page.locator("#load-sample").click();
  await settled(page);
  await page.locator("summary").click();
  await page.fill("#option-threshold", "-1");
  await page.locator("#run").click();
  await page.locator("#message", { hasText: /threshold.*under Options/i }).waitFor();
  await page.getByRole("button", { name: "Reset to defaults" }).click();
  await stitchAgain(page);
  assert.equal(await message(page), "");
  assertSame(await canvasPixels(page, "#mosaic"), before);
  await close();
});

test("turns a photo as its EXIF data says", async () => {
  const { page, close } = await site.open();
  const upright = await readFile(sampleFile("target.jpg"));
  // An APP1 segment with one big-endian entry: orientation (0x0112) 6, a quarter turn.
  const exif = Buffer.from(
    "ffe100224578696600004d4d002a00000008000101120003000000010006000000000000",
    "hex",
  );
  const turned = Buffer.concat([upright.subarray(0, 2), exif, upright.subarray(2)]);
  const size = (await said(page, "target", "size")).split(/\D+/).filter(Boolean);
  await page.setInputFiles("#target-file", written("turned.jpg", turned));
  await settled(page);
  assert.deepEqual(
    (await said(page, "target", "size")).split(/\D+/).filter(Boolean),
    size.reverse(),
  );
  await close();
});
