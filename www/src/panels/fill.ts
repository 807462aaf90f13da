import { byId } from "../dom.js";
import type { Filler, State, Store } from "../state.js";
import { radios } from "./radios.js";

const names: Readonly<Record<Filler, string>> = {
  core: "filled by similar places",
  migan: "filled by MI-GAN",
  lama: "filled by LaMa",
};

/** Binds the choice of what fills the voids. */
export function bindFill(store: Store): void {
  radios("filler", store, "filler");
  const address = byId("fill-host", HTMLInputElement);
  address.placeholder = "where its authors published it";
  address.addEventListener("change", () => store.change({ fillAddress: address.value.trim() }));
  const draw = ({ settings }: State) => {
    const { filler, options } = settings;
    byId("fill-host-part", HTMLElement).hidden = filler === "core";
    address.value = settings.fillAddress;
    byId("fill-summary", HTMLElement).textContent =
      filler === "core" && options.fill === "none" ? "left empty" : names[filler];
  };
  store.subscribe((state, before) => {
    if (state.settings !== before.settings) draw(state);
  });
  draw(store.state);
}
