// Finds a Chromium for the browser tests, or installs one where that is possible without interaction.
import { aptInstall, findProgram, hasApt } from "./installed.mjs";
import { npmBin, run } from "./shared.mjs";

const names = ["chromium", "chromium-browser", "google-chrome-stable", "google-chrome", "chrome"];
const places = [
  "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
  "/Applications/Chromium.app/Contents/MacOS/Chromium",
  "C:\\Program Files\\Google\\Chrome\\Application\\chrome.exe",
  "C:\\Program Files (x86)\\Google\\Chrome\\Application\\chrome.exe",
  "C:\\Program Files (x86)\\Microsoft\\Edge\\Application\\msedge.exe",
];

/** Path of an installed Chromium or Chrome, if any. */
async function find() {
  const { chromium } = await import("playwright-core");
  return findProgram("CHROMIUM_PATH", names, [...places, chromium.executablePath()]);
}

/** Path of a Chromium, which is installed if there is none. */
async function chromiumPath() {
  const found = await find();
  if (found) return found;
  const attempts = [];
  if (hasApt) attempts.push(() => aptInstall("chromium"));
  attempts.push(() =>
    run(process.execPath, [npmBin("playwright-core", "playwright-core"), "install", "chromium"]),
  );
  for (const attempt of attempts) {
    try {
      attempt();
    } catch (error) {
      console.error(String(error));
    }
    const installed = await find();
    if (installed) return installed;
  }
  throw new Error("no Chromium found: install one, or set CHROMIUM_PATH to where it is");
}

const noGpu = ["--disable-gpu"];
/** WebGPU in software: slow but reproducible. */
const softwareGpu = [
  "--enable-unsafe-webgpu",
  "--use-webgpu-adapter=swiftshader",
  "--enable-features=Vulkan",
];

/** Starts a Chromium, with or without WebGPU, which the caller closes. */
export async function launch({ webgpu = false } = {}) {
  const { chromium } = await import("playwright-core");
  const gpu = webgpu ? softwareGpu : noGpu;
  return chromium.launch({
    executablePath: await chromiumPath(),
    args: ["--no-sandbox", "--disable-background-networking", ...gpu],
  });
}
