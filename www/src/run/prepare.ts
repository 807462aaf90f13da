import type { DepthInput } from "depthstitch";
import { depthNetworkOf, depthSlot, type Message, type PhotoSlot, type State } from "../state.js";
import { scaleMatches, type Job } from "./job.js";

/** The job for the current inputs and settings, or a message about what is missing. */
export function prepareJob(state: State): Job | Message {
  const { slots, settings, loading } = state;
  const note = (title: string, advice: string): Message => ({ tone: "note", title, advice });
  if (loading.size > 0) return note("A file is still being read.", "Stitch again in a moment.");
  const target = slots.target?.content;
  const reference = slots.reference?.content;
  if (!target && !reference) {
    return note("Two photos are required.", "Choose both, or start with the example.");
  }
  if (!target) return note("The first photo is missing.", "Choose the photo to be warped.");
  if (!reference) return note("The second photo is missing.", "Choose the reference photo.");

  const targetDepth = depthOf(state, "target");
  const referenceDepth = depthOf(state, "reference");
  return {
    target,
    reference,
    ...(slots.matches && { matches: scaleMatches(slots.matches.content, target, reference) }),
    ...(targetDepth && { targetDepth }),
    ...(referenceDepth && { referenceDepth }),
    options: settings.options,
  };
}

/** The depth map of a photo from the source that the settings select, if it has one. */
function depthOf(
  { slots, settings, networkDepths }: State,
  slot: PhotoSlot,
): DepthInput | undefined {
  if (settings.depthSource === "files") {
    const map = slots[depthSlot[slot]]?.content;
    return map && { ...map, ...settings.depth };
  }
  if (settings.depthSource !== "model" || !slots[slot]) return undefined;
  const estimated = networkDepths.get(slots[slot].content);
  return estimated && estimated.model === depthNetworkOf(settings)
    ? { ...estimated.map, kind: "inverse" }
    : undefined;
}
