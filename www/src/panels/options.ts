import { defaultOptions, type Options } from "depthstitch";
import { byId, make } from "../dom.js";
import type { Store } from "../state.js";
import { count } from "../words/numbers.js";
import {
  groups,
  modeField,
  type ChoiceField,
  type Field,
  type FlagField,
  type NumberField,
} from "./option-fields.js";

/** A control: how it shows an option, and what it says of it; nothing where it says what is usual. */
interface Control {
  write(options: Readonly<Options>, usual: Readonly<Options>): void;
  read(usual: Readonly<Options>): Partial<Options>;
}

/** Builds the form and binds it to the settings' options, which hold only what is not usual in their mode. */
export function bindOptions(store: Store, defaults: Readonly<Options>): void {
  const form = byId("options", HTMLFormElement);
  const summary = byId("options-summary", HTMLElement);
  const controls: Control[] = [];
  let usual = defaults;
  const add = (parent: HTMLElement, field: Field) => void controls.push(makeControl(parent, field));

  const top = make("fieldset", {}, make("legend", { class: "visually-hidden" }, "Method"));
  add(top, modeField);
  form.append(top);
  for (const { title, fields } of groups) {
    const fieldset = make("fieldset", {}, make("legend", { class: "visually-hidden" }, title));
    for (const field of fields) add(fieldset, field);
    form.append(make("details", {}, make("summary", {}, title), fieldset));
  }
  form.append(make("button", { type: "reset" }, "Reset to defaults"));

  const draw = async ({ options }: { readonly options: Partial<Options> }) => {
    const { mode = "default" } = options;
    if (mode !== usual.mode) usual = await defaultOptions(mode).catch(() => usual);
    if (store.state.settings.options !== options) return;
    for (const control of controls) control.write({ ...usual, ...options }, usual);
    const changed = Object.keys(options).length;
    summary.textContent =
      changed === 0 ? "all at their defaults" : count(changed, "changed", "changed");
  };
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", (event) => {
    event.preventDefault();
    store.change({ options: {} });
  });
  form.addEventListener("change", () => {
    const read = controls.reduce<Partial<Options>>(
      (all, control) => ({ ...all, ...control.read(usual) }),
      {},
    );
    // In another mode other values are usual, so what was chosen in the old one is dropped.
    const { mode } = read;
    const changed = (mode ?? "default") !== usual.mode;
    const rest = changed ? {} : read;
    store.change({ options: mode === "paper" ? { ...rest, mode } : without(rest, "mode") });
  });
  store.subscribe(({ settings }, before) => {
    if (settings.options !== before.settings.options || summary.textContent === "") {
      void draw(settings);
    }
  });
}

function without(options: Partial<Options>, key: keyof Options): Partial<Options> {
  const out = { ...options };
  delete out[key];
  return out;
}

function makeControl(parent: HTMLElement, field: Field): Control {
  if (field === "threshold") return threshold(parent);
  if ("flag" in field) return flag(parent, field);
  return "choices" in field ? choice(parent, field) : number(parent, field);
}

function number(parent: HTMLElement, field: NumberField): Control {
  const { key, min, max, step, unit = 1 } = field;
  const input = make("input", { id: `option-${key}`, type: "number" });
  input.min = String(min);
  input.step = String(step);
  if (max !== undefined) input.max = String(max);
  parent.append(label(input.id, field.label, field.hint), input);
  const shown = (value: number) => String(Number((value / unit).toPrecision(12)));
  return {
    write: (options) => void (input.value = shown(options[key])),
    read(usual) {
      if (input.value === shown(usual[key])) return {};
      // An empty field is not a number: the core refuses it by name, in words.
      return { [key]: input.value === "" ? Number.NaN : input.valueAsNumber * unit };
    },
  };
}

function choice(parent: HTMLElement, { key, label: words, choices }: ChoiceField): Control {
  const select = make("select", { id: `option-${key}` });
  for (const [value, text] of Object.entries(choices)) select.append(new Option(text, value));
  parent.append(label(select.id, words), select);
  return {
    write: (options) => void (select.value = options[key]),
    // The usual mode goes by the name of the one that is in force: it is always told.
    read: (usual) => (select.value === usual[key] && key !== "mode" ? {} : { [key]: select.value }),
  };
}

function flag(parent: HTMLElement, { flag: key, label: words }: FlagField): Control {
  const input = make("input", { id: `option-${key}`, type: "checkbox" });
  parent.append(make("label", { class: "check" }, input, words));
  return {
    write: (options) => void (input.checked = options[key]),
    read: (usual) => (input.checked === usual[key] ? {} : { [key]: input.checked }),
  };
}

/** A number of pixels, or the paper's own way to say it. */
function threshold(parent: HTMLElement): Control {
  const input = make("input", { id: "option-threshold", type: "number", min: "0", step: "any" });
  const paper = make("input", { id: "option-threshold-paper", type: "checkbox" });
  paper.addEventListener("change", () => {
    input.disabled = paper.checked;
  });
  parent.append(
    label(input.id, "Threshold", "px of the second photo"),
    input,
    make("label", { class: "check" }, paper, "as the paper (0.1)"),
  );
  return {
    write({ threshold: value }) {
      paper.checked = input.disabled = value === "paper";
      input.value = value === "paper" ? "3" : String(value);
    },
    read({ threshold: usual }) {
      const value = paper.checked ? "paper" : input.valueAsNumber;
      return value === usual ? {} : { threshold: value };
    },
  };
}

function label(id: string, words: string, hint?: string): HTMLLabelElement {
  return make("label", { for: id }, words, ...(hint ? [make("small", {}, hint)] : []));
}
