import type { Options } from "depthstitch";
import { byId, make } from "./dom.js";

type ChoiceKey = "robustFit" | "warpMode" | "holes" | "fill";
type NumberKey = Exclude<keyof Options, ChoiceKey | "threshold">;

interface NumberField {
  readonly key: NumberKey;
  readonly label: string;
  readonly hint?: string;
  readonly min: number;
  readonly max?: number;
  readonly step: number | "any";
  /** What the shown number is multiplied by: megabytes to bytes, percent to share. */
  readonly unit?: number;
}

/** The choices are keyed by the option's own values, so that none can be forgotten. */
type ChoiceField = {
  [K in ChoiceKey]: {
    readonly key: K;
    readonly label: string;
    readonly choices: Readonly<Record<Options[K], string>>;
  };
}[ChoiceKey];

const robustFit: ChoiceField = {
  key: "robustFit",
  label: "Robust fit",
  choices: { depth: "Depth", homography: "Homography", "multi-homography": "Several homographies" },
};
const warpMode: ChoiceField = {
  key: "warpMode",
  label: "Warp",
  choices: {
    optimal: "Optimal",
    "backward+void": "Backward + voids",
    backward: "Backward",
    forward: "Forward",
  },
};
const holes: ChoiceField = {
  key: "holes",
  label: "Where depth is unknown",
  choices: { nearest: "Nearest known", drop: "Draw nothing" },
};
const fill: ChoiceField = {
  key: "fill",
  label: "Voids in the mosaic",
  choices: { smooth: "Fill smoothly", none: "Leave empty" },
};

const groups: readonly {
  readonly title: string;
  readonly fields: readonly (NumberField | ChoiceField | "threshold")[];
}[] = [
  {
    title: "Geometry",
    fields: [
      robustFit,
      "threshold",
      { key: "maxTrials", label: "Most trials", min: 1, step: 1 },
      { key: "confidence", label: "Confidence", min: 0, max: 1, step: "any" },
      {
        key: "seed",
        label: "Seed",
        hint: "same seed, same result",
        min: 0,
        max: 2 ** 32 - 1,
        step: 1,
      },
    ],
  },
  {
    title: "Warp",
    fields: [
      warpMode,
      holes,
      {
        key: "gridColumns",
        label: "Grid columns",
        hint: "0: one vertex per pixel",
        min: 0,
        step: 1,
      },
      { key: "gridRows", label: "Grid rows", hint: "0: one vertex per pixel", min: 0, step: 1 },
      {
        key: "voidDistance",
        label: "Void distance",
        hint: "% of the diagonal",
        min: 0,
        step: "any",
        unit: 0.01,
      },
      {
        key: "stretchLimit",
        label: "Stretch limit",
        hint: "× the average cell",
        min: 0,
        step: "any",
      },
      {
        key: "canvasLimit",
        label: "Canvas limit",
        hint: "× the reference, each side",
        min: 0,
        step: "any",
      },
    ],
  },
  {
    title: "Mosaic",
    fields: [
      fill,
      { key: "fillRadius", label: "Fill radius", hint: "pixels", min: 0, step: 1 },
      { key: "maxBytes", label: "Memory limit", hint: "MB", min: 1, step: 1, unit: 1e6 },
    ],
  },
];

/** Builds the form; the returned function reads the options that differ from their defaults. */
export function bindOptions(defaults: Readonly<Options>): () => Partial<Options> {
  const form = byId("options", HTMLFormElement);
  const readers: (() => Partial<Options>)[] = [];
  for (const { title, fields } of groups) {
    const fieldset = make("fieldset", {}, make("legend", {}, title));
    for (const field of fields) {
      if (field === "threshold") readers.push(addThreshold(fieldset, defaults.threshold));
      else if ("choices" in field) readers.push(addChoice(fieldset, field, defaults));
      else readers.push(addNumber(fieldset, field, defaults[field.key]));
    }
    form.append(fieldset);
  }
  form.append(make("button", { type: "reset" }, "Reset to defaults"));
  form.addEventListener("submit", (event) => event.preventDefault());
  return () => readers.reduce<Partial<Options>>((all, read) => ({ ...all, ...read() }), {});
}

function addNumber(
  parent: HTMLElement,
  field: NumberField,
  initial: number,
): () => Partial<Options> {
  const { key, unit = 1 } = field;
  const shown = String(Number((initial / unit).toPrecision(12)));
  const attributes = {
    id: `option-${key}`,
    type: "number",
    min: field.min,
    step: field.step,
    value: shown,
  };
  const input = make(
    "input",
    strings(field.max === undefined ? attributes : { ...attributes, max: field.max }),
  );
  parent.append(label(`option-${key}`, field.label, field.hint), input);
  return () => {
    if (input.value === shown) return {};
    // An empty field is not a number: the core refuses it by name, in words.
    return { [key]: input.value === "" ? Number.NaN : input.valueAsNumber * unit };
  };
}

function addChoice(
  parent: HTMLElement,
  { key, label: words, choices }: ChoiceField,
  defaults: Readonly<Options>,
): () => Partial<Options> {
  const select = make("select", { id: `option-${key}` });
  for (const [value, text] of Object.entries(choices)) {
    const initial = value === defaults[key];
    select.append(new Option(text, value, initial, initial));
  }
  parent.append(label(`option-${key}`, words), select);
  return () => (select.value === defaults[key] ? {} : { [key]: select.value });
}

/** A number of pixels, or the paper's own way to say it. */
function addThreshold(parent: HTMLElement, initial: Options["threshold"]): () => Partial<Options> {
  const shown = initial === "paper" ? 3 : initial;
  const input = make(
    "input",
    strings({ id: "option-threshold", type: "number", min: 0, step: "any", value: shown }),
  );
  const paper = make("input", { id: "option-threshold-paper", type: "checkbox" });
  if (initial === "paper") paper.setAttribute("checked", "");
  const sync = () => {
    input.disabled = paper.checked;
  };
  paper.addEventListener("change", sync);
  // The form puts its fields back only after this event.
  byId("options", HTMLFormElement).addEventListener("reset", () => queueMicrotask(sync));
  sync();
  parent.append(
    label("option-threshold", "Threshold", "pixels of the reference"),
    input,
    make("label", { class: "check" }, paper, "as the paper (0.1)"),
  );
  return () => {
    if (paper.checked) return initial === "paper" ? {} : { threshold: "paper" };
    return input.valueAsNumber === initial ? {} : { threshold: input.valueAsNumber };
  };
}

function label(id: string, words: string, hint?: string): HTMLLabelElement {
  return make("label", { for: id }, words, ...(hint ? [make("small", {}, hint)] : []));
}

function strings(values: Readonly<Record<string, string | number>>): Record<string, string> {
  return Object.fromEntries(Object.entries(values).map(([name, value]) => [name, String(value)]));
}
