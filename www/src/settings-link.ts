import type { Options } from "depthstitch";
import { OPTION_LIST, type OptionSpec } from "depthstitch/options";
import { defaultSettings, type Settings, type Store } from "./state.js";

/** Prefix of settings of the page; all others are options of the core. */
const pagePrefix = "page.";

/** Milliseconds after the last change until the URL is updated. */
const addressDelay = 300;

/** Stores the settings in the fragment of the page's URL and reads them from it, except for files and networks. */
export function bindSettingsLink(store: Store): void {
  const read = () => store.set({ settings: settingsOf(location.hash) });
  if (hasSettings(location.hash)) read();
  window.addEventListener("hashchange", () => {
    const { hash } = location;
    if (hash.length > 1 && !hasSettings(hash)) return;
    if (linkOf(store.state.settings) !== hash.slice(1)) read();
  });
  bindPlaces();
  let waiting = 0;
  store.subscribe(({ settings }, before) => {
    if (settings === before.settings) return;
    clearTimeout(waiting);
    // Changing the URL can be slow in some browsers, so it is deferred.
    waiting = window.setTimeout(() => {
      const link = linkOf(store.state.settings);
      if (link === location.hash.slice(1)) return;
      history.replaceState(null, "", link ? `#${link}` : location.pathname + location.search);
    }, addressDelay);
  });
}

/** Whether a fragment holds settings rather than the name of a place in the page. */
function hasSettings(hash: string): boolean {
  return hash.includes("=");
}

/** Links to places in the page go there without a fragment, which belongs to the settings. */
function bindPlaces(): void {
  document.addEventListener("click", (event) => {
    const link = event.target instanceof Element ? event.target.closest('a[href^="#"]') : null;
    const place = link && document.getElementById(link.getAttribute("href")?.slice(1) ?? "");
    if (!place) return;
    event.preventDefault();
    place.scrollIntoView({ block: "start" });
    place.focus({ preventScroll: true });
  });
}

/** The settings that differ from their defaults, as a URL fragment. */
export function linkOf({ options, depth, photoLimit }: Settings): string {
  const defaults = defaultSettings;
  const parameters = new URLSearchParams();
  const add = (key: string, value: unknown, standard: unknown) => {
    if (value !== standard) parameters.set(pagePrefix + key, String(value));
  };
  add("photoLimit", photoLimit, defaults.photoLimit);
  add("depthKind", depth.kind, defaults.depth.kind);
  add("depthInvalid", depth.invalid, defaults.depth.invalid);
  for (const [key, value] of Object.entries(options)) parameters.set(key, String(value));
  return parameters.toString();
}

/**
 * Reads settings from a URL fragment. Unknown names and values of the wrong type are ignored; ranges are checked by the
 * core. Whether networks are used, and where they come from, is not part of it: opening a link must not cause requests to
 * other hosts.
 */
export function settingsOf(hash: string): Settings {
  const parameters = new URLSearchParams(hash.replace(/^#/, ""));
  const page = (key: string) => parameters.get(pagePrefix + key);
  const limit = Number(page("photoLimit") ?? defaultSettings.photoLimit);
  const invalid = page("depthInvalid");
  return {
    ...defaultSettings,
    photoLimit: Number.isInteger(limit) && limit >= 0 ? limit : defaultSettings.photoLimit,
    depth: {
      kind: page("depthKind") === "metric" ? "metric" : defaultSettings.depth.kind,
      invalid: invalid !== null && Number.isFinite(Number(invalid)) ? Number(invalid) : null,
    },
    options: optionsOf(parameters),
  };
}

function optionsOf(parameters: URLSearchParams): Partial<Options> {
  const entries = OPTION_LIST.flatMap(([name, spec]) => {
    const text = parameters.get(name);
    const value = text === null ? undefined : parseOption(spec, text);
    return value === undefined ? [] : [[name, value] as const];
  });
  return Object.fromEntries(entries);
}

function parseOption(spec: OptionSpec, text: string): string | number | boolean | undefined {
  switch (spec.type) {
    case "boolean":
      return text === "true" ? true : text === "false" ? false : undefined;
    case "choice":
      return Object.hasOwn(spec.choices, text) ? text : undefined;
    default:
      if (text === spec.keyword) return text;
      return text.trim() === "" || Number.isNaN(Number(text)) ? undefined : Number(text);
  }
}
