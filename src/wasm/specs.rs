//! Generated from `js/options.ts` by `npm run generate`.

/// What is known about one option.
pub(super) struct Spec {
    /// As JavaScript spells it.
    pub name: &'static str,
    /// What is accepted, for messages.
    pub expected: &'static str,
    /// The smallest number accepted.
    pub min: f64,
    /// The largest number accepted.
    pub max: f64,
    /// The words accepted.
    pub choices: &'static [&'static str],
}

pub(super) const MODE: Spec =
    Spec { name: "mode", expected: "'default' or 'paper'", min: 0.0, max: 0.0, choices: &["default", "paper"] };
pub(super) const MATCH_SIZE: Spec =
    Spec { name: "matchSize", expected: "an integer from 0 to 65535", min: 0.0, max: 65535.0, choices: &[] };
pub(super) const MAX_KEYPOINTS: Spec =
    Spec { name: "maxKeypoints", expected: "an integer from 1 to 100000", min: 1.0, max: 100000.0, choices: &[] };
pub(super) const CONTRAST_THRESHOLD: Spec =
    Spec { name: "contrastThreshold", expected: "a number from 0 to 1", min: 0.0, max: 1.0, choices: &[] };
pub(super) const EDGE_THRESHOLD: Spec =
    Spec { name: "edgeThreshold", expected: "a number of at least 1", min: 1.0, max: f64::MAX, choices: &[] };
pub(super) const ADAPTIVE_CONTRAST: Spec =
    Spec { name: "adaptiveContrast", expected: "true or false", min: 0.0, max: 0.0, choices: &[] };
pub(super) const UPSAMPLE: Spec =
    Spec { name: "upsample", expected: "true or false", min: 0.0, max: 0.0, choices: &[] };
pub(super) const ROOT_SIFT: Spec =
    Spec { name: "rootSift", expected: "true or false", min: 0.0, max: 0.0, choices: &[] };
pub(super) const MATCH_RATIO: Spec =
    Spec { name: "matchRatio", expected: "a number above 0, at most 1", min: 0_f64.next_up(), max: 1.0, choices: &[] };
pub(super) const MUTUAL: Spec = Spec { name: "mutual", expected: "true or false", min: 0.0, max: 0.0, choices: &[] };
pub(super) const GUIDED_MATCHING: Spec =
    Spec { name: "guidedMatching", expected: "true or false", min: 0.0, max: 0.0, choices: &[] };
pub(super) const WITHOUT_DEPTH: Spec = Spec {
    name: "withoutDepth",
    expected: "'two-view' or 'homography'",
    min: 0.0,
    max: 0.0,
    choices: &["two-view", "homography"],
};
pub(super) const ROBUST_FIT: Spec = Spec {
    name: "robustFit",
    expected: "'depth', 'homography' or 'multi-homography'",
    min: 0.0,
    max: 0.0,
    choices: &["depth", "homography", "multi-homography"],
};
pub(super) const THRESHOLD: Spec = Spec {
    name: "threshold",
    expected: "a number above 0, or 'paper'",
    min: 0_f64.next_up(),
    max: f64::MAX,
    choices: &["paper"],
};
pub(super) const CONFIDENCE: Spec = Spec {
    name: "confidence",
    expected: "a number between 0 and 1, exclusive",
    min: 0_f64.next_up(),
    max: 1_f64.next_down(),
    choices: &[],
};
pub(super) const MAX_TRIALS: Spec =
    Spec { name: "maxTrials", expected: "an integer from 1 to 1000000", min: 1.0, max: 1000000.0, choices: &[] };
pub(super) const SEED: Spec =
    Spec { name: "seed", expected: "an integer from 0 to 4294967295", min: 0.0, max: 4294967295.0, choices: &[] };
pub(super) const CALIBRATION: Spec = Spec {
    name: "calibration",
    expected: "'auto', 'always' or 'off'",
    min: 0.0,
    max: 0.0,
    choices: &["auto", "always", "off"],
};
pub(super) const FOCAL_LENGTH: Spec =
    Spec { name: "focalLength", expected: "a number of at least 0", min: 0.0, max: f64::MAX, choices: &[] };
