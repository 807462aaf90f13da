import type { Options } from "depthstitch";
import { defaultSettings, type Settings, type Store } from "./state.js";

/** Prefix of a setting that belongs to the page; all others are options of the core. */
const own = "page.";

/** Milliseconds after the last change until the address follows. */
const addressDelay = 300;

/** Keeps the settings in the page's address, and takes them from it. Files and networks stay out of it. */
export function bindSettingsLink(store: Store, defaults: Readonly<Options>): void {
  const read = () => store.set({ settings: settingsOf(location.hash, defaults) });
  if (location.hash.length > 1) read();
  window.addEventListener("hashchange", () => {
    if (linkOf(store.state.settings) !== location.hash.slice(1)) read();
  });
  let waiting = 0;
  store.subscribe(({ settings }, before) => {
    if (settings === before.settings) return;
    clearTimeout(waiting);
    // The browser may take its time for a new address, so it is not given one in the midst of something else.
    waiting = window.setTimeout(() => {
      const link = linkOf(store.state.settings);
      if (link === location.hash.slice(1)) return;
      history.replaceState(null, "", link ? `#${link}` : location.pathname + location.search);
    }, addressDelay);
  });
}

/** The settings that differ from their defaults, as they stand in an address. */
export function linkOf({ options, depth, photoLimit, depthModel }: Settings): string {
  const { depth: usualDepth, ...usual } = defaultSettings;
  const words = new URLSearchParams();
  const add = (key: string, value: unknown, unless: unknown) => {
    if (value !== unless) words.set(own + key, String(value));
  };
  add("photoLimit", photoLimit, usual.photoLimit);
  if (depthModel !== "onnx") add("depthModel", depthModel, usual.depthModel);
  add("depthKind", depth.kind, usualDepth.kind);
  add("depthInvalid", depth.invalid, usualDepth.invalid);
  for (const [key, value] of Object.entries(options)) words.set(key, String(value));
  return words.toString();
}

/**
 * The settings in an address. What is unknown or of another kind is left out; the core checks ranges. Opening a link must
 * never fetch anything from elsewhere, so the use of networks and their addresses are not among them.
 */
export function settingsOf(hash: string, defaults: Readonly<Options>): Settings {
  const words = new URLSearchParams(hash.replace(/^#/, ""));
  const oneOf = <T extends string>(key: string, usual: T, ...others: readonly T[]): T => {
    const word = words.get(own + key);
    return others.find((other) => other === word) ?? usual;
  };
  const limit = Number(words.get(`${own}photoLimit`) ?? defaultSettings.photoLimit);
  const invalid = words.get(`${own}depthInvalid`);
  return {
    ...defaultSettings,
    photoLimit: Number.isInteger(limit) && limit >= 0 ? limit : defaultSettings.photoLimit,
    depthModel: oneOf("depthModel", defaultSettings.depthModel, "base", "large"),
    depth: {
      kind: oneOf("depthKind", defaultSettings.depth.kind, "metric"),
      invalid: invalid !== null && Number.isFinite(Number(invalid)) ? Number(invalid) : null,
    },
    options: optionsOf(words, defaults),
  };
}

function optionsOf(words: URLSearchParams, defaults: Readonly<Options>): Partial<Options> {
  const entries = [...words].flatMap(([key, word]): [string, unknown][] => {
    if (!(key in defaults)) return [];
    const usual = defaults[key as keyof Options];
    if (typeof usual === "boolean") return [[key, word === "true"]];
    if (typeof usual === "string") return [[key, word]];
    // A threshold may also be a word.
    return [[key, Number.isNaN(Number(word)) ? word : Number(word)]];
  });
  return Object.fromEntries(entries);
}
