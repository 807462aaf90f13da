// Networks in the page: depth and inpainting, requested by the user, from a host that the user names.
import assert from "node:assert/strict";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, test } from "node:test";
import { folder, lamaLike, removeDepthModel, writeDepthModel } from "../models/networks.mjs";
import { weights } from "../models/weights.mjs";
import {
  assertSame,
  idle,
  openPanel,
  saved,
  savedPicture,
  smallCase,
  smallPhotos,
  startSite,
  stitchAgain,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const host = "https://models.test/";
/** A small network under the name that the page asks for. */
const MODEL = "onnx-community/depth-anything-v2-small";

writeDepthModel(MODEL);
writeFileSync(join(folder, "lama-like.onnx"), lamaLike(512));
const site = await startSite();
after(async () => {
  removeDepthModel(MODEL);
  await site.close();
});

/**
 * Serves target/models as the host of the networks; returns what was asked for.
 *
 * @param {Page} page
 * @param {{ slow?: boolean }} [how] whether weights never arrive
 */
async function serveModels(page, { slow = false } = {}) {
  /** @type {string[]} */
  const asked = [];
  await page.route(`${host}**`, async (route) => {
    const path = new URL(route.request().url()).pathname.replace(/\/resolve\/[0-9a-f]{40}\//, "/");
    asked.push(path);
    const file = join(folder, path);
    const headers = { "Access-Control-Allow-Origin": "*" };
    if (slow && path.endsWith(".onnx")) return;
    if (!existsSync(file)) return route.fulfill({ status: 404, headers });
    return route.fulfill({ body: readFileSync(file), headers });
  });
  return asked;
}

/** Asks for depth by the network. @param {Page} page */
async function askForDepth(page) {
  await openPanel(page, "depth");
  await page.check('input[name="depth-source"][value="model"]');
  await page.fill("#depth-host", host);
  await page.locator("#depth-host").blur();
  await page.locator("#depth-estimate").click();
}

/** What must stay empty, but for the host that was asked for. @param {() => Promise<string[]>} complaints */
const others = async (complaints) =>
  (await complaints()).filter((complaint) => !complaint.startsWith(`request to ${host}`));

/** As these maps contradict the photos, depth is found by the photos; refined, it might give way to a homography. */
const withDepth = "#refinement=none";

test("two-view depth first, then depth by a network, which is fetched once", async () => {
  const { page, complaints, close } = await site.open({ files: smallPhotos, hash: withDepth });
  const asked = await serveModels(page);
  const first = await savedPicture(page);
  assert.match(
    (await page.locator('[data-figure="model"]').textContent()) ?? "",
    /two views|Homography/,
  );
  assert.equal(asked.length, 0, "nothing is fetched before it is asked for");

  await askForDepth(page);
  await idle(page);
  assert.match((await page.locator("#status").textContent()) ?? "", /^Done/);
  assert.equal(await page.locator("#message").textContent(), "");
  assert.ok(asked.some((path) => path.endsWith(".onnx")));
  const report = JSON.parse((await saved(page, "#download-report")).bytes.toString());
  assert.equal(report.depthSource, "model");
  await page.locator("#tab-depth").click();
  await page.locator("#view-caption", { hasText: "estimated by Depth Anything" }).waitFor();
  assert.match((await page.locator("#depth-summary").textContent()) ?? "", /Depth Anything/);

  const count = asked.length;
  await page.locator("#depth-estimate").click();
  await idle(page);
  assert.equal(asked.length, count, "neither network nor depth is fetched or made again");
  assert.match((await page.locator("#status").textContent()) ?? "", /reused/);
  await page.check('input[name="depth-source"][value="photos"]');
  await stitchAgain(page);
  assertSame(await savedPicture(page), first);
  assert.deepEqual(await others(complaints), []);
  await close();
});

/**
 * Asks for depth by a network of the user's own.
 *
 * @param {Page} page
 * @param {string} file
 * @param {{ colours: string, output: string }} how
 */
async function askForOwnDepth(page, file, { colours, output }) {
  await openPanel(page, "depth");
  await page.check('input[name="depth-source"][value="model"]');
  await page.selectOption("#depth-model", "onnx");
  const button = page.locator("#depth-estimate");
  assert.equal(await button.getAttribute("aria-disabled"), "true", "without an address");
  assert.equal(await page.locator("#depth-host").isVisible(), false);
  await page.fill("#depth-onnx-address", host + file);
  await page.locator("#depth-onnx-address").blur();
  await page.selectOption("#depth-onnx-colours", colours);
  await page.selectOption("#depth-onnx-output", output);
  await button.click();
  await idle(page);
  assert.equal(await page.locator("#message").textContent(), "");
}

test("depth by a custom network, inverse and metric", async () => {
  const { page, complaints, close } = await site.open({ files: smallPhotos, hash: withDepth });
  const asked = await serveModels(page);
  const file = `${MODEL}/onnx/model.onnx`;
  await askForOwnDepth(page, file, { colours: "imagenet", output: "inverse" });
  assert.deepEqual(asked, [`/${file}`], "one file is fetched");
  await page.locator("#tab-depth").click();
  await page.locator("#view-caption", { hasText: "estimated by the custom network" }).waitFor();
  assert.doesNotMatch(new URL(page.url()).hash, /models\.test|onnx/, "no link fetches it");
  await page.selectOption("#depth-onnx-output", "metric");
  await page.locator("#depth-estimate").click();
  await idle(page);
  // The test's network knows nothing of the scene, so its maps contradict the photos and both ways look alike.
  assert.equal(asked.length, 1, "what was fetched is kept");
  assert.deepEqual(await others(complaints), []);
  await close();
});

test("FastDepth, in the page", async (t) => {
  const { missing } = weights("fastdepth");
  if (missing) return t.skip(missing);
  const { page, complaints, close } = await site.open({ files: smallPhotos });
  const asked = await serveModels(page);
  await askForOwnDepth(page, "fastdepth.onnx", { colours: "plain", output: "metric" });
  assert.deepEqual(asked, ["/fastdepth.onnx"]);
  assert.match((await page.locator("#status").textContent()) ?? "", /^Done/);
  assert.deepEqual(await others(complaints), []);
  await close();
});

test("downloads are reported, can be cancelled, and can fail", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  const first = await savedPicture(page);
  await serveModels(page, { slow: true });
  await askForDepth(page);
  await page.locator("#status", { hasText: /^Downloading the depth network/ }).waitFor();
  await page.keyboard.press("Escape");
  await page.locator("#status", { hasText: "Cancelled" }).waitFor();

  await page.unroute(`${host}**`);
  await page.route(`${host}**`, (route) => route.abort());
  await page.locator("#depth-estimate").click();
  await page.locator("#message", { hasText: /network could not be used/ }).waitFor();
  assertSame(await savedPicture(page), first);

  await page.unroute(`${host}**`);
  await serveModels(page);
  await page.locator("#depth-estimate").click();
  await idle(page);
  assert.match((await page.locator("#status").textContent()) ?? "", /^Done/);
  await close();
});

test("a network that cannot fill is not said to have filled", async () => {
  const { page, close } = await site.open({ files: smallCase });
  const built = await savedPicture(page);
  await page.route(`${host}**`, (route) => route.abort());
  await openPanel(page, "fill");
  await page.check('input[name="fill-method"][value="lama"]');
  await page.fill("#fill-address", `${host}lama-like.onnx`);
  await page.locator("#fill-address").blur();
  await page.locator("#run").click();
  await idle(page);
  await page.locator("#message", { hasText: /network could not be used/ }).waitFor();
  assert.match((await page.locator("#report-text").textContent()) ?? "", /from their surroundings/);
  await page.locator("#tab-voids").click();
  await page.locator("#view-caption", { hasText: "filled from their surroundings" }).waitFor();
  const source = await page.locator("#result-source").textContent();
  assert.match(source ?? "", /made with other settings/);
  assertSame(await savedPicture(page), built);

  await page.unroute(`${host}**`);
  await serveModels(page);
  await page.locator("#run").click();
  await idle(page);
  assert.match((await page.locator("#report-text").textContent()) ?? "", /inpainted by LaMa/);
  await page.locator("#view-caption", { hasText: "inpainted by LaMa" }).waitFor();
  assert.doesNotMatch((await page.locator("#result-source").textContent()) ?? "", /settings/);
  await close();
});

/** Fills with a network and compares with what the core filled. @param {"migan" | "lama"} model @param {string} file */
async function fillWith(model, file) {
  const { page, complaints, close } = await site.open({ files: smallCase });
  const built = await savedPicture(page);
  const asked = await serveModels(page);
  await openPanel(page, "fill");
  await page.check(`input[name="fill-method"][value="${model}"]`);
  await page.fill("#fill-address", host + file);
  await page.locator("#fill-address").blur();
  await page.locator("#run").click();
  await idle(page);
  assert.match((await page.locator("#status").textContent()) ?? "", /^Done/);
  const filled = await savedPicture(page);
  let [voids, changed] = [0, 0];
  for (let i = 0; i < built.data.length; i += 4) {
    const same = [0, 1, 2].every((c) => built.data[i + c] === filled.data[i + c]);
    if (!same) changed++;
    voids++;
  }
  assert.ok(
    changed > 0 && changed < 0.2 * voids,
    `${changed} of ${voids} pixels are the network's`,
  );

  const count = asked.length;
  await page.check('input[name="fill-method"][value="core"]');
  await stitchAgain(page);
  assertSame(await savedPicture(page), built);
  await page.check(`input[name="fill-method"][value="${model}"]`);
  await stitchAgain(page);
  assertSame(await savedPicture(page), filled);
  assert.equal(asked.length, count, "nothing is computed twice");
  assert.deepEqual(await others(complaints), []);
  await close();
}

test("fills voids by a network of LaMa's interface", () => fillWith("lama", "lama-like.onnx"));

const migan = weights("migan");
test("fills voids by MI-GAN with its real weights", { skip: migan.missing }, () =>
  fillWith("migan", "migan.onnx"),
);

test("an address that is being typed outlasts the end of a run", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await openPanel(page, "depth");
  await page.check('input[name="depth-source"][value="model"]');
  await page.fill("#depth-host", host);
  // Without a click, which would end the typing.
  await page.evaluate(() => document.querySelector("#swap")?.dispatchEvent(new Event("click")));
  await page.locator("#result-source", { hasText: "reference.jpg onto target.jpg" }).waitFor();
  await idle(page);
  assert.equal(await page.inputValue("#depth-host"), host);
  assert.equal(await page.evaluate(() => document.activeElement?.id), "depth-host");
  await close();
});
