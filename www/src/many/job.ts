import { stitchMany, type CallOptions, type Options } from "depthstitch";
import { taken } from "../image-worker/client.js";
import type { Photo } from "../image-worker/contents.js";
import { identityOf } from "../run/job.js";
import { kept, remembered } from "../run/results.js";
import type { Message, State } from "../state.js";
import { isReading, usablePhotos, type SetPhoto } from "./photo-set.js";

/** The complete inputs of a stitch of many photos. */
export interface ManyJob {
  readonly photos: readonly SetPhoto[];
  /** Index of the reference; null for the one in the middle. */
  readonly reference: number | null;
  readonly options: Partial<Options>;
}

/** The job for the present set and settings, or a message about what is missing. */
export function prepareSet({ set, settings }: State): ManyJob | Message {
  const note = (title: string, advice: string): Message => ({ tone: "note", title, advice });
  if (!set) return note("There are no photos.", "Choose two or more.");
  if (isReading(set)) {
    return note("A photo is still being read.", "Press “Stitch again” in a moment.");
  }
  const photos = usablePhotos(set);
  if (photos.length < 2) {
    return {
      tone: "error",
      title: "At least two photos that can be used are needed.",
      advice: "What is wrong with the others is said beside them. Add other photos.",
    };
  }
  const reference = photos.findIndex(({ id }) => id === set.reference);
  return { photos, reference: reference < 0 ? null : reference, options: settings.options };
}

/** The result of a job, computed unless it is cached. */
export function manyResultOf({ photos, reference, options }: ManyJob, call: CallOptions) {
  const contents = photos.flatMap(({ content }) => content ?? []);
  const key = [
    "many",
    ...contents.map(identityOf),
    `reference ${reference}`,
    ...Object.entries(options)
      .map((entry) => entry.join("="))
      .sort(),
  ].join(" ");
  return remembered(key, async () => {
    const isGiven = options.focalLength !== undefined;
    const input = async (photo: Photo) => {
      const { data, width, height } = await taken(photo.pixels);
      return { data, width, height, focalLength: isGiven ? null : focalLengthOf(photo) };
    };
    const inputs = await Promise.all(contents.map(input));
    return kept(await stitchMany(inputs, { ...options, reference, ...call, transfer: true }));
  });
}

/** The focal length in pixels from the 35 mm equivalent in EXIF data; the diagonal of 35 mm film is 43.27 mm. */
function focalLengthOf({ focalLength35, width, height }: Photo): number | null {
  return focalLength35 === null ? null : (focalLength35 * Math.hypot(width, height)) / 43.27;
}
