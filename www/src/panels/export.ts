import type { Held, Rect, Rgba, Size } from "../image-worker/contents.js";
import { byId, onClick, setEnabled } from "../dom.js";
import { manyReportJson } from "../many/report-text.js";
import { coloursOf, type ManyOutcome, type Outcome, type Store } from "../state.js";
import { imageTask } from "../image-worker/client.js";
import type { Format } from "../image-worker/encode.js";
import { reportJson } from "../text/report.js";
import { linkOf } from "../settings-link.js";
import { baseName } from "../text/file-names.js";
import { saveBlob } from "./download.js";
import { savedPart } from "./save-size.js";
import { messageOf } from "../message-of.js";

const buttons = [
  "download-mosaic",
  "copy-mosaic",
  "share-mosaic",
  "download-warped",
  "download-report",
] as const;

/** Binds the export of the mosaic, the warped photo, the report, and a link to the settings. */
export function bindExport(store: Store, version: string): void {
  const format = byId("save-format", HTMLSelectElement);
  const crop = byId("save-crop", HTMLSelectElement);
  const status = byId("export-status", HTMLElement);
  const enable = (enabled: boolean) => {
    for (const id of buttons) setEnabled(byId(id, HTMLButtonElement), enabled);
  };
  // Of what is said afterwards, only what belongs to the last click on the present result counts.
  let latest = 0;
  store.subscribe(({ outcome }, before) => {
    if (outcome === before.outcome) return;
    latest++;
    status.textContent = "";
    enable(outcome !== null);
  });

  const chosenFormat = (): Format => (format.value === "png" ? "png" : "jpeg");
  const encoded = (
    outcome: Outcome | ManyOutcome,
    image: Held<Rgba>,
    part: Rect,
    type: Format,
    source: File | null = null,
  ) => imageTask("encode", image, part, type, coloursOf(outcome), source);
  const saveImage = async (
    outcome: Outcome | ManyOutcome,
    image: Held<Rgba>,
    part: Rect,
    name: string,
    source: File | null,
  ) => {
    const type = chosenFormat();
    const blob = await encoded(outcome, image, part, type, source);
    saveBlob(blob, `${name}.${type === "png" ? "png" : "jpg"}`);
    return `Saved ${name}, ${part.width} × ${part.height} pixels.`;
  };
  /** `save` gives what is said afterwards; it calls `ready` if others may be pressed before that. */
  const onSave = (
    id: (typeof buttons)[number],
    save: (outcome: Outcome | ManyOutcome, ready: () => void) => string | Promise<string>,
  ) => {
    onClick(byId(id, HTMLButtonElement), () => {
      const { outcome } = store.state;
      if (!outcome) return;
      const own = ++latest;
      const say = (words: string) => {
        if (own !== latest) return;
        status.textContent = words;
        enable(true);
      };
      status.textContent = "Preparing…";
      enable(false);
      const saved = async () => save(outcome, () => say(""));
      void saved()
        .catch((error: unknown) => `That did not work: ${messageOf(error)}`)
        .then(say);
    });
  };
  onSave("download-mosaic", async (outcome) => {
    const part = savedPart(outcome, crop.value);
    const name = `${baseName(outcome)}-stitched`;
    const words = await saveImage(outcome, outcome.mosaic, part, name, referenceFile(outcome));
    store.set({ saved: outcome });
    return words;
  });
  onSave("copy-mosaic", async (outcome) => {
    // Without HTTPS there is no clipboard.
    if (!("ClipboardItem" in window)) return "This browser cannot copy it here. Save it instead.";
    const part = savedPart(outcome, crop.value);
    // It takes PNG only. The promise is passed on, as Safari forgets the click while it waits.
    const png = encoded(outcome, outcome.mosaic, part, "png");
    await navigator.clipboard.write([new ClipboardItem({ "image/png": png })]);
    store.set({ saved: outcome });
    return `Copied, ${part.width} × ${part.height} pixels.`;
  });
  onSave("share-mosaic", async (outcome, ready) => {
    const type = chosenFormat();
    // Without camera data: they may say where the photos were taken.
    const blob = await encoded(outcome, outcome.mosaic, savedPart(outcome, crop.value), type);
    const name = `${baseName(outcome)}-stitched.${type === "png" ? "png" : "jpg"}`;
    // Some browsers never say that their list of targets was closed.
    ready();
    try {
      await navigator.share({ files: [new File([blob], name, { type: blob.type })] });
      store.set({ saved: outcome });
    } catch (error) {
      // Whoever closes the list of targets does not want to hear about it.
      if (!(error instanceof DOMException && error.name === "AbortError")) throw error;
    }
    return "";
  });
  byId("share-mosaic", HTMLButtonElement).hidden = !canShare();
  onSave("download-warped", (outcome) => {
    if (outcome.kind !== "pair") return "";
    const { warped } = outcome.result;
    const source = outcome.slots.target?.file ?? null;
    return saveImage(outcome, warped, whole(warped), `${baseName(outcome)}-aligned`, source);
  });
  onSave("download-report", (outcome) => {
    const json =
      outcome.kind === "many" ? manyReportJson(outcome, version) : reportJson(outcome, version);
    const name = `${baseName(outcome)}-report.json`;
    saveBlob(new Blob([json], { type: "application/json" }), name);
    return `Saved ${name}.`;
  });
  onClick(byId("copy-link", HTMLButtonElement), () => {
    const link = new URL(`#${linkOf(store.state.settings)}`, location.href);
    const copied = async (): Promise<void> => navigator.clipboard.writeText(link.href);
    copied().then(
      () => void (status.textContent = "Link copied. It contains the settings, not the photos."),
      () =>
        void (status.textContent = "Copy the URL of this page instead: it contains the settings."),
    );
  });
}

/** The file of the photo in whose view the result is. */
function referenceFile(outcome: Outcome | ManyOutcome): File | null {
  if (outcome.kind === "pair") return outcome.slots.reference?.file ?? null;
  return outcome.photos[outcome.result.reference]?.file ?? null;
}

/** Whether the browser can pass pictures to other programs; those of desktops mostly cannot. */
function canShare(): boolean {
  const sample = new File([], "sample.jpg", { type: "image/jpeg" });
  return "canShare" in navigator && navigator.canShare({ files: [sample] });
}

function whole({ width, height }: Size): Rect {
  return { x: 0, y: 0, width, height };
}
