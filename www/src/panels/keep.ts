import { byId, onClick, setEnabled } from "../dom.js";
import type { Outcome, Store } from "../state.js";
import { studio } from "../studio/client.js";
import type { Format, Rect } from "../studio/encode.js";
import type { Rgba } from "../studio/paint.js";
import { reportJson } from "../words/report.js";
import { linkOf } from "../settings-link.js";
import { saveBlob } from "./download.js";

const buttons = ["download-mosaic", "download-warped", "download-report"] as const;

/** Binds what can be kept: the picture, the warped photo, the report, a link to the settings. */
export function bindKeep(store: Store, version: string): void {
  const format = byId("save-format", HTMLSelectElement);
  const crop = byId("save-crop", HTMLSelectElement);
  const said = byId("keep-said", HTMLElement);
  store.subscribe(({ outcome }, before) => {
    if (outcome === before.outcome) return;
    said.textContent = "";
    for (const id of buttons) setEnabled(byId(id, HTMLButtonElement), outcome !== null);
  });

  const savePicture = async (image: Rgba, part: Rect, name: string) => {
    const type: Format = format.value === "png" ? "png" : "jpeg";
    const { data, width, height } = image;
    const blob = await studio("encode", { data, width, height }, part, type);
    saveBlob(blob, `${name}.${type === "png" ? "png" : "jpg"}`);
    said.textContent = `Saved ${name}, ${part.width} × ${part.height} pixels.`;
  };
  const onSave = (id: (typeof buttons)[number], save: (outcome: Outcome) => unknown) => {
    onClick(byId(id, HTMLButtonElement), () => {
      const { outcome } = store.state;
      if (!outcome) return;
      Promise.resolve(save(outcome)).catch((error: unknown) => {
        const reason = error instanceof Error ? error.message : String(error);
        said.textContent = `Not saved: ${reason}`;
      });
    });
  };
  onSave("download-mosaic", (outcome) => {
    const part =
      crop.value === "inner"
        ? (outcome.result.crop.inner ?? whole(outcome.mosaic))
        : whole(outcome.mosaic);
    return savePicture(outcome.mosaic, part, "stitched");
  });
  onSave("download-warped", ({ result: { warped } }) =>
    savePicture(warped, whole(warped), "warped"),
  );
  onSave("download-report", (outcome) => {
    saveBlob(new Blob([reportJson(outcome, version)], { type: "application/json" }), "report.json");
  });
  onClick(byId("copy-link", HTMLButtonElement), () => {
    const link = new URL(`#${linkOf(store.state.settings)}`, location.href);
    navigator.clipboard.writeText(link.href).then(
      () =>
        void (said.textContent = "The link is copied. It carries the settings, not the photos."),
      () =>
        void (said.textContent = "The address of this page carries the settings: copy it there."),
    );
  });
}

function whole({ width, height }: Rgba): Rect {
  return { x: 0, y: 0, width, height };
}
