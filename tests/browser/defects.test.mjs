// What a user stumbled over once: nothing is lost, nothing is said where it cannot be seen or when it is no longer true.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { after, test } from "node:test";
import { encodePng } from "depthstitch/codecs";
import {
  assertSame,
  drop,
  exampleFile,
  finished,
  idle,
  openPanel,
  savedPicture,
  scratchFolder,
  smallCase,
  smallFile,
  smallPhotos,
  startSite,
  statusSays,
} from "./page.mjs";

/** @typedef {import("./page.mjs").Page} Page */

const site = await startSite();
after(() => site.close());

const { written } = scratchFolder();

/** Whether an element is within the window. @param {Page} page @param {string} selector */
const inView = (page, selector) =>
  page.locator(selector).evaluate((element) => {
    const { top, bottom, height } = element.getBoundingClientRect();
    return height > 0 && top >= 0 && bottom <= innerHeight;
  });

test("the warnings badge and the skip link leave the settings alone", async () => {
  const { page, complaints, close } = await site.open({
    files: smallPhotos,
    // A homography is warned of.
    hash: "#threshold=2.5&withoutDepth=homography&page.photoLimit=1536",
  });
  const settings = async () => [
    await page.inputValue("#option-threshold"),
    await page.inputValue("#photo-limit"),
    new URL(page.url()).hash,
  ];
  const before = await settings();
  assert.deepEqual(before.slice(0, 2), ["2.5", "1536"]);
  await page.locator("#warnings-link").click();
  assert.equal(await page.evaluate(() => document.activeElement?.id), "warnings-title");
  assert.ok(await inView(page, "#warnings-title"));
  await page.waitForTimeout(400);
  assert.deepEqual(await settings(), before);
  await page.locator(".skip-link").focus();
  await page.keyboard.press("Enter");
  assert.equal(await page.evaluate(() => document.activeElement?.id), "results");
  await page.waitForTimeout(400);
  assert.deepEqual(await settings(), before);
  // A fragment that somebody wrote by hand is no settings either.
  await page.evaluate(() => void (location.hash = "#figures"));
  await page.waitForTimeout(400);
  assert.deepEqual((await settings()).slice(0, 2), ["2.5", "1536"]);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("what is wrong with a dropped text file is said in view, at the start and later", async () => {
  const { page, close } = await site.open();
  const notes = written("notes.txt", "no table");
  await drop(page, ".masthead", [notes]);
  await page.locator("#message", { hasText: "notes.txt cannot be used" }).waitFor();
  assert.ok(await inView(page, "#message"));
  await page.setInputFiles("#many-files", smallPhotos);
  await finished(page);
  assert.equal(await page.locator("#message").textContent(), "");
  await drop(page, ".masthead", [notes]);
  await page.locator("#message", { hasText: /notes\.txt cannot be used.*header/ }).waitFor();
  assert.ok(await inView(page, "#message"));
  await close();
});

test("what was ignored among dropped files is still said when the photos are stitched", async () => {
  const { page, close } = await site.open();
  const song = written("song.mp3", "la");
  await drop(page, ".masthead", [...smallPhotos, song]);
  await finished(page);
  assert.match((await page.locator("#message").textContent()) ?? "", /Ignored: song\.mp3/);
  await page.locator("#swap").click();
  await idle(page);
  await close();
});

test("so is what was ignored while photos are stitched, which goes on", async () => {
  const { page, close } = await site.open();
  const matching = statusSays(page, /^Matching/);
  await page.setInputFiles("#many-files", [...smallPhotos, exampleFile("target.jpg")]);
  await matching;
  await page.setInputFiles("#add-files", written("song.mp3", "la"));
  await page.locator("#message", { hasText: "Ignored: song.mp3" }).waitFor();
  assert.doesNotMatch((await page.locator("#status").textContent()) ?? "", /Reading|Detecting/);
  await finished(page);
  assert.match((await page.locator("#message").textContent()) ?? "", /Ignored: song\.mp3/);
  await close();
});

test("nothing is said of a run that starting over ends, or another one", async () => {
  const { page, close } = await site.open();
  for (const ended of ["#clear-inputs", "#swap"]) {
    // In the page: on a fast machine the run is over before it would be heard of here.
    const pressed = page.evaluate(
      (button) =>
        new Promise((resolve) => {
          const [status, message] = ["#status", "#message"].map((id) => document.querySelector(id));
          const heard = () => void (document.body.dataset.heard = message?.textContent ?? "");
          const press = () => {
            if (!/Detecting|Matching|Fitting|Computing/.test(status?.textContent ?? "")) return;
            running.disconnect();
            if (message)
              new MutationObserver(heard).observe(message, { childList: true, subtree: true });
            const pressed = document.querySelector(button);
            if (pressed instanceof HTMLElement) pressed.click();
            resolve(undefined);
          };
          const running = new MutationObserver(press);
          if (status)
            running.observe(status, { childList: true, subtree: true, characterData: true });
        }),
      ended,
    );
    await page.setInputFiles("#many-files", smallPhotos);
    await pressed;
    if (ended === "#swap") await finished(page);
    await page.locator('#run[aria-disabled="false"]').waitFor({ state: "attached" });
    // What was aborted is heard of in the next task.
    await page.waitForTimeout(100);
    assert.doesNotMatch((await page.locator("body").getAttribute("data-heard")) ?? "", /Cancel/);
    assert.doesNotMatch((await page.locator("#status").textContent()) ?? "", /Cancel/);
  }
  await close();
});

test("photos without common points are not told of files of matches", async () => {
  const { page, close } = await site.open();
  const side = { width: 64, height: 64 };
  const blank = await encodePng({ data: new Uint8ClampedArray(64 * 64 * 4).fill(255), ...side });
  await page.setInputFiles("#target-file", written("blank.png", blank));
  await page.setInputFiles("#reference-file", smallFile("reference.jpg"));
  await page.locator("#message", { hasText: "No common points were found" }).waitFor();
  assert.doesNotMatch((await page.locator("#message").textContent()) ?? "", /0 of 0|file/);
  await close();
});

test("the buttons of a thumbnail lie on none of the words beside it", async () => {
  const { page, close } = await site.open();
  const [one = ""] = smallPhotos;
  const [again, broken] = [await readFile(one), "no picture"];
  await page.setInputFiles("#many-files", [
    ...smallPhotos,
    written("the-same.jpg", again),
    written("broken.jpg", broken),
  ]);
  await finished(page);
  const tiles = page.locator(".tile.noted");
  assert.equal(await tiles.count(), 2);
  assert.equal(await tiles.locator(".turn:visible").count(), 1, "what is no photo is not turned");
  const covered = await tiles.evaluateAll((tiles) =>
    tiles.flatMap((tile) => {
      const words = [...tile.querySelectorAll(".words > *")];
      return [...tile.querySelectorAll("button span")].map((sign) => {
        const a = sign.getBoundingClientRect();
        return words.some((word) => {
          const range = document.createRange();
          range.selectNodeContents(word);
          return [...range.getClientRects()].some(
            (b) =>
              a.width > 0 &&
              b.right > a.left &&
              b.left < a.right &&
              b.bottom > a.top &&
              b.top < a.bottom,
          );
        });
      });
    }),
  );
  assert.deepEqual(covered.filter(Boolean), []);
  await close();
});

test("an error of what was pressed far below comes into view", async () => {
  const { page, close } = await site.open({
    files: smallPhotos,
    viewport: { width: 390, height: 700 },
    hasTouch: true,
    isMobile: true,
  });
  await page.route("https://huggingface.co/**", (route) => route.abort());
  await openPanel(page, "depth");
  await page.check('input[name="depth-source"][value="model"]');
  await page.locator("#depth-estimate").click();
  await page.locator("#message", { hasText: /network could not be used/ }).waitFor();
  assert.ok(await inView(page, "#message"));
  await close();
});

test("an error of a network goes when the network is given up", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await page.route("https://huggingface.co/**", (route) => route.abort());
  await openPanel(page, "depth");
  await page.check('input[name="depth-source"][value="model"]');
  await page.locator("#depth-estimate").click();
  await page.locator("#message", { hasText: /network could not be used/ }).waitFor();
  await page.check('input[name="depth-source"][value="photos"]');
  assert.equal(await page.locator("#message").textContent(), "");
  await close();
});

test("a view that is being computed does not show the one before", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await page.locator("#view-caption", { hasText: "mosaic" }).waitFor();
  const drawn = await page.evaluate(async () => {
    const caption = document.querySelector("#view-caption");
    const canvas = document.querySelector("#picture");
    const tab = document.querySelector("#tab-compare");
    if (!caption || !(canvas instanceof HTMLCanvasElement) || !(tab instanceof HTMLElement)) {
      throw new Error("the page is incomplete");
    }
    /** @type {Promise<void>} */
    const computing = new Promise((resolve) => {
      const observer = new MutationObserver(() => {
        if (caption.textContent === "Computing…") resolve(observer.disconnect());
      });
      observer.observe(caption, { childList: true });
    });
    // Until it was looked at no worker hears of it, however fast the machine is.
    const { postMessage } = Worker.prototype;
    /** @type {(() => void)[]} */
    const held = [];
    Worker.prototype.postMessage = function (/** @type {[any, any]} */ ...args) {
      held.push(() => postMessage.apply(this, args));
    };
    tab.click();
    await computing;
    for (let i = 0; i < 2; i++) await new Promise(requestAnimationFrame);
    const context = canvas.getContext("2d");
    const { data } = context?.getImageData(0, 0, canvas.width, canvas.height) ?? {};
    Worker.prototype.postMessage = postMessage;
    for (const post of held) post();
    return data?.some(Boolean);
  });
  assert.equal(drawn, false, "the mosaic is no comparison");
  await page.locator("#view-caption", { hasText: "the other method" }).waitFor();
  await close();
});

