import type { Options } from "depthstitch";
import type { InputLoader } from "./inputs/load-inputs.js";
import { bindDepth, offerNetwork } from "./panels/depth.js";
import { bindFill } from "./panels/fill.js";
import { bindKeep } from "./panels/keep.js";
import { bindMethods } from "./panels/methods.js";
import { bindOptions } from "./panels/options.js";
import { bindPhotoLimit } from "./panels/photo-limit.js";
import { bindReport } from "./panels/report.js";
import type { Runner } from "./run/run.js";
import type { Store } from "./state.js";
import { bindTabs } from "./view/tabs.js";

/** Binds all that belongs to a result: its views, what can be kept of it, its report, and the settings that led to it. */
export function bindWorkbench(
  store: Store,
  loader: InputLoader,
  runner: Runner,
  defaults: Readonly<Options>,
  version: string,
): void {
  const openView = bindTabs(store, runner, () => offerNetwork(store));
  bindKeep(store, version);
  bindReport(store);
  bindMethods(store, runner, openView);
  bindDepth(store, runner);
  bindFill(store);
  bindOptions(store, defaults);
  bindPhotoLimit(store, loader);
}
