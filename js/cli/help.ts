import { OPTION_LIST, type OptionSpec } from "../options.js";
import { DEFAULT_OUTPUT, DEFAULT_QUALITY } from "./arguments.js";
import { flagName, placeholder } from "./settings.js";

const COLUMN = 28;
const WIDTH = 100;

type Row = readonly [flag: string, help: string];

const INPUT: readonly Row[] = [
  ["--case DIR", "case folder: its case.json names photos, depth maps and matches"],
  [
    "-m, --matches FILE",
    "CSV with the header xt,yt,xr,yr: pixels of target and reference; by default features are detected and matched",
  ],
  ["--own-matches", "detect and match features even if the case has matches"],
  [
    "--reference FILE",
    "of three photos or more, the one in whose view all are shown; by default the one in the middle, or of photos taken on the way forward an early one",
  ],
  ["--target-depth FILE", "depth map of the target"],
  [
    "--reference-depth FILE",
    "depth map of the reference; a missing one is derived from the other, but not with --without-depth=homography",
  ],
  [
    "--depth FILE",
    "of three photos or more, a depth map: once for each photo, in their order, and none for one without",
  ],
  [
    "--cameras FILE",
    "of three photos or more, JSON with the camera and focal length of each, as --report writes it for photos of the same sizes",
  ],
  [
    "--distortion N",
    "of three photos or more, the radial distortion of their lens, -1 (barrel) to 1 (pincushion), 0 for none; by default that of the cameras' file, or estimated",
  ],
  [
    "--depth-kind KIND",
    "inverse (larger is nearer: Depth Anything, MiDaS, disparity) or metric (distance) [inverse]",
  ],
  ["--depth-scale N", "factor from values of the file to depth or inverse depth [1]"],
  ["--invalid N", "value of the depth maps that means unknown [none]"],
];

const OUTPUT: readonly Row[] = [
  ["-o, --output FILE", `the mosaic, .png or .jpg [${DEFAULT_OUTPUT}]`],
  ["--warped FILE", "the warped target on the canvas of the mosaic, .png; alpha is validity"],
  ["--void-mask FILE", "mask of the voids inside the mosaic before they are filled, .png"],
  [
    "--report FILE",
    "models, inliers, quality, times and warnings as JSON; of three photos or more, which were used, and why not the others",
  ],
  [
    "--crop none|inner|bounds",
    "save the whole canvas, the largest rectangle without transparent pixels, or the bounding box of the mosaic [none]",
  ],
  ["--quality N", `JPEG quality, 1 to 100 [${DEFAULT_QUALITY}]`],
  [
    "--workers 1|2|4|auto",
    "how many threads may share the work, which changes no result; auto: one for each processor, at most four [auto]",
  ],
  ["--progress", "report progress even if stderr is not a terminal"],
  ["-q, --quiet", "print errors only"],
  ["-h, --help", "print this help"],
  ["-V, --version", "print the version"],
];

/** The text of `--help`. */
export function helpText(): string {
  const options = OPTION_LIST.map(([name, spec]): Row => {
    const unit = "unit" in spec && spec.unit && spec.unit !== "px" ? ` (${spec.unit})` : "";
    return [
      `--${flagName(name)} ${placeholder(spec)}`,
      `${spec.description}${unit} [${defaultText(spec)}]`,
    ];
  });
  return `Usage: depthstitch TARGET REFERENCE [options]
       depthstitch PHOTO PHOTO PHOTO... [options]
       depthstitch --case DIR [options]

Stitches two photos of a scene taken from two positions: TARGET is warped onto REFERENCE. Depth is estimated from the
two photos unless depth maps are given; depth maps improve what only one photo shows. Three to thirty photos, in any
order, are stitched into the view of one of them; photos that do not belong are left out. Photos are PNG or JPEG files,
depth maps PNG (8 or 16 bit) or JPEG.

Input:
${table(INPUT)}

Output:
${table(OUTPUT)}

Method:
${table(options)}

Existing files are replaced, all at once and only if everything succeeded. A summary is printed to stdout; progress,
warnings and errors to stderr, each error as one line: depthstitch: code: message.

Exit codes: 0 stitched; 1 the photos could not be stitched, or a file could not be read or written; 2 the command
line, or a photo or camera that it names, is invalid; 130 interrupted by Ctrl-C, which ends it at once and leaves nothing
behind.
`;
}

function defaultText({ default: value }: OptionSpec): string {
  return typeof value === "boolean" ? (value ? "on" : "off") : String(value);
}

function table(rows: readonly Row[]): string {
  return rows.map(([flag, help]) => row(flag, help)).join("\n");
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