pub(super) const REFINEMENT: Spec =
    Spec { name: "refinement", expected: "'epipolar' or 'none'", min: 0.0, max: 0.0, choices: &["epipolar", "none"] };
pub(super) const REFINEMENT_RANGE: Spec =
    Spec { name: "refinementRange", expected: "a number of at least 0", min: 0.0, max: f64::MAX, choices: &[] };
pub(super) const WARP_MODE: Spec = Spec {
    name: "warpMode",
    expected: "'forward', 'backward', 'backward+void', 'optimal' or 'soft'",
    min: 0.0,
    max: 0.0,
    choices: &["forward", "backward", "backward+void", "optimal", "soft"],
};
pub(super) const GRID_COLUMNS: Spec =
    Spec { name: "gridColumns", expected: "an integer from 0 to 65535", min: 0.0, max: 65535.0, choices: &[] };
pub(super) const GRID_ROWS: Spec =
    Spec { name: "gridRows", expected: "an integer from 0 to 65535", min: 0.0, max: 65535.0, choices: &[] };
pub(super) const HOLES: Spec =
    Spec { name: "holes", expected: "'nearest' or 'drop'", min: 0.0, max: 0.0, choices: &["nearest", "drop"] };
pub(super) const VOID_DISTANCE: Spec =
    Spec { name: "voidDistance", expected: "a number above 0", min: 0_f64.next_up(), max: f64::MAX, choices: &[] };
pub(super) const STRETCH_LIMIT: Spec =
    Spec { name: "stretchLimit", expected: "a number above 0", min: 0_f64.next_up(), max: f64::MAX, choices: &[] };
pub(super) const CANVAS_LIMIT: Spec =
    Spec { name: "canvasLimit", expected: "a number from 0 to 100", min: 0.0, max: 100.0, choices: &[] };
pub(super) const PROJECTION: Spec = Spec {
    name: "projection",
    expected: "'auto', 'plane', 'cylinder' or 'sphere'",
    min: 0.0,
    max: 0.0,
    choices: &["auto", "plane", "cylinder", "sphere"],
};
pub(super) const EXPOSURE: Spec = Spec {
    name: "exposure",
    expected: "'field', 'gain' or 'none'",
    min: 0.0,
    max: 0.0,
    choices: &["field", "gain", "none"],
};
pub(super) const SEAM: Spec = Spec {
    name: "seam",
    expected: "'aligned', 'cut' or 'none'",
    min: 0.0,
    max: 0.0,
    choices: &["aligned", "cut", "none"],
};
pub(super) const BLENDING: Spec = Spec {
    name: "blending",
    expected: "'multiband', 'feather' or 'average'",
    min: 0.0,
    max: 0.0,
    choices: &["multiband", "feather", "average"],
};
pub(super) const FEATHER: Spec =
    Spec { name: "feather", expected: "an integer from 0 to 1000", min: 0.0, max: 1000.0, choices: &[] };
pub(super) const BANDS: Spec =
    Spec { name: "bands", expected: "an integer from 0 to 10", min: 0.0, max: 10.0, choices: &[] };
pub(super) const FILL: Spec = Spec {
    name: "fill",
    expected: "'exemplar', 'smooth' or 'none'",
    min: 0.0,
    max: 0.0,
    choices: &["exemplar", "smooth", "none"],
};
pub(super) const FILL_RADIUS: Spec =
    Spec { name: "fillRadius", expected: "an integer from 1 to 64", min: 1.0, max: 64.0, choices: &[] };
pub(super) const FILL_MAX_WIDTH: Spec =
    Spec { name: "fillMaxWidth", expected: "a number from 0 to 100", min: 0.0, max: 100.0, choices: &[] };
pub(super) const MAX_BYTES: Spec =
    Spec { name: "maxBytes", expected: "a number from 1 to 4294967296", min: 1.0, max: 4294967296.0, choices: &[] };
