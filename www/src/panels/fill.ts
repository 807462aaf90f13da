import { byId } from "../dom.js";
import type { FillMethod, State, Store } from "../state.js";
import { radios } from "./radios.js";

const names: Readonly<Record<FillMethod, string>> = {
  core: "filled by patches of the background",
  migan: "inpainted by MI-GAN",
  lama: "inpainted by LaMa",
};

/** Binds the choice of how voids are filled. */
export function bindFill(store: Store): void {
  radios("fill-method", store, "fillMethod");
  const address = byId("fill-address", HTMLInputElement);
  address.addEventListener("change", () => store.change({ fillAddress: address.value.trim() }));
  const draw = ({ settings }: State) => {
    const { fillMethod, options } = settings;
    byId("fill-address-part", HTMLElement).hidden = fillMethod === "core";
    address.value = settings.fillAddress;
    byId("fill-summary", HTMLElement).textContent =
      fillMethod === "core" && options.fill === "none" ? "not filled" : names[fillMethod];
  };
  store.subscribe((state, before) => {
    if (state.settings !== before.settings) draw(state);
  });
  draw(store.state);
}
