//! The one error type of the crate: a stable code, the stage it came from, and the numbers behind it.

use std::fmt;

use crate::decimal::{Decimal, Number};

/// A step of the pipeline, named in errors, in progress reports and in the table of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Checking and converting what the caller passed.
    Input,
    /// Keypoints and their descriptors.
    Detect,
    /// Which keypoints belong together.
    Match,
    /// Robust fit and refinement of both models.
    Estimate,
    /// Inverse depth from the photos alone.
    Depth,
    /// Epipolar refinement of the inverse depth.
    Refine,
    /// Forward map, rendering, void recovery, overlap selection.
    Warp,
    /// Putting warped target and reference together.
    Blend,
    /// Filling inner voids of the mosaic.
    Fill,
    /// PSNR, SSIM and coverage.
    Measure,
}

impl Stage {
    /// The name used in JavaScript.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Input => "input",
            Stage::Detect => "detect",
            Stage::Match => "match",
            Stage::Estimate => "estimate",
            Stage::Depth => "depth",
            Stage::Refine => "refine",
            Stage::Warp => "warp",
            Stage::Blend => "blend",
            Stage::Fill => "fill",
            Stage::Measure => "measure",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What can go wrong. Every variant carries the number that was wrong.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An option or value outside its range.
    #[error("{name} must be {expected}, got {}", Number(*value))]
    InvalidArgument {
        /// The option or argument, as JavaScript spells it.
        name: &'static str,
        /// What would have been accepted.
        expected: &'static str,
        /// What was passed.
        value: f64,
    },
    /// An option or value of the wrong type, or a word that is not among the choices.
    #[error("{name} must be {expected}, got {got}")]
    WrongType {
        /// The option or argument, as JavaScript spells it.
        name: &'static str,
        /// What would have been accepted.
        expected: &'static str,
        /// What was passed, described in a word or quoted.
        got: String,
    },
    /// Something that is needed because of what else was passed.
    #[error("{name} is missing: {reason}")]
    Missing {
        /// What was not passed, as JavaScript spells it.
        name: &'static str,
        /// Why it is needed.
        reason: &'static str,
    },
    /// An option that does not exist.
    #[error("there is no option {name}")]
    UnknownOption {
        /// As the caller spelled it.
        name: String,
    },
    /// A photo of which nothing is there.
    #[error("{name} is transparent: none of its {pixels} pixels has an alpha of 128 or more")]
    TransparentPhoto {
        /// The photo.
        name: &'static str,
        /// How many pixels it has.
        pixels: u64,
    },
    /// Something wrong with one of many photos.
    #[error("photos[{index}]: {error}")]
    OfPhoto {
        /// Which one.
        index: usize,
        /// What is wrong.
        error: Box<Error>,
    },
    /// A buffer whose length does not fit its stated size.
    #[error("{name} has {actual} values where its size asks for {expected}")]
    SizeMismatch {
        /// The buffer.
        name: &'static str,
        /// The length that width and height imply.
        expected: u64,
        /// The length found.
        actual: u64,
    },
    /// A picture, mask or map that is not as large as what it belongs to.
    #[error("{name} is {}×{} pixels, expected {}×{}", actual.0, actual.1, expected.0, expected.1)]
    WrongSize {
        /// The picture, mask or map.
        name: &'static str,
        /// The width and height that would fit.
        expected: (usize, usize),
        /// Its own.
        actual: (usize, usize),
    },
    /// Fewer usable matches than the model needs.
    #[error("{usable} of {matches} matches are usable, at least {needed} are needed")]
    TooFewMatches {
        /// Matches passed.
        matches: usize,
        /// Matches left once non-finite, out-of-frame, duplicated and depthless ones are dropped.
        usable: usize,
        /// The least that would do.
        needed: usize,
    },
    /// No model that enough matches agree on.
    #[error(
        "only {inliers} of {matches} matches agree on one geometry, at least {needed} are needed: do the photos show the same scene?"
    )]
    NoConsensus {
        /// Usable matches.
        matches: usize,
        /// Matches that agree with the best model found.
        inliers: usize,
        /// The least that rule out chance.
        needed: usize,
    },
    /// The matches do not determine a map (all in one point, or on one line).
    #[error("the {matches} matches lie on one line or in one point (standard deviation {} px), which determines no map", Decimal(*deviation, 3))]
    DegenerateGeometry {
        /// Usable matches.
        matches: usize,
        /// The smaller standard deviation of the matches' positions, in pixels.
        deviation: f64,
    },
    /// The geometry that the matches agree on has most of the target behind the reference's camera.
    #[error("{} % of the target would be behind the reference's camera", Decimal(100.0 * *behind, 0))]
    BehindCamera {
        /// Share of the target.
        behind: f64,
    },
    /// The warped target does not touch the reference.
    #[error("the warped target covers {pixels} pixels of the reference")]
    NoOverlap {
        /// Reference pixels covered.
        pixels: u64,
    },
    /// A picture or canvas above the memory limit, refused before anything is allocated.
    #[error("{width}×{height} pixels would take {bytes} bytes, the limit is {limit}")]
    TooLarge {
        /// Width in pixels.
        width: u64,
        /// Height in pixels.
        height: u64,
        /// Predicted bytes.
        bytes: u64,
        /// The limit in force.
        limit: u64,
    },
    /// The allocator refused.
    #[error("could not allocate {bytes} bytes")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: u64,
    },
    /// A file that is no picture, or a damaged one.
    #[error("could not decode the {bytes} bytes: {reason}")]
    DecodeFailed {
        /// Length of the file.
        bytes: u64,
        /// The decoder's own words.
        reason: String,
    },
    /// The caller asked to stop.
    #[error("stopped by the caller")]
    Aborted,
}

