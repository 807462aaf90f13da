// `npm run site`: what the release puts on the web, in target/site: the page with its sample, and the API's reference below api/.
import { cpSync, rmSync } from "node:fs";
import { join } from "node:path";
import { build } from "./build.mjs";
import { writeReference } from "./docs.mjs";
import { renderSample } from "./sample.mjs";
import { isMain, npmBin, root, run } from "./shared.mjs";

/** Builds everything; the site's folder. */
export async function buildSite() {
  const site = join(root, "target", "site");
  await build();
  await renderSample();
  rmSync(site, { recursive: true, force: true });
  run(process.execPath, [npmBin("vite", "vite"), "build", "www", "--outDir", site]);
  cpSync(await writeReference(), join(site, "api"), { recursive: true });
  return site;
}

if (isMain(import.meta.url)) console.log(await buildSite());
