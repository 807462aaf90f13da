import { OPTION_LIST } from "depthstitch/options";
import { byId } from "../dom.js";
import { makeControl, without } from "../panels/options.js";
import type { Runner } from "../run/run.js";
import type { Settings, Store } from "../state.js";
import { isReading, usablePhotos } from "./photo-set.js";
import type { SetLoader } from "./set-loader.js";

/** Options that are offered beside the photos as well, if the core has them. */
const beside: ReadonlySet<string> = new Set(["projection"]);

/** Binds the choice of the reference, and of the options that belong beside the photos. */
export function bindSetSettings(store: Store, loader: SetLoader, runner: Runner): void {
  bindReference(store, loader);
  const place = byId("set-options", HTMLElement);
  for (const [name, spec] of OPTION_LIST) {
    if (!beside.has(name)) continue;
    const control = makeControl(place, name, spec, "set-option-");
    const standard = ({ options }: Settings) => ({
      [name]: (options.mode === "paper" ? spec.paper : undefined) ?? spec.default,
    });
    place.addEventListener("change", () => {
      const { settings } = store.state;
      const options = { ...without(settings.options, name), ...control.read(standard(settings)) };
      store.change({ options });
      // As with the reference beside it.
      void runner.stitchAutomatically();
    });
    store.subscribe(({ settings }) =>
      control.write({ ...standard(settings), ...settings.options }),
    );
  }
}

function bindReference(store: Store, loader: SetLoader): void {
  const select = byId("set-reference", HTMLSelectElement);
  select.addEventListener("change", () =>
    loader.chooseReference(select.value === "" ? null : Number(select.value)),
  );
  const hint = byId("set-count", HTMLElement);
  store.subscribe(({ set, outcome, settings }, before) => {
    if (!set || (set === before.set && outcome === before.outcome)) return;
    const usable = usablePhotos(set);
    const entries = usable.map((photo) => {
      const number = set.photos.indexOf(photo) + 1;
      return new Option(`${number} · ${photo.file.name}`, String(photo.id));
    });
    select.replaceChildren(new Option("Automatic", ""), ...entries);
    select.value = set.reference === null ? "" : String(set.reference);
    const all = usable.length === set.photos.length;
    const reduced = set.limit !== settings.photoLimit ? `, each at ${set.limit}\u00a0px` : "";
    hint.textContent = isReading(set)
      ? "Reading…"
      : (all ? String(usable.length) : `${usable.length} of ${set.photos.length} can be used`) +
        reduced;
  });
}
