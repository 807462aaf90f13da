// `npm start`: installs, builds, renders the sample, and serves the page, which stitches it. Stop with Ctrl+C.
import { spawn } from "node:child_process";
import { join } from "node:path";
import { build } from "./build.mjs";
import { renderSample } from "./sample.mjs";
import { installPackages, root } from "./shared.mjs";

installPackages();
await build();
await renderSample();

const { createServer } = await import("vite");
const server = await createServer({ configFile: join(root, "www", "vite.config.ts") });
await server.listen();
const url = server.resolvedUrls?.local[0] ?? server.resolvedUrls?.network[0];
if (!url) throw new Error("the server has no address");
const page = new URL("?sample", url).href;
console.log(`\nThe page is at ${page} (Ctrl+C to stop)`);
if (canShow()) open(page);

/** Whether a browser can be opened. */
function canShow() {
  if (process.env.NO_OPEN || process.env.CI) return false;
  if (process.platform !== "linux") return true;
  return Boolean(process.env.DISPLAY || process.env.WAYLAND_DISPLAY);
}

/** Opens the page in the default browser; if that fails, the user can open the printed URL. @param {string} url */
function open(url) {
  /** @type {Partial<Record<NodeJS.Platform, string[]>>} */
  const commands = { darwin: ["open"], win32: ["cmd", "/c", "start", ""] };
  const [command = "xdg-open", ...args] = commands[process.platform] ?? [];
  const opener = spawn(command, [...args, url], { stdio: "ignore", detached: true });
  opener.on("error", () => console.log("Open it in a browser."));
  opener.unref();
}
