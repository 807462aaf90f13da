import { StitchError } from "depthstitch";
import { bytes, count } from "./number-words.js";
import type { Message } from "./state.js";

/** What an error means to the user and what to do next. */
export function errorMessage(error: unknown): Message {
  if (!(error instanceof StitchError)) {
    return problem(
      "Something unexpected happened.",
      error instanceof Error ? error.message : String(error),
    );
  }
  const number = (name: string) => error.details[name] ?? Number.NaN;
  switch (error.code) {
    case "aborted":
      return {
        tone: "note",
        title: "Cancelled.",
        advice: "Nothing was lost; Stitch starts again.",
      };
    case "invalid-argument":
      return problem(
        "One of the options is out of range.",
        `${sentence(error.message)} Correct it under Options, or reset them.`,
      );
    case "size-mismatch":
      return problem(
        "A picture's data does not fit its size.",
        `${sentence(error.message)} Choose the file again; it may be damaged.`,
      );
    case "too-few-matches":
      return problem(
        `Only ${count(number("usable"), "match", "matches")} of ${number("matches")} can be used; ${number("needed")} are needed.`,
        "A match counts when both its points lie inside their photos and, with depth maps, on a known depth. Check that the " +
          "file belongs to these photos at this size and lists the target's point first.",
      );
    case "no-consensus":
      return problem(
        `Only ${number("inliers")} of ${number("matches")} matches agree on one geometry; ${number("needed")} are needed.`,
        "Check that both photos show the same scene and that the matches and depth maps are theirs. If they are, try a larger " +
          "threshold under Options.",
      );
    case "degenerate-geometry":
      return problem(
        "The matches lie in one line or one spot.",
        "That determines no warp. Use matches that are spread over the whole overlap.",
      );
    case "no-overlap":
      return problem(
        "The warped target misses the reference.",
        "The geometry that fits the matches does not bring the photos together. Check that target and reference are not " +
          "exchanged in the matches file.",
      );
    case "too-large":
      return problem(
        `This would take ${bytes(number("bytes"))}; the limit is ${bytes(number("limit"))}.`,
        "Use smaller photos with matches to fit, lower the canvas limit, or raise the memory limit under Options.",
      );
    case "out-of-memory":
      return problem(
        `The browser refused ${bytes(number("bytes"))} of memory.`,
        "Close other tabs, or use smaller photos with matches to fit.",
      );
    case "decode-failed":
      return problem(
        "A file could not be decoded.",
        `${sentence(error.message)} Choose another file.`,
      );
    case "load-failed":
    case "model-load-failed":
      return problem(
        "A part of this page could not be loaded.",
        `${sentence(error.message)} Check the connection and reload the page.`,
      );
    case "internal":
      return problem(
        "This is a fault of the program, not of your photos.",
        `${sentence(error.message)} Stitch starts afresh; if it happens again, please report it with these photos.`,
      );
    default:
      return problem("The photos could not be stitched.", sentence(error.message));
  }
}

function problem(title: string, advice: string): Message {
  return { tone: "error", title, advice };
}

/** The core's messages begin small and have no full stop. */
function sentence(text: string): string {
  const capital = text.charAt(0).toUpperCase() + text.slice(1);
  return /[.?!]$/.test(capital) ? capital : `${capital}.`;
}
