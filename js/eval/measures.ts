/** Median and 90th percentile in pixels. */
export type ErrorSummary = readonly [median: number, p90: number];

/**
 * What is measured together: of the overlap, of what a person sees, of two seeds, of a hidden part, by a network; of a set of
 * photos, and of one photo of it that was left out.
 */
export type Group = "overlap" | "look" | "stability" | "hidden" | "lpips" | "set" | "leaveOut";

interface Measure {
  readonly group: Group;
  /** Of its column in the table, or of both columns of an error. */
  readonly headings: readonly [string] | readonly [median: string, p90: string];
  /** Decimals in the table. */
  readonly digits: number;
  /** Which of two values is the better one. */
  readonly better: "higher" | "lower" | null;
}

/** Every measure by its name in a row, in the order of the table's columns. */
export const MEASURES = {
  psnr_bbox: { group: "overlap", headings: ["psnr_bbox"], digits: 2, better: "higher" },
  ssim_bbox: { group: "overlap", headings: ["ssim_bbox"], digits: 3, better: "higher" },
  psnr_mask: { group: "overlap", headings: ["psnr_mask"], digits: 2, better: "higher" },
  ssim_mask: { group: "overlap", headings: ["ssim_mask"], digits: 3, better: "higher" },
  cover: { group: "overlap", headings: ["cover"], digits: 3, better: "higher" },
  matches: { group: "overlap", headings: ["matches"], digits: 0, better: null },
  inliers: { group: "overlap", headings: ["inliers"], digits: 0, better: null },
  error_inside: { group: "overlap", headings: ["in med", "in p90"], digits: 2, better: "lower" },
  error_outside: { group: "overlap", headings: ["out med", "out p90"], digits: 2, better: "lower" },
  border_voids: { group: "look", headings: ["void_bord"], digits: 3, better: "lower" },
  overlap_voids: { group: "look", headings: ["void_all"], digits: 3, better: "lower" },
  seam_on_border: { group: "look", headings: ["seam_bord"], digits: 3, better: "lower" },
  seam_length: { group: "look", headings: ["seam_len"], digits: 2, better: "lower" },
  visible_steps: { group: "look", headings: ["steps"], digits: 3, better: "lower" },
  steps_elsewhere: { group: "look", headings: ["elsewhere"], digits: 3, better: null },
  broken_inside: { group: "look", headings: ["brk_in"], digits: 3, better: "lower" },
  broken_across: { group: "look", headings: ["brk_cross"], digits: 3, better: "lower" },
  broken_outside: { group: "look", headings: ["brk_out"], digits: 3, better: "lower" },
  bending: { group: "look", headings: ["bending"], digits: 3, better: "lower" },
  instability: { group: "stability", headings: ["unstable"], digits: 3, better: "lower" },
  hidden_psnr: { group: "hidden", headings: ["hid_psnr"], digits: 2, better: "higher" },
  hidden_ssim: { group: "hidden", headings: ["hid_ssim"], digits: 3, better: "higher" },
  hidden_shown: { group: "hidden", headings: ["shown"], digits: 3, better: "higher" },
  hidden_shift: { group: "hidden", headings: ["hid med", "hid p90"], digits: 2, better: "lower" },
  lpips: { group: "lpips", headings: ["lpips"], digits: 3, better: "lower" },
  photos_used: { group: "set", headings: ["used"], digits: 0, better: "higher" },
  photos_missing: { group: "set", headings: ["missing"], digits: 0, better: "lower" },
  rotation_error: { group: "set", headings: ["rot_deg"], digits: 3, better: "lower" },
  direction_error: { group: "set", headings: ["dir_deg"], digits: 2, better: "lower" },
  focal_error: { group: "set", headings: ["focal_%"], digits: 2, better: "lower" },
  landing_shared: { group: "set", headings: ["in med", "in p90"], digits: 2, better: "lower" },
  landing_alone: { group: "set", headings: ["out med", "out p90"], digits: 2, better: "lower" },
  all_steps: { group: "set", headings: ["steps"], digits: 3, better: "lower" },
  all_steps_elsewhere: { group: "set", headings: ["elsewhere"], digits: 3, better: null },
  all_broken: { group: "set", headings: ["broken"], digits: 3, better: "lower" },
  left_out_ssim: { group: "leaveOut", headings: ["left_ssim"], digits: 3, better: "higher" },
  left_out_shown: { group: "leaveOut", headings: ["shown"], digits: 3, better: "higher" },
  left_out_shift: {
    group: "leaveOut",
    headings: ["left med", "left p90"],
    digits: 2,
    better: "lower",
  },
} as const satisfies Record<string, Measure>;

export type MeasureName = keyof typeof MEASURES;
export const MEASURE_NAMES = Object.keys(MEASURES) as MeasureName[];

/** The value of every measure; null where it could not be, or was not, measured. */
export type Values = {
  readonly [K in MeasureName]:
    | ((typeof MEASURES)[K]["headings"] extends readonly [string, string] ? ErrorSummary : number)
    | null;
};

/** No value at all. */
export const UNMEASURED = Object.fromEntries(MEASURE_NAMES.map((name) => [name, null])) as Values;
