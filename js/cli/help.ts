import type { Options } from "../index.js";
import { DEFAULT_OUTPUT, DEFAULT_QUALITY } from "./arguments.js";
import { SETTINGS, SETTING_NAMES, flagName } from "./settings.js";

const COLUMN = 28;
const WIDTH = 100;

/** The text of `--help`, with the core's own defaults. */
export function helpText(defaults: Options): string {
  const settings = SETTING_NAMES.map((name) => {
    const { placeholder, help } = SETTINGS[name];
    return row(`--${flagName(name)} ${placeholder}`, `${help} [${defaultText(defaults[name])}]`);
  });
  return `Usage: depthstitch TARGET REFERENCE [options]
       depthstitch --case DIR [options]

Stitches two photos of one scene taken from two places: TARGET is warped onto REFERENCE. Depth maps make the part that
only one photo shows more exact; without them depth is estimated from the two photos. Photos are PNG or JPEG; depth
maps are PNG (8 or 16 bit) or JPEG.

Input:
${[
  row("--case DIR", "a folder with a case.json that names photos, depth maps and matches"),
  row(
    "-m, --matches FILE",
    "CSV with the header xt,yt,xr,yr: pixels of the target and of the reference; without it the photos are matched",
  ),
  row("--own-matches", "match the photos even if the case brings matches"),
  row("--target-depth FILE", "depth of the target"),
  row("--reference-depth FILE", "depth of the reference; the one that is missing is derived"),
  row(
    "--depth-kind KIND",
    "inverse (larger is nearer: Depth Anything, MiDaS, disparity) or metric [inverse]",
  ),
  row("--depth-scale N", "value × N is the depth or inverse depth [1]"),
  row("--invalid N", "the value of a depth map that means unknown [none]"),
].join("\n")}

Output:
${[
  row("-o, --output FILE", `the mosaic, .png or .jpg [${DEFAULT_OUTPUT}]`),
  row("--warped FILE", "the warped target on the mosaic's canvas, .png; alpha is validity"),
  row("--void-mask FILE", "the mosaic's inner voids before they are filled, .png"),
  row("--report FILE", "models, inliers, quality, times and warnings as JSON"),
  row(
    "--crop none|inner|bounds",
    "write all of the mosaic, its largest rectangle without a gap, or the smallest one with everything [none]",
  ),
  row("--quality N", `JPEG quality, 1 to 100 [${DEFAULT_QUALITY}]`),
  row("--progress", "report progress even when stderr is no terminal"),
  row("-q, --quiet", "print nothing but errors"),
  row("-h, --help", "print this"),
  row("-V, --version", "print the version"),
].join("\n")}

Method:
${settings.join("\n")}

Existing outputs are replaced, all together and only once everything has worked. A summary goes to stdout; progress,
warnings and errors go to stderr, an error as one line: depthstitch: code: message.

Exit codes: 0 stitched; 1 the photos could not be stitched, or a file could not be read or written; 2 the command line
is wrong; 130 stopped by Ctrl-C.
`;
}

function defaultText(value: Options[keyof Options]): string {
  return typeof value === "boolean" ? (value ? "on" : "off") : String(value);
}

function row(flag: string, help: string): string {
  const indent = " ".repeat(COLUMN);
  const lines = [""];
  for (const word of help.split(" ")) {
    const line = lines[lines.length - 1] ?? "";
    if (line === "") lines[lines.length - 1] = word;
    else if (COLUMN + line.length + 1 + word.length <= WIDTH)
      lines[lines.length - 1] = `${line} ${word}`;
    else lines.push(word);
  }
  const head = `  ${flag}`;
  const text = lines.join(`\n${indent}`);
  return head.length < COLUMN ? head.padEnd(COLUMN) + text : `${head}\n${indent}${text}`;
}
