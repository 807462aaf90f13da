import { StitchError } from "depthstitch";
import { NetworkError } from "../networks/client.js";
import { bytes, count } from "./numbers.js";
import type { Message } from "../state.js";

const cancelled: Message = {
  tone: "note",
  title: "Cancelled.",
  advice: "Nothing was lost; “Stitch again” starts afresh.",
};

/** What an error means to the user and what to do next. */
export function errorMessage(error: unknown): Message {
  if (error instanceof NetworkError) {
    return problem(
      "The network could not be used.",
      `${sentence(error.message)} Check the connection and its address, choose another one, or go on without it.`,
    );
  }
  if (!(error instanceof StitchError)) {
    if (error instanceof DOMException && error.name === "AbortError") return cancelled;
    if (error instanceof TypeError && /import|module script|fetch/i.test(error.message)) {
      return problem(
        "A part of this page could not be loaded.",
        "Check the connection and reload the page.",
      );
    }
    return problem(
      "Something unexpected happened.",
      error instanceof Error ? error.message : String(error),
    );
  }
  const number = (name: string) => error.details[name] ?? Number.NaN;
  switch (error.code) {
    case "aborted":
      return cancelled;
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
        "Photos that hardly overlap, are blurred or show bare surfaces have few. A match of a file counts when both its " +
          "points lie inside their photos: check that the file belongs to these photos at this size and lists the " +
          "target's point first.",
      );
    case "no-consensus":
      return problem(
        `Only ${number("inliers")} of ${number("matches")} matches agree on one geometry; ${number("needed")} are needed.`,
        "Check that both photos show the same scene and that matches and depth maps of yours are theirs. If they are, try a larger " +
          "threshold under Options.",
      );
    case "degenerate-geometry":
      return problem(
        "The matches lie in one line or one spot.",
        "That determines no warp. Use matches that are spread over the whole overlap.",
      );
    case "no-overlap":
      return problem(
        "The moved photo misses the other one.",
        "The geometry that fits the matches does not bring the photos together. Check that the two photos are not " +
          "exchanged in a matches file of yours.",
      );
    case "too-large":
      return problem(
        `This would take ${bytes(number("bytes"))}; the limit is ${bytes(number("limit"))}.`,
        "Lower the limit of the photos' size, lower the canvas limit, or raise the memory limit under Options.",
      );
    case "out-of-memory":
      return problem(
        `The browser refused ${bytes(number("bytes"))} of memory.`,
        "Close other tabs, or lower the limit of the photos' size.",
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
        `${sentence(error.message)} “Stitch again” starts afresh; if it happens again, please report it with these photos.`,
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
