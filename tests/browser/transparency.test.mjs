// Photos with transparent pixels on the page.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, test } from "node:test";
import { stitch } from "depthstitch";
import { decodeImage, encodePng } from "depthstitch/codecs";
import { assertSame, savedPicture, scratchFolder, smallPhotos, startSite } from "./page.mjs";

const site = await startSite();
after(() => site.close());

const { written } = scratchFolder();

test("shows another photo, or fills, where a photo is transparent", async () => {
  const [target, reference] = await Promise.all(
    smallPhotos.map(async (path) => decodeImage(await readFile(path))),
  );
  assert.ok(target && reference);
  const { data, width, height } = reference;
  for (let i = 0; i < width * height; i++) {
    const [x, y] = [(i % width) - width / 3, Math.floor(i / width) - height / 2];
    if (x * x + y * y < 400) data.fill(0, 4 * i, 4 * i + 4);
  }
  const files = [
    written("target.png", await encodePng(target)),
    written("reference.png", await encodePng(reference)),
  ];
  const { page, complaints, close } = await site.open({ files });
  const { mosaic } = await stitch(target, reference);
  assertSame(await savedPicture(page), mosaic);
  assert.deepEqual(await complaints(), []);
  await close();

  const nothing = { width, height, data: new Uint8ClampedArray(data.length) };
  const empty = written("empty.png", await encodePng(nothing));
  const second = await site.open();
  await second.page.setInputFiles("#many-files", [files[0] ?? "", empty]);
  const message = second.page.locator("#message", { hasText: "wholly transparent" });
  await message.waitFor();
  await second.close();
});
