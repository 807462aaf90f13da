/** What the page says about files that it cannot use. */
import { InputFileError } from "../input-file-error.js";
import { slotNames, type Message, type State } from "../state.js";
import { errorMessage, isConnectionError } from "../text/errors.js";
import type { Files } from "./decode-slots.js";

/** Why chosen files could not be loaded. */
export function unusable(error: unknown, title: string): Message {
  return { tone: "error", title, advice: adviceAfter(error) };
}

function adviceAfter(error: unknown): string {
  if (error instanceof InputFileError) return error.message;
  // A new start of the page would lose what was chosen.
  if (isConnectionError(error)) return "Check the connection and try again.";
  return errorMessage(error).advice;
}

/** What is wrong with files whose cards are not in view: those that are no photos. */
export function hiddenProblems(problems: State["problems"], placed: Files): Message | null {
  const wrong = slotNames.filter((slot) => problems[slot] !== undefined && placed[slot]);
  const hidden = wrong.filter((slot) => slot !== "target" && slot !== "reference");
  if (hidden.length === 0) return null;
  const names = hidden.map((slot) => placed[slot]?.name ?? "").join(", ");
  return {
    lasting: true,
    tone: "error",
    title: `${names} cannot be used.`,
    advice: hidden.map((slot) => problems[slot]).join(" "),
  };
}

/** That files of a case are absent. */
export function incompleteCase(absent: readonly string[]): Message {
  return {
    lasting: true,
    tone: "error",
    title: "The case is incomplete.",
    advice: `Missing: ${absent.join(", ")}. Drop all files of the case together.`,
  };
}

/** Which files were left while `used` are used; with a set (`isSet`) only photos are. */
export function unusedFiles(left: readonly File[], used: number, isSet: boolean): Message | null {
  const names = left.map((file) => file.name).join(", ");
  if (used === 0) {
    return {
      lasting: true,
      tone: "error",
      title: "None of these files can be used.",
      advice: `Photos are JPEG, PNG or WebP files; depth maps grayscale PNG, .npy or .pfm; matches CSV. Ignored: ${names || "no files"}.`,
    };
  }
  if (left.length === 0) return null;
  return {
    lasting: true,
    tone: "note",
    title: "Some files were ignored.",
    advice: `${isSet ? "Depth maps and matches are used with two photos only. " : ""}Ignored: ${names}.`,
  };
}
