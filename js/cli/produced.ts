import { encodeGrayPng, encodePng } from "../codecs.js";
import {
  crop,
  defaultOptions,
  version,
  type ImageOutput,
  type Mask,
  type Stage,
  type StitchResult,
} from "../index.js";
import type { StitchCommand, StitchManyCommand } from "./arguments.js";
import type { MatchedColours } from "./colours.js";
import { encodeImage, jsonBytes } from "./encode.js";

/** What stitching made, of two photos or more. */
export interface Stitched {
  readonly result: {
    readonly mosaic: ImageOutput;
    /** Where a file of it is asked for, as below. */
    readonly warped?: ImageOutput;
    readonly voidMask?: Mask;
    readonly crop: StitchResult["crop"];
    readonly offset: StitchResult["offset"];
    /** Only of two photos. */
    readonly clipped?: boolean;
    readonly projection: StitchResult["projection"];
    readonly times: Readonly<Partial<Record<Stage, number>>>;
  };
  readonly colours: MatchedColours;
  /** The photo whose camera data the mosaic gets. */
  readonly reference: number;
  /** What the report says besides what all reports do. */
  readonly report: object;
  /** Each one a code and a sentence. */
  readonly warnings: readonly string[];
  /** The rest of one line after the mosaic's name and size. */
  readonly summary: string;
}

/** What a command makes. */
export interface Produced {
  /** The bytes of every output by path. */
  readonly contents: ReadonlyMap<string, Uint8Array>;
  readonly warnings: readonly string[];
  /** One line. */
  readonly summary: string;
}

/** Encodes what a command asks for. */
export async function encoded(
  command: StitchCommand | StitchManyCommand,
  stitched: Stitched,
): Promise<Produced> {
  const { outputs, quality, crop: part } = command;
  const { result, colours, reference, warnings, summary } = stitched;
  const { colourProfile } = colours;
  const rect = part === "none" ? null : result.crop[part];
  const mosaic = rect ? crop(result.mosaic, rect) : result.mosaic;
  const metadata = { colourProfile, exif: colours.exif[reference] ?? null };
  const contents = new Map([
    [outputs.mosaic, await encodeImage(outputs.mosaic, mosaic, quality, metadata)],
  ]);
  if (outputs.warped && result.warped)
    contents.set(outputs.warped, await encodePng(result.warped, { colourProfile }));
  if (outputs.voidMask && result.voidMask)
    contents.set(outputs.voidMask, await encodeGrayPng(result.voidMask));
  if (outputs.report) contents.set(outputs.report, jsonBytes(await report(command, stitched)));
  return {
    contents,
    warnings: [...colours.warnings, ...warnings],
    summary: `${outputs.mosaic}: ${mosaic.width}×${mosaic.height}, ${summary}`,
  };
}

/** The JSON of `--report`: everything in a result except images. */
async function report(
  { settings, outputs }: StitchCommand | StitchManyCommand,
  { result, report }: Stitched,
): Promise<object> {
  const { mosaic, voidMask, offset, clipped, projection, times } = result;
  const { width, height } = mosaic;
  return {
    version: await version(),
    ...report,
    options: { ...(await defaultOptions(settings.mode)), ...settings },
    crop: result.crop,
    canvas: { width, height, offset, clipped },
    projection,
    voidPixels: voidMask && pixelsIn(voidMask),
    times,
    outputs,
  };
}

/** The number of pixels in a mask. */
function pixelsIn({ data }: Mask): number {
  return data.reduce((count, value) => count + (value === 0 ? 0 : 1), 0);
}
