import { byId, context2d, onClick, setEnabled } from "../dom.js";
import type { DepthModelName } from "../networks/requests.js";
import type { Runner } from "../run/run.js";
import type { DepthSource, State, Store } from "../state.js";
import { paintColourLegend, paintHoleLegend } from "../studio/depth-colours.js";
import { radios } from "./radios.js";

const sources: Readonly<Record<DepthSource, string>> = {
  photos: "from the two photos",
  model: "Depth Anything",
  files: "from files",
};

const models: Readonly<Record<DepthModelName, { label: string; hint: string }>> = {
  small: {
    label: "Small",
    hint: "About 27 MB, or 50 MB with a GPU; free for every use.",
  },
  base: { label: "Base", hint: "About 100 MB, or 200 MB with a GPU; not for commercial use." },
  large: { label: "Large", hint: "About 340 MB, or 670 MB with a GPU; not for commercial use." },
  onnx: {
    label: "Your own (ONNX)",
    hint: "One file; it takes one photo, as [1, 3, height, width], and its host must let this page read it.",
  },
};

/** Binds the choice of where depth comes from, and what belongs to each. */
export function bindDepth(store: Store, runner: Runner): void {
  bindSource(store);
  bindNetwork(store, runner);
  bindMeaning(store);
}

/** Opens the choice of depth at the network, which the user still has to start. */
export function offerNetwork(store: Store): void {
  store.change({ depthSource: "model" });
  byId("depth-panel", HTMLDetailsElement).open = true;
  const button = byId("depth-estimate", HTMLButtonElement);
  button.scrollIntoView({ block: "center" });
  button.focus({ preventScroll: true });
}

function bindSource(store: Store): void {
  radios("depth-source", store, "depthSource");
  store.subscribe(({ settings }) => {
    const own = settings.depthSource === "model" && settings.depthModel === "onnx";
    byId("depth-summary", HTMLElement).textContent = own
      ? "your own network"
      : sources[settings.depthSource];
    byId("depth-model-part", HTMLElement).hidden = settings.depthSource !== "model";
    byId("depth-files-part", HTMLElement).hidden = settings.depthSource !== "files";
  });
}

function bindNetwork(store: Store, runner: Runner): void {
  const model = byId("depth-model", HTMLSelectElement);
  const host = byId("depth-host", HTMLInputElement);
  const button = byId("depth-estimate", HTMLButtonElement);
  for (const [name, { label }] of Object.entries(models)) model.append(new Option(label, name));
  model.addEventListener("change", () =>
    store.change({ depthModel: model.value as DepthModelName }),
  );
  host.placeholder = "https://huggingface.co/";
  host.addEventListener("change", () => store.change({ depthHost: host.value.trim() }));
  onClick(button, () => void runner.stitch());
  const address = byId("depth-onnx-address", HTMLInputElement);
  const colours = byId("depth-onnx-colours", HTMLSelectElement);
  const output = byId("depth-onnx-output", HTMLSelectElement);
  for (const field of [address, colours, output]) {
    field.addEventListener("change", () =>
      store.change({
        depthOnnx: {
          address: address.value.trim(),
          colours: colours.value === "plain" ? "plain" : "imagenet",
          output: output.value === "metric" ? "metric" : "inverse",
        },
      }),
    );
  }

  const draw = ({ settings, running }: State) => {
    model.value = settings.depthModel;
    host.value = settings.depthHost;
    const { depthOnnx, depthModel } = settings;
    address.value = depthOnnx.address;
    colours.value = depthOnnx.colours;
    output.value = depthOnnx.output;
    byId("depth-host-part", HTMLElement).hidden = depthModel === "onnx";
    byId("depth-onnx-part", HTMLElement).hidden = depthModel !== "onnx";
    byId("depth-model-hint", HTMLElement).textContent =
      `${models[settings.depthModel].hint} It is downloaded once and kept by the browser; your photos stay here.`;
    setEnabled(button, !running && (depthModel !== "onnx" || depthOnnx.address !== ""));
  };
  store.subscribe((state, before) => {
    if (state.settings !== before.settings || !state.running !== !before.running) draw(state);
  });
  draw(store.state);
}

/** What the values of depth maps from files mean, and how they are coloured. */
function bindMeaning(store: Store): void {
  const kinds = [...document.querySelectorAll<HTMLInputElement>('input[name="depth-kind"]')];
  const invalid = byId("depth-invalid", HTMLInputElement);
  put(byId("depth-legend", HTMLCanvasElement), paintColourLegend(64));
  put(byId("hole-legend", HTMLCanvasElement), paintHoleLegend(18, 10));

  const read = () => {
    const kind = kinds.find((choice) => choice.checked)?.value === "metric" ? "metric" : "inverse";
    const value = invalid.valueAsNumber;
    store.change({ depth: { kind, invalid: Number.isNaN(value) ? null : value } });
  };
  for (const choice of kinds) choice.addEventListener("change", read);
  invalid.addEventListener("change", read);

  store.subscribe(({ settings: { depth } }, before) => {
    if (depth === before.settings.depth) return;
    for (const choice of kinds) choice.checked = choice.value === depth.kind;
    invalid.value = depth.invalid === null ? "" : String(depth.invalid);
  });
}

function put(canvas: HTMLCanvasElement, image: ImageData): void {
  canvas.width = image.width;
  canvas.height = image.height;
  context2d(canvas).putImageData(image, 0, 0);
}
