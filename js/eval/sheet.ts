import type { Case } from "../cases/case.js";
import type { ImageInput, ImageOutput, Size, StitchResult } from "../index.js";
import { colours, resample } from "../models/resample.js";
import type { Row } from "./evaluate.js";
import { LETTER, drawText, wrapped } from "./lettering.js";
import { MEASURES, MEASURE_NAMES } from "./measures.js";

/** Largest size of a picture on the sheet, and the gap around it. */
const CELL = { width: 640, height: 440 } as const;
const GAP = 10;
const PAPER = 255;
const INK = 0;
/** What is transparent. */
const VOID = 96;
/** Measures of these names are written below a mosaic besides those that were asked for. */
const ALWAYS: ReadonlySet<string> = new Set(["psnr_mask", "cover"]);

interface Cell {
  readonly picture: ImageInput;
  readonly label: readonly string[];
}

/** A picture sheet: a line for each case, of its photos and the mosaic of every mode. */
export class Sheet {
  readonly #lines = new Map<string, Cell[]>();

  /** Appends a mosaic to the line of its case. */
  add(
    row: Row,
    { target, reference }: Pick<Case, "target" | "reference">,
    { mosaic }: Pick<StitchResult, "mosaic">,
  ): void {
    const line = this.#lines.get(row.case) ?? [
      { picture: shrunk(target), label: [row.case, "target"] },
      { picture: shrunk(reference), label: ["reference"] },
    ];
    line.push(result(row, mosaic));
    this.#lines.set(row.case, line);
  }

  /** Appends a line of all photos of a set, small, and their mosaic. */
  addSet(row: Row, photos: readonly ImageInput[], mosaic: ImageInput): void {
    const together = { picture: contacts(photos), label: [row.case, `${photos.length} photos`] };
    this.#lines.set(row.case, [together, result(row, mosaic)]);
  }

  draw(): ImageOutput {
    const most = Math.floor(CELL.width / LETTER.width);
    const lines = [...this.#lines.values()].map((line) =>
      line.map(({ picture, label }) => ({ picture, text: wrapped(label, most) })),
    );
    const columns = Math.max(1, ...lines.map((line) => line.length));
    const heights = lines.map((line) =>
      Math.max(
        ...line.map(({ picture, text }) => picture.height + 2 * GAP + text.length * LETTER.height),
      ),
    );
    const width = columns * (CELL.width + GAP) + GAP;
    const height = GAP + heights.reduce((sum, height) => sum + height, 0);
    const data = new Uint8ClampedArray(4 * width * height).fill(PAPER);
    let top = GAP;
    lines.forEach((line, i) => {
      line.forEach(({ picture, text }, k) => {
        const left = GAP + k * (CELL.width + GAP);
        for (let y = 0; y < picture.height; y++) {
          const from = 4 * y * picture.width;
          const row = picture.data.subarray(from, from + 4 * picture.width);
          data.set(row, 4 * ((top + y) * width + left));
        }
        text.forEach((words, n) => {
          drawText(words, left, top + picture.height + GAP / 2 + n * LETTER.height, (x, y) => {
            data.fill(INK, 4 * (y * width + x), 4 * (y * width + x) + 3);
          });
        });
      });
      top += heights[i] ?? 0;
    });
    return { data, width, height };
  }
}

function result(row: Row, mosaic: ImageInput): Cell {
  return { picture: shrunk(mosaic), label: [row.mode, ...figures(row)] };
}

/** Photos side by side, in rows, in one cell. */
function contacts(photos: readonly ImageInput[]): ImageInput {
  const columns = Math.ceil(Math.sqrt(photos.length));
  const part = {
    width: Math.floor(CELL.width / columns),
    height: Math.floor(CELL.height / Math.ceil(photos.length / columns)),
  };
  const data = new Uint8ClampedArray(4 * CELL.width * CELL.height).fill(PAPER);
  photos.forEach((photo, i) => {
    const small = shrunk(photo, { width: part.width - 2, height: part.height - 2 });
    const [left, top] = [(i % columns) * part.width, Math.floor(i / columns) * part.height];
    for (let y = 0; y < small.height; y++) {
      const row = small.data.subarray(4 * y * small.width, 4 * (y + 1) * small.width);
      data.set(row, 4 * ((top + y) * CELL.width + left));
    }
  });
  return { data, ...CELL };
}

/** The measures of a row that there are, for people. */
function figures(row: Row): string[] {
  return MEASURE_NAMES.flatMap((name) => {
    const { group, headings, digits } = MEASURES[name];
    if (group === "overlap" && !ALWAYS.has(name)) return [];
    const value = row[name];
    const numbers = typeof value === "object" ? (value ?? []) : [value];
    return numbers.map((number, i) => `${headings[i] ?? name} ${number.toFixed(digits)}`);
  });
}

/** The picture in at most this size, transparent parts gray. */
function shrunk(picture: ImageInput, most: Size = CELL): ImageInput {
  const opaque = { ...picture, data: Uint8ClampedArray.from(picture.data) };
  for (let i = 0; i < opaque.data.length; i += 4) {
    if (opaque.data[i + 3] === 0) opaque.data.fill(VOID, i, i + 3);
  }
  const scale = Math.max(1, picture.width / most.width, picture.height / most.height);
  const side = (length: number): number => Math.max(1, Math.round(length / scale));
  const [width, height] = [side(picture.width), side(picture.height)];
  const planes = resample(colours(opaque), width, height);
  const data = new Uint8ClampedArray(4 * width * height).fill(255);
  for (let i = 0; i < data.length; i++) {
    if (i % 4 < 3) data[i] = planes[(i % 4) * width * height + (i >> 2)] ?? 0;
  }
  return { data, width, height };
}