test("starting over, the example and another photo in a card can be undone", async () => {
  const { page, complaints, close } = await site.open({ files: smallCase });
  const first = await savedPicture(page);
  const undo = page.getByRole("button", { name: "Undo" });
  const back = () =>
    page.locator("#result-source", { hasText: /^target\.jpg onto reference\.jpg$/ }).waitFor();

  await page.locator("#clear-inputs").click();
  await page.locator("#undo-text", { hasText: "were removed" }).waitFor();
  assert.equal(await page.getAttribute("body", "data-phase"), "start");
  await undo.click();
  await back();
  assert.match((await page.locator("#depth-summary").textContent()) ?? "", /files/);
  assertSame(await savedPicture(page), first);

  await page.locator("#load-sample").click();
  await page.locator("#result-source", { hasText: "of the example" }).waitFor();
  await undo.click();
  await back();
  assertSame(await savedPicture(page), first);

  await page.setInputFiles("#target-file", smallFile("reference.jpg"));
  await page.locator("#undo-text", { hasText: "target.jpg was replaced." }).waitFor();
  await undo.click();
  await back();
  await finished(page);
  assertSame(await savedPicture(page), first);
  assert.deepEqual(await complaints(), []);
  await close();
});

test("what takes no photo's place offers no way back, and settings chosen since are kept", async () => {
  const { page, close } = await site.open({ files: smallPhotos });
  await drop(page, ".masthead", [smallFile("matches.csv")]);
  await page
    .locator('[data-slot="matches"] .file', { hasText: "matches.csv" })
    .waitFor({ state: "attached" });
  await page.waitForTimeout(200);
  assert.equal(await page.locator("#undo-text").textContent(), "");

  await page.locator("#clear-inputs").click();
  await page.evaluate(() => void (location.hash = "#seed=7"));
  await page.locator("#options-summary", { hasText: "1 changed" }).waitFor({ state: "attached" });
  await page.getByRole("button", { name: "Undo" }).click();
  await idle(page);
  await finished(page);
  assert.equal(await page.inputValue("#option-seed"), "7");
  await close();
});

test("a long photo that is reduced to a strip is said to be, and where to change it", async () => {
  const { page, close } = await site.open();
  const data = new Uint8ClampedArray(4 * 9000 * 900).fill(200);
  const long = written("long.png", await encodePng({ data, width: 9000, height: 900 }));
  await page.setInputFiles("#target-file", long);
  await page
    .locator('[data-slot="target"] [data-part="note"]', {
      hasText: /Used at 2048.×.205 only.*under Options/,
    })
    .waitFor();
  await page.setInputFiles("#add-files", smallPhotos);
  await page.locator(".tile .note", { hasText: /Used at 2048.×.205 only/ }).waitFor();
  await close();
});
