import { make } from "../dom.js";

/** A labelled check box, with a colour swatch if `swatch` is a class. */
export function checkbox(
  text: string,
  checked: boolean,
  onChange: (checked: boolean) => void,
  swatch = "",
): HTMLElement {
  const input = make("input", { type: "checkbox" });
  input.checked = checked;
  input.addEventListener("change", () => onChange(input.checked));
  const sign = swatch ? [make("i", { class: swatch })] : [];
  return make("label", { class: "check" }, input, ...sign, text);
}

/**
 * A labelled selection, of nothing if `value` is no choice. If `onChange` fails, which it reports itself, the selection goes
 * back to what is shown.
 */
export function selection(
  text: string,
  choices: Readonly<Record<string, string>>,
  value: string,
  onChange: (value: string) => Promise<void>,
): HTMLElement {
  const select = make("select");
  for (const [id, name] of Object.entries(choices)) select.append(new Option(name, id));
  select.value = value;
  let shown = value;
  select.addEventListener("change", () => {
    const chosen = select.value;
    onChange(chosen).then(
      () => (shown = chosen),
      () => {
        // Another one may have been chosen meanwhile.
        if (select.value === chosen) select.value = shown;
      },
    );
  });
  return make("label", { class: "inline" }, `${text} `, select);
}

/** A legend of colour swatches. */
export function legend(...entries: readonly (readonly [string, string])[]): HTMLElement {
  return make(
    "ul",
    { class: "swatches" },
    ...entries.map(([swatch, text]) => make("li", {}, make("i", { class: swatch }), text)),
  );
}

/** A legend of a colour scale. */
export function scale(colours: string, least: string, most: string): HTMLElement {
  return make("p", { class: "scale" }, least, make("i", { class: colours }), most);
}
