import { defaultOptions, type Options } from "depthstitch";
import {
  OPTION_LIST,
  type BooleanOption,
  type ChoiceOption,
  type NumberOption,
  type OptionGroup,
  type OptionName,
  type OptionSpec,
} from "depthstitch/options";
import { byId, make } from "../dom.js";
import type { Store } from "../state.js";
import { count } from "../text/numbers.js";

/** A control of one option. */
export interface Control {
  write(options: Readonly<Partial<Options>>): void;
  /** The option if it differs from the defaults. */
  read(defaults: Readonly<Partial<Options>>): Partial<Options>;
}

/** Every group, so that no option of the table is missing from the form. */
const groupTitles: Readonly<Record<OptionGroup, string>> = {
  preset: "Method",
  matching: "Matching",
  geometry: "Geometry",
  warping: "Depth and warp",
  compositing: "Compositing",
};

/** Units of the form that differ from those of the core: the number shown is multiplied by `factor`. */
const displayUnits: { readonly [K in OptionName]?: { unit: string; factor: number } } = {
  voidDistance: { unit: "% of the diagonal", factor: 0.01 },
  maxBytes: { unit: "MB", factor: 1e6 },
};

/** Builds the form and binds it to the options in the settings, which hold only values that differ from the defaults. */
export function bindOptions(store: Store, initialDefaults: Readonly<Options>): void {
  const form = byId("options", HTMLFormElement);
  const summary = byId("options-summary", HTMLElement);
  const controls = buildForm(form);
  let defaults = initialDefaults;

  const draw = async ({ options }: { readonly options: Partial<Options> }) => {
    const { mode = "default" } = options;
    if (mode !== defaults.mode) defaults = await defaultOptions(mode).catch(() => defaults);
    if (store.state.settings.options !== options) return;
    for (const control of controls) control.write({ ...defaults, ...options });
    const changed = Object.keys(options).length;
    summary.textContent = changed === 0 ? "all defaults" : count(changed, "changed", "changed");
  };
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", (event) => {
    event.preventDefault();
    store.change({ options: {} });
  });
  form.addEventListener("change", () => {
    const read = controls.reduce<Partial<Options>>(
      (all, control) => ({ ...all, ...control.read(defaults) }),
      {},
    );
    // The other mode has other defaults, so changing it resets all options.
    const { mode } = read;
    const rest = (mode ?? "default") === defaults.mode ? read : {};
    store.change({ options: mode === "paper" ? { ...rest, mode } : without(rest, "mode") });
  });
  store.subscribe(({ settings }, before) => {
    if (settings.options !== before.settings.options || summary.textContent === "") {
      void draw(settings);
    }
  });
}

function buildForm(form: HTMLFormElement): Control[] {
  const fieldset = (title: string, group: OptionGroup, controls: Control[]) => {
    const parent = make("fieldset", {}, make("legend", { class: "visually-hidden" }, title));
    for (const [name, spec] of OPTION_LIST) {
      if (spec.group === group) controls.push(makeControl(parent, name, spec));
    }
    return parent;
  };
  const controls: Control[] = [];
  for (const [group, title] of Object.entries(groupTitles) as [OptionGroup, string][]) {
    const fields = fieldset(title, group, controls);
    if (group === "preset") form.append(fields);
    else form.append(make("details", {}, make("summary", {}, title), fields));
  }
  form.append(make("button", { type: "reset" }, "Reset to defaults"));
  return controls;
}

export function without(options: Partial<Options>, key: keyof Options): Partial<Options> {
  const out = { ...options };
  delete out[key];
  return out;
}

/** The control of an option, appended to `parent`. The ids of its elements begin with `prefix`. */
export function makeControl(
  parent: HTMLElement,
  name: OptionName,
  spec: OptionSpec,
  prefix = "option-",
): Control {
  const id = prefix + name;
  switch (spec.type) {
    case "boolean":
      return checkboxControl(parent, name, spec, id);
    case "choice":
      return choiceControl(parent, name, spec, id);
    default:
      return spec.keyword === undefined
        ? numberControl(parent, name, spec, id)
        : keywordControl(parent, name, spec, spec.keyword, id);
  }
}

/** A control whose value is read and written by functions of its element. */
function control(
  name: OptionName,
  write: (value: unknown) => void,
  read: () => unknown,
  isDefault = (value: unknown, standard: unknown) => value === standard,
): Control {
  return {
    write: (options) => write(options[name]),
    read: (defaults) => {
      const value = read();
      return isDefault(value, defaults[name]) ? {} : { [name]: value };
    },
  };
}

function numberInput(name: OptionName, spec: NumberOption, id: string): HTMLInputElement {
  const { factor = 1 } = displayUnits[name] ?? {};
  const step = spec.type === "integer" && factor === 1 ? "1" : "any";
  const input = make("input", { id, type: "number", step });
  input.min = String(spec.min / factor);
  if (spec.max !== undefined) input.max = String(spec.max / factor);
  input.title = spec.description;
  return input;
}

function numberControl(
  parent: HTMLElement,
  name: OptionName,
  spec: NumberOption,
  id: string,
): Control {
  const { factor = 1, unit = spec.unit } = displayUnits[name] ?? {};
  const input = numberInput(name, spec, id);
  parent.append(label(input.id, spec, unit), input);
  const shown = (value: unknown) => String(Number((Number(value) / factor).toPrecision(12)));
  return control(
    name,
    (value) => void (input.value = shown(value)),
    // An empty field is not a number, which the core rejects with a message.
    () => (input.value === "" ? Number.NaN : input.valueAsNumber * factor),
    (value, standard) => shown(value) === shown(standard),
  );
}

/** A number or a keyword in its place. */
function keywordControl(
  parent: HTMLElement,
  name: OptionName,
  spec: NumberOption,
  keyword: string,
  id: string,
): Control {
  const input = numberInput(name, spec, id);
  const box = make("input", { id: `${id}-${keyword}`, type: "checkbox" });
  box.addEventListener("change", () => {
    input.disabled = box.checked;
  });
  const words = make("label", { class: "check" }, box, `as in the ${keyword}`);
  parent.append(label(input.id, spec, spec.unit), input, words);
  return control(
    name,
    (value) => {
      box.checked = input.disabled = value === keyword;
      input.value = String(value === keyword ? spec.default : value);
    },
    () => (box.checked ? keyword : input.valueAsNumber),
  );
}

function choiceControl(
  parent: HTMLElement,
  name: OptionName,
  spec: ChoiceOption,
  id: string,
): Control {
  const select = make("select", { id });
  for (const [value, text] of Object.entries(spec.choices)) select.append(new Option(text, value));
  select.title = spec.description;
  parent.append(label(select.id, spec), select);
  return control(
    name,
    (value) => void (select.value = String(value)),
    () => select.value,
    // The mode selects the defaults, so it is always read.
    (value, standard) => name !== "mode" && value === standard,
  );
}

function checkboxControl(
  parent: HTMLElement,
  name: OptionName,
  spec: BooleanOption,
  id: string,
): Control {
  const input = make("input", { id, type: "checkbox" });
  const words = make("label", { class: "check" }, input, spec.label);
  words.title = spec.description;
  parent.append(words);
  return control(
    name,
    (value) => void (input.checked = value === true),
    () => input.checked,
  );
}

function label(id: string, spec: OptionSpec, unit?: string): HTMLLabelElement {
  return make("label", { for: id }, spec.label, ...(unit ? [make("small", {}, unit)] : []));
}
