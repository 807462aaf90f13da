/** What a person sees of a mosaic: lower is better, 0 is perfect, null where there is too little to judge. */
export interface Appearance {
  /** Share of void in the band of 2 % of the diagonal inside the reference's border, within the target's footprint. */
  borderVoids: number;
  /** Share of void in the whole overlap. */
  overlapVoids: number;
  /** Share of the seam within 3 pixels of the reference's border: it had nowhere else to go. */
  seamOnBorder: number | null;
  /** Pixels of the seam over the square root of the overlap's: islands and zigzags. */
  seamLength: number;
  /** Share of the seam with a step of colour larger, by more than 3 in CIELAB, than nine tenths of those beside it. */
  visibleSteps: number | null;
  /** The same share of places away from the seam: what edges of the scene alone amount to. */
  stepsElsewhere: number | null;
  /** Share of the target's straight lines that the warp breaks by more than 2 degrees, of those it puts inside the reference. */
  brokenInside: number | null;
  /** The same, of those across the reference's border. */
  brokenAcross: number | null;
  /** The same, of those outside. */
  brokenOutside: number | null;
  /** RMS distance of what lies outside the reference from the best homography, in % of the reference's diagonal. */
  bending: number | null;
}

/** Shares with a step of colour larger, by more than 3 in CIELAB, than nine tenths of those beside it. */
export interface VisibleSteps {
  /** Of all seams. */
  seam: number | null;
  /** Of places away from them. */
  elsewhere: number | null;
}

/** Straight lines of a photo. */
export interface LineBreaks {
  lines: number;
  /** Those that the map breaks by more than 2 degrees. */
  broken: number;
}
