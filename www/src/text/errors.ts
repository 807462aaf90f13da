import { StitchError, type ErrorCode } from "depthstitch";
import { NetworkError } from "../networks/client.js";
import { bytes, count } from "./numbers.js";
import type { Message } from "../state.js";
import { messageOf } from "../message-of.js";

const cancelled: Message = {
  tone: "note",
  title: "Cancelled.",
  advice: "Start it again whenever you like.",
};

/** Title and advice for an error of the core, from its numbers. */
type Explanation = (
  number: (name: string) => number,
  message: string,
) => readonly [title: string, advice: string];

const explanations: { readonly [K in Exclude<ErrorCode, "aborted">]: Explanation } = {
  "invalid-argument": (number, message) =>
    number("pixels") > 0
      ? ["A photo is wholly transparent.", `${message} Choose another file.`]
      : [
          "An option has an invalid value.",
          `${message} Correct it under Options, or reset all options.`,
        ],
  "size-mismatch": (_, message) => [
    "An image has the wrong size.",
    `${message} Choose the file again; it may be damaged.`,
  ],
  "too-few-matches": (number) => {
    const [usable, all, needed] = [number("usable"), number("matches"), number("needed")];
    const few =
      `There are ${usable}, and at least ${needed} are required. ` +
      "Photos with little overlap, blur or little texture have few.";
    const outside =
      `${all - usable} of ${count(all, "match", "matches")} cannot be used. Matches from a file must lie within both photos: ` +
      "check that the file belongs to these photos at this size and lists the first photo's point first.";
    return [commonPoints(usable), usable === all ? few : `${few} ${outside}`];
  },
  "no-consensus": (number) => [
    commonPoints(number("inliers")),
    `Only ${number("inliers")} of ${number("matches")} matches agree on one geometry; at least ${number("needed")} are required. ` +
      "Check that the photos show the same scene and overlap, and that matches and depth maps from files belong to them. If they " +
      "do, try a larger inlier threshold under Options.",
  ],
  "degenerate-geometry": (number) =>
    number("behind") > 0
      ? [
          "The photos do not fit together.",
          `The geometry that most matches agree on has ${Math.round(100 * number("behind"))} % of the first photo behind the second ` +
            "photo’s camera. Use photos that overlap more, or that were taken from more similar directions.",
        ]
      : [
          "The matches lie on a line or in a point.",
          "They do not determine a warp. Use matches that are spread over the whole overlap.",
        ],
  "no-overlap": () => [
    "The warped photo does not overlap the other one.",
    "The geometry that fits the matches maps the first photo outside the second. If the matches come from a file, " +
      "check that the two photos are not swapped.",
  ],
  "too-large": (number) => [
    `This would take ${bytes(number("bytes"))}; the limit is ${bytes(number("limit"))}.`,
    "Reduce the photo size or the canvas limit, or increase the memory limit under Options.",
  ],
  "out-of-memory": (number) => [
    // The engine does not say how much a failed growth of memory was about.
    number("bytes") > 0
      ? `The browser could not allocate ${bytes(number("bytes"))} of memory.`
      : "The browser has no memory left for this.",
    "Close other tabs, or reduce the photo size under Options.",
  ],
  "decode-failed": (_, message) => [
    "A file could not be decoded.",
    `${message} Choose another file.`,
  ],
  "load-failed": (_, message) => [
    "Part of this page could not be loaded.",
    `${message} Check the connection and reload the page.`,
  ],
  "model-load-failed": (_, message) => [
    "Part of this page could not be loaded.",
    `${message} Check the connection and reload the page.`,
  ],
  internal: (_, message) => [
    "This is a bug in the program.",
    `${message} Press “Stitch again” to restart. If it happens again, please report it with these photos.`,
  ],
};

/** What an error means to the user, and what to do next. */
export function errorMessage(error: unknown): Message {
  if (error instanceof StitchError) {
    if (error.code === "aborted") return cancelled;
    const number = (name: string) => error.details[name] ?? Number.NaN;
    return problem(...explanations[error.code](number, sentence(error.message)));
  }
  if (error instanceof NetworkError) {
    return problem(
      "The network could not be used.",
      `${sentence(error.message)} Check the connection and its address, choose another one, or continue without it.`,
    );
  }
  if (error instanceof DOMException && error.name === "AbortError") return cancelled;
  if (isConnectionError(error)) {
    return problem(
      "Part of this page could not be loaded.",
      "Check the connection and reload the page.",
    );
  }
  return problem("An unexpected error occurred.", messageOf(error));
}

/** Whether a file of the page could not be fetched. */
export function isConnectionError(error: unknown): boolean {
  return (
    error instanceof TypeError && /import|module script|fetch|load failed/i.test(error.message)
  );
}

function commonPoints(found: number): string {
  return `${found > 0 ? "Too few" : "No"} common points were found.`;
}

function problem(title: string, advice: string): Message {
  return { tone: "error", title, advice };
}

/** Turns a message of the core, which starts in lower case and has no full stop, into a sentence. */
function sentence(text: string): string {
  const capital = text.charAt(0).toUpperCase() + text.slice(1);
  return /[.?!]$/.test(capital) ? capital : `${capital}.`;
}
