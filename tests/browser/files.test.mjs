// Files of the user's own: by button, drop and paste, the right ones and the wrong ones.
import assert from "node:assert/strict";
import { copyFileSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { after, test } from "node:test";
import { decodeDepth, encodeGrayPng } from "depthstitch/codecs";
import {
  assertSame,
  drop,
  finished,
  idle,
  openPanel,
  savedPicture,
  scratchFolder,
  smallCase,
  smallFile,
  smallPhotos,
  startSite,
  stitchAgain,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

const { scratch, written } = scratchFolder();

/** A copy of a file of the small case under another name. @param {string} name @param {string} as */
function copied(name, as) {
  const path = join(scratch, as);
  copyFileSync(smallFile(name), path);
  return path;
}

/** A photo that takes long enough to be read for something to be done meanwhile. */
async function slowPhoto() {
  const side = 5000;
  const black = { data: new Uint8Array(side * side), width: side, height: side };
  return written("slow.png", await encodeGrayPng(black));
}

/** What a card says. @param {Page} page @param {string} slot @param {"file" | "note" | "size"} part */
const said = async (page, slot, part) =>
  (await page.locator(`[data-slot="${slot}"] [data-part="${part}"]`).textContent()) ?? "";

/** Waits until a card says something. @param {Page} page @param {string} slot @param {"file" | "note"} part @param {string | RegExp} words */
const says = (page, slot, part, words) =>
  page
    .locator(`[data-slot="${slot}"] [data-part="${part}"]`, { hasText: words })
    .waitFor({ state: "attached" });

/** Waits until no card is reading. @param {Page} page */
const settled = (page) =>
  page.locator('.card[aria-busy="true"]').first().waitFor({ state: "detached" });

const message = (/** @type {Page} */ page) => page.locator("#message").textContent();

test("takes the photos one by one, and asks for nothing else", async () => {
  const { page, complaints, close } = await site.open();
  await page.setInputFiles("#target-file", copied("target.jpg", "left.jpg"));
  await says(page, "target", "file", "left.jpg");
  const next = page.locator("#next-hint");
  assert.match((await next.textContent()) ?? "", /^left\.jpg is there\. Now add the second photo/);
  assert.ok(await next.isVisible());
  assert.equal(await page.getAttribute("body", "data-phase"), "start");
  await page.setInputFiles("#reference-file", copied("reference.jpg", "right.jpg"));
  await finished(page);
  assert.match(
    (await page.locator("#result-source").textContent()) ?? "",
    /^left\.jpg onto right\.jpg$/,
  );
  assert.equal(await message(page), "");
  assert.deepEqual(await complaints(), []);
  await close();
});

test("takes photos dropped on their cards, and two dropped anywhere", async () => {
  const { page, close } = await site.open();
  const card = page.locator('[data-slot="reference"]');
  const [second] = [copied("reference.jpg", "second.jpg")];
  await drop(page, '[data-slot="reference"]', [second], async () => {
    assert.match((await card.getAttribute("class")) ?? "", /over/, "the card would take the file");
  });
  await says(page, "reference", "file", "second.jpg");
  assert.doesNotMatch((await card.getAttribute("class")) ?? "", /over/);

  const both = [copied("reference.jpg", "IMG_10.jpg"), copied("target.jpg", "IMG_9.jpg")];
  await drop(page, ".masthead", both, () => page.locator("#drop-veil").waitFor());
  await page.locator("#drop-veil").waitFor({ state: "hidden" });
  await says(page, "target", "file", "IMG_9.jpg");
  await says(page, "reference", "file", "IMG_10.jpg");
  await finished(page);
  await close();
});

test("a photo that is dropped while another is read takes the other place", async () => {
  const slow = await slowPhoto();
  /** @type {((page: Page) => Promise<void>)[]} */
  const ways = [
    (page) => drop(page, ".masthead", [slow]),
    (page) => page.setInputFiles("#target-file", slow),
  ];
  for (const way of ways) {
    const { page, complaints, close } = await site.open();
    await way(page);
    await page.locator('[data-slot="target"][aria-busy="true"]').waitFor();
    await drop(page, ".masthead", [copied("reference.jpg", "second.jpg")]);
    await says(page, "reference", "file", "second.jpg");
    await says(page, "target", "file", "slow.png");
    assert.equal(await page.locator("#undo-text").textContent(), "", "nothing was replaced");
    assert.deepEqual(await complaints(), []);
    await close();
  }
});

test("starting over forgets what is dropped and not read yet", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await drop(page, ".masthead", [copied("target.jpg", "first.jpg"), await slowPhoto()]);
  await page.locator('[data-slot="reference"][aria-busy="true"]').waitFor();
  await drop(page, ".masthead", [copied("reference.jpg", "late.jpg")]);
  await page.locator("#clear-inputs").click();
  await drop(page, ".masthead", [copied("reference.jpg", "second.jpg")]);
  await says(page, "target", "file", "second.jpg");
  assert.equal(await page.getAttribute("body", "data-phase"), "start");
  await close();
});

test("takes pasted photos", async () => {
  const { page, close } = await site.open();
  const photos = await Promise.all(
    smallPhotos.map(async (path) => (await readFile(path)).toString("base64")),
  );
  for (const photo of photos) {
    await page.evaluate((photo) => {
      const bytes = Uint8Array.from(atob(photo), (character) => character.charCodeAt(0));
      const data = new DataTransfer();
      data.items.add(new File([bytes], "image.jpg", { type: "image/jpeg" }));
      document.dispatchEvent(new ClipboardEvent("paste", { clipboardData: data, bubbles: true }));
    }, photo);
    await settled(page);
  }
  await finished(page);
  assert.equal(await said(page, "reference", "file"), "image.jpg");
  await close();
});

test("phones offer their camera, desktops do not", async () => {
  const phone = await site.open({
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  for (const slot of ["target", "reference"]) {
    const input = phone.page.locator(`#${slot}-camera`);
    assert.equal(await input.getAttribute("capture"), "environment");
    assert.ok(await phone.page.locator(`label[for="${slot}-camera"]`).isVisible());
  }
  await phone.page.setInputFiles("#target-camera", smallFile("target.jpg"));
  await phone.page.setInputFiles("#reference-camera", smallFile("reference.jpg"));
  await finished(phone.page);
  await phone.close();
  const desktop = await site.open();
  assert.ok(!(await desktop.page.locator('label[for="target-camera"]').isVisible()));
  await desktop.close();
});

test("assigns the files of a case by their names, dropped as files or as a folder", async () => {
  const { page, complaints, close } = await site.open({ files: smallCase });
  const first = await savedPicture(page);
  for (const paths of [smallCase, [dirname(smallFile("case.json"))]]) {
    await page.locator("#clear-inputs").click();
    await drop(page, ".masthead", paths);
    await says(page, "matches", "file", "matches.csv");
    await finished(page);
    assertSame(await savedPicture(page), first);
  }
  assert.deepEqual(await complaints(), []);
  await close();
});

test("reports what is wrong with a photo and keeps the previous one", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const first = await savedPicture(page);
  const heic = Buffer.from("00000018667479706865696300000000", "hex");
  // Only the header: 20 000 × 15 000 pixels, which no browser should try to hold.
  const huge = Buffer.from("89504e470d0a1a0a0000000d4948445200004e2000003a980806000000", "hex");
  for (const [name, content, words] of /** @type {const} */ ([
    ["notes.txt", "no picture", /notes\.txt is not an image.*JPEG, PNG or WebP/],
    ["IMG_1.HEIC", heic, /HEIC photo.*this browser cannot read.*JPEG/],
    ["huge.png", huge, /huge\.png has 20000 × 15000 pixels; the limit of this page is 120 million/],
    ["nothing.jpg", "", /nothing\.jpg is empty/],
    ["broken.jpg", (await readFile(smallFile("target.jpg"))).subarray(0, 300), /damaged/],
  ])) {
    await page.setInputFiles("#target-file", written(name, content));
    await says(page, "target", "note", words);
    assert.equal(await said(page, "target", "file"), "target.jpg");
  }
  await drop(page, ".masthead", [written("song.mp3", "la")]);
  await page.locator("#message", { hasText: "song.mp3" }).waitFor();
  assert.match((await message(page)) ?? "", /None of these files can be used/);
  assertSame(await savedPicture(page), first);
  await close();
});

test("reports what is wrong with matches and depth maps", async () => {
  const { page, close } = await site.open({ files: smallCase });
  await openPanel(page, "depth");
  await openPanel(page, "options");
  const text = written("notes.txt", "no picture");
  await page.setInputFiles("#targetDepth-file", text);
  await says(page, "targetDepth", "note", /notes\.txt cannot be read as a depth map/);
  await page.setInputFiles("#targetDepth-file", written("cut.pfm", "Pf\n40 30\n-1.0\nabc"));
  await says(page, "targetDepth", "note", /cut\.pfm is truncated: it should have 40 × 30/);
  const flat =
    "\x93NUMPY\x01\x00\x46\x00{'descr': '<f4', 'fortran_order': False, 'shape': (1200,), }";
  const cut = Buffer.from(flat.padEnd(79) + "\n", "latin1");
  await page.setInputFiles("#targetDepth-file", written("flat.npy", cut));
  await says(page, "targetDepth", "note", /flat\.npy: has 0 bytes of data, its shape implies 4800/);

  await page.setInputFiles("#matches-file", smallFile("target.jpg"));
  await says(page, "matches", "note", /is an image/);
  for (const [content, words] of /** @type {const} */ ([
    ["", /is empty/],
    ["1,2,3,4\n", /line 1 must be the header/],
    ["xt,yt,xr,yr\n1,2,3,4\n1,2,x,4\n", /m\.csv: line 3: "x" is not a number/],
    ["xt,yt,xr,yr\n", /contains no matches/],
  ])) {
    await page.setInputFiles("#matches-file", written("m.csv", content));
    await says(page, "matches", "note", words);
  }
  await close();
});

test("explains errors of the core and keeps the previous result", async () => {
  const { page, close } = await site.open({ files: smallCase });
  const first = await savedPicture(page);
  await openPanel(page, "options");
  await page.setInputFiles("#matches-file", written("few.csv", "xt,yt,xr,yr\n1,1,1,1\n9,9,9,9\n"));
  await settled(page);
  await page.locator("#run").click();
  await page
    .locator("#message", { hasText: /There are 2, and at least \d are required/ })
    .waitFor();
  assert.match((await page.locator("#status").textContent()) ?? "", /previous/);

  // Matches that have nothing to do with the photos.
  const noise = ["xt,yt,xr,yr"];
  for (let i = 0, seed = 1; i < 60; i++) {
    const cells = Array.from({ length: 4 }, () => (seed = (seed * 16807) % 2147483647) % 150);
    noise.push(cells.join(","));
  }
  await page.setInputFiles("#matches-file", written("noise.csv", noise.join("\n")));
  await settled(page);
  await page.locator("#run").click();
  await page.locator("#message", { hasText: /agree on one geometry/ }).waitFor();

  await page.setInputFiles("#matches-file", smallFile("matches.csv"));
  await settled(page);
  await page.locator("#options summary", { hasText: "Geometry" }).click();
  await page.fill("#option-threshold", "-1");
  await page.locator("#option-threshold").blur();
  await page.locator("#run").click();
  await page.locator("#message", { hasText: /threshold.*under Options/i }).waitFor();
  await page.getByRole("button", { name: "Reset to defaults" }).click();
  await stitchAgain(page);
  assert.equal(await message(page), "");
  assertSame(await savedPicture(page), first);
  await close();
});

test("reads depth from PNG, .npy and .pfm to the same result", async () => {
  const { page, close } = await site.open({ files: smallCase });
  const first = await savedPicture(page);
  await openPanel(page, "depth");
  const { data, width, height } = await decodeDepth(await readFile(smallFile("target_depth.png")));
  const floats = Float32Array.from(data);
  const header = `{'descr': '<f4', 'fortran_order': False, 'shape': (${height}, ${width}), }`;
  const npy = Buffer.concat([
    Buffer.from(`\x93NUMPY\x01\x00\x76\x00${header.padEnd(117)}\n`, "latin1"),
    Buffer.from(floats.buffer),
  ]);
  const rows = Array.from({ length: height }, (_, y) =>
    floats.slice((height - 1 - y) * width, (height - y) * width),
  );
  const pfm = Buffer.concat([
    Buffer.from(`Pf\n${width} ${height}\n-1.0\n`, "latin1"),
    ...rows.map((row) => Buffer.from(row.buffer)),
  ]);
  for (const file of [written("depth.npy", npy), written("depth.pfm", pfm)]) {
    await page.setInputFiles("#targetDepth-file", file);
    await settled(page);
    assert.match(await said(page, "targetDepth", "size"), /float/);
    await stitchAgain(page);
    assert.doesNotMatch((await page.locator("#status").textContent()) ?? "", /reused/);
    assertSame(await savedPicture(page), first);
  }
  await close();
});

test("warns about a depth map of another aspect ratio, and about one that is mostly unknown", async () => {
  const { page, close } = await site.open({ files: smallCase });
  await openPanel(page, "depth");
  const gray = (/** @type {number} */ width, /** @type {number} */ height) => ({
    // Two thirds of it have no value.
    data: Uint8Array.from({ length: width * height }, (_, i) =>
      i < (2 * width * height) / 3 ? 0 : 1 + (i % 200),
    ),
    width,
    height,
  });
  await page.setInputFiles(
    "#targetDepth-file",
    written("turned.png", await encodeGrayPng(gray(60, 90))),
  );
  await says(page, "targetDepth", "note", /60.×.90.*aspect ratios differ/);
  await page.setInputFiles(
    "#targetDepth-file",
    written("holes.png", await encodeGrayPng(gray(96, 64))),
  );
  await page.check('input[name="depth-kind"][value="metric"]');
  await says(page, "targetDepth", "note", /6\d.% of this map is unknown/);
  await page.check('input[name="depth-kind"][value="inverse"]');
  await page.fill("#depth-invalid", "");
  await page.locator("#depth-invalid").blur();
  await page.locator('[data-slot="targetDepth"] [data-part="note"]', { hasText: /^$/ }).waitFor({
    state: "attached",
  });
  await close();
});

test("applies the EXIF orientation and focal length of a photo", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const upright = await readFile(smallFile("target.jpg"));
  // Orientation 6, a quarter turn, and a link to the EXIF directory with a focal length as on film of 26 mm.
  const tiff =
    "4d4d002a00000008" +
    "0002" +
    "0112000300000001" +
    "00060000" +
    "8769000400000001" +
    "00000026" +
    "00000000" +
    "0001" +
    "a405000300000001" +
    "001a0000" +
    "00000000";
  const body = Buffer.from(`457869660000${tiff}`, "hex");
  const length = Buffer.alloc(2);
  length.writeUInt16BE(body.length + 2);
  const turned = Buffer.concat([
    upright.subarray(0, 2),
    Buffer.from("ffe1", "hex"),
    length,
    body,
    upright.subarray(2),
  ]);
  await page.setInputFiles("#target-file", written("turned.jpg", turned));
  await settled(page);
  assert.match(await said(page, "target", "size"), /^160.×.240, 26.mm$/);
  await idle(page);
  await close();
});

test("the warning about the shape of a depth map comes and goes with its photo", async () => {
  const { page, close } = await site.open({ files: smallCase });
  const tall = { data: new Uint8Array(60 * 90), width: 60, height: 90 };
  await page.setInputFiles("#target-file", written("tall.png", await encodeGrayPng(tall)));
  await says(page, "targetDepth", "note", /its photo 60.×.90: the aspect ratios differ/);
  await page.setInputFiles("#target-file", smallFile("target.jpg"));
  await says(page, "targetDepth", "note", /^$/);
  await close();
});
