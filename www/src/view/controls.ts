import { make } from "../dom.js";

/** A check box with its label and, where it stands for something in the picture, that thing's swatch. */
export function checkbox(
  words: string,
  checked: boolean,
  onChange: (checked: boolean) => void,
  swatch = "",
): HTMLElement {
  const input = make("input", { type: "checkbox" });
  input.checked = checked;
  input.addEventListener("change", () => onChange(input.checked));
  const sign = swatch ? [make("i", { class: swatch })] : [];
  return make("label", { class: "check" }, input, ...sign, words);
}

/** A choice with its label. */
export function selection(
  words: string,
  choices: Readonly<Record<string, string>>,
  value: string,
  onChange: (value: string) => void,
): HTMLElement {
  const select = make("select");
  for (const [id, text] of Object.entries(choices)) {
    select.append(new Option(text, id, id === value, id === value));
  }
  select.addEventListener("change", () => onChange(select.value));
  return make("label", { class: "inline" }, `${words} `, select);
}

/** What the swatches of a picture mean. */
export function legend(...entries: readonly (readonly [string, string])[]): HTMLElement {
  return make(
    "ul",
    { class: "swatches" },
    ...entries.map(([swatch, words]) => make("li", {}, make("i", { class: swatch }), words)),
  );
}

/** What the colours of a picture mean from one end to the other. */
export function scale(colours: string, least: string, most: string): HTMLElement {
  return make("p", { class: "scale" }, least, make("i", { class: colours }), most);
}
