import { byId } from "../dom.js";
import type { InputLoader } from "../inputs/load-inputs.js";
import type { Store } from "../state.js";

/** Binds the limit of the photo size. Photos that it affects are decoded again. */
export function bindPhotoLimit(store: Store, loader: InputLoader): void {
  const select = byId("photo-limit", HTMLSelectElement);
  select.addEventListener("change", () => store.change({ photoLimit: Number(select.value) }));
  store.subscribe(({ settings: { photoLimit } }, before) => {
    const value = String(photoLimit);
    if (![...select.options].some((option) => option.value === value)) {
      select.append(new Option(`${value} px`, value));
    }
    select.value = value;
    if (photoLimit !== before.settings.photoLimit) void loader.reloadPhotos();
  });
}
