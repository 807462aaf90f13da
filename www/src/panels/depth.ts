import { byId, context2d, onClick, setEnabled } from "../dom.js";
import type { DepthModelName } from "../networks/requests.js";
import type { Runner } from "../run/run.js";
import type { DepthSource, State, Store } from "../state.js";
import { paintColourLegend, paintHoleLegend } from "../image-worker/depth-colours.js";
import { radios } from "./radios.js";

const sources: Readonly<Record<DepthSource, string>> = {
  photos: "from the two photos",
  model: "Depth Anything",
  files: "from files",
};

const models: Readonly<Record<DepthModelName, { label: string; hint: string }>> = {
  small: {
    label: "Depth Anything V2 Small",
    hint: "About 27 MB, or 50 MB with a GPU; Apache-2.0 licence.",
  },
  onnx: {
    label: "Custom (ONNX)",
    hint: "One file with an input [1, 3, height, width]. Its host must allow cross-origin requests.",
  },
};

/** Binds the choice of the depth source and its settings. */
export function bindDepth(store: Store, runner: Runner): void {
  bindSource(store);
  bindNetwork(store, runner);
  bindMeaning(store);
}

/** Opens the settings of the depth network, which the user has to start. */
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
    const custom = settings.depthSource === "model" && settings.depthModel === "onnx";
    byId("depth-summary", HTMLElement).textContent = custom
      ? "custom network"
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

  const draw = ({ settings }: State) => {
    const { depthOnnx, depthModel } = settings;
    model.value = depthModel;
    host.value = settings.depthHost;
    address.value = depthOnnx.address;
    colours.value = depthOnnx.colours;
    output.value = depthOnnx.output;
    byId("depth-host-part", HTMLElement).hidden = depthModel === "onnx";
    byId("depth-onnx-part", HTMLElement).hidden = depthModel !== "onnx";
    byId("depth-model-hint", HTMLElement).textContent =
      `${models[depthModel].hint} It is downloaded once and cached by the browser. Your photos are not uploaded.`;
  };
  store.subscribe((state, before) => {
    const { settings, running } = state;
    // Otherwise what is being typed would be lost.
    if (settings !== before.settings) draw(state);
    const { depthModel, depthOnnx } = settings;
    setEnabled(button, !running && (depthModel !== "onnx" || depthOnnx.address !== ""));
  });
  draw(store.state);
}

/** Binds the meaning of depth values from files, and draws the legend. */
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
