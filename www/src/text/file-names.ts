import type { ManyOutcome, Outcome } from "../state.js";

/** What the files saved of a result are named after: its photos, the first and the last of many. */
export function baseName(outcome: Outcome | ManyOutcome): string {
  const files =
    outcome.kind === "many"
      ? outcome.photos.filter((_, index) => outcome.result.photos[index]?.used)
      : [outcome.slots.target, outcome.slots.reference];
  if (files.some((photo) => photo?.origin === "sample")) return "example";
  const names = files.flatMap((photo) => (photo ? [withoutExtension(photo.file.name)] : []));
  const [first = "photos"] = names;
  const last = names.at(-1) ?? first;
  const between = names.length > 2 ? "_to_" : "_";
  return first === last ? first : `${first}${between}${last}`;
}

function withoutExtension(name: string): string {
  // Short enough for any file system, also with the other name.
  return name.replace(/\.[^.]+$/, "").slice(0, 80) || "photo";
}
