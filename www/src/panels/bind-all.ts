import type { Options } from "depthstitch";
import { bindSetSettings } from "../many/set-settings.js";
import type { SetLoader } from "../many/set-loader.js";
import { bindStrip } from "../many/strip.js";
import type { InputLoader } from "../inputs/load-inputs.js";
import type { Runner } from "../run/run.js";
import type { Store } from "../state.js";
import { bindTabs } from "../view/tabs.js";
import { bindDepth, offerNetwork } from "./depth.js";
import { bindExport } from "./export.js";
import { bindFill } from "./fill.js";
import { bindMethods } from "./methods.js";
import { bindOptions } from "./options.js";
import { bindPhotoLimit } from "./photo-limit.js";
import { bindSaveSize } from "./save-size.js";
import { bindReport } from "./report.js";

/** Binds everything that belongs to a result: views, export, report and settings. */
export function bindPanels(
  store: Store,
  loader: InputLoader,
  runner: Runner,
  defaults: Readonly<Options>,
  version: string,
  sets: SetLoader,
): void {
  const openView = bindTabs(store, runner, () => offerNetwork(store));
  bindExport(store, version);
  bindSaveSize(store);
  bindReport(store);
  bindMethods(store, runner, openView);
  bindDepth(store, runner);
  bindFill(store);
  bindOptions(store, defaults);
  bindPhotoLimit(store, loader);
  bindStrip(store, sets);
  bindSetSettings(store, sets, runner);
}