/// `std::result::Result` with this crate's [`Error`], boxed: errors are rare, and what every call returns should be small.
pub type Result<T> = std::result::Result<T, Box<Error>>;

impl Error {
    /// Says which of many photos an error is about.
    pub(crate) fn of_photo(index: usize) -> impl FnOnce(Box<Error>) -> Box<Error> {
        move |error| Error::OfPhoto { index, error }.into()
    }

    /// The stable code, the same in Rust and JavaScript.
    pub fn code(&self) -> &'static str {
        match self {
            Error::InvalidArgument { .. }
            | Error::WrongType { .. }
            | Error::Missing { .. }
            | Error::UnknownOption { .. }
            | Error::TransparentPhoto { .. } => "invalid-argument",
            Error::OfPhoto { error, .. } => error.code(),
            Error::SizeMismatch { .. } | Error::WrongSize { .. } => "size-mismatch",
            Error::TooFewMatches { .. } => "too-few-matches",
            Error::NoConsensus { .. } => "no-consensus",
            Error::DegenerateGeometry { .. } | Error::BehindCamera { .. } => "degenerate-geometry",
            Error::NoOverlap { .. } => "no-overlap",
            Error::TooLarge { .. } => "too-large",
            Error::OutOfMemory { .. } => "out-of-memory",
            Error::DecodeFailed { .. } => "decode-failed",
            Error::Aborted => "aborted",
        }
    }

    /// The numbers behind the error, by name, for a program to act on.
    pub fn details(&self) -> Vec<(&'static str, f64)> {
        let numbers: &[(&'static str, f64)] = match *self {
            Error::InvalidArgument { value, .. } => &[("value", value)],
            Error::OfPhoto { index, ref error } => {
                let mut numbers = error.details();
                numbers.push(("photo", index as f64));
                return numbers;
            }
            Error::TransparentPhoto { pixels, .. } => &[("pixels", pixels as f64)],
            Error::SizeMismatch { expected, actual, .. } => &[("expected", expected as f64), ("actual", actual as f64)],
            Error::WrongSize { expected, actual, .. } => &[
                ("width", actual.0 as f64),
                ("height", actual.1 as f64),
                ("expectedWidth", expected.0 as f64),
                ("expectedHeight", expected.1 as f64),
            ],
            Error::TooFewMatches { matches, usable, needed } => {
                &[("matches", matches as f64), ("usable", usable as f64), ("needed", needed as f64)]
            }
            Error::NoConsensus { matches, inliers, needed } => {
                &[("matches", matches as f64), ("inliers", inliers as f64), ("needed", needed as f64)]
            }
            Error::DegenerateGeometry { matches, deviation } => {
                &[("matches", matches as f64), ("deviation", deviation)]
            }
            Error::BehindCamera { behind } => &[("behind", behind)],
            Error::NoOverlap { pixels } => &[("pixels", pixels as f64)],
            Error::TooLarge { width, height, bytes, limit } => {
                &[("width", width as f64), ("height", height as f64), ("bytes", bytes as f64), ("limit", limit as f64)]
            }
            Error::OutOfMemory { bytes } => &[("bytes", bytes as f64)],
            Error::DecodeFailed { bytes, .. } => &[("bytes", bytes as f64)],
            Error::WrongType { .. } | Error::Missing { .. } | Error::UnknownOption { .. } | Error::Aborted => &[],
        };
        numbers.to_vec()
    }
}
