//! Keypoints, their descriptors, and matches between two photos.
//!
//! D. Lowe, *Distinctive Image Features from Scale-Invariant Keypoints*, IJCV 60 (2004), with the number of keypoints
//! fitted to what the photo has to offer.

mod approximation;
mod descriptor;
mod detect;
mod extrema;
mod guided;
mod line_segments;
mod luma;
mod matching;
mod nearest;
mod orientation;
mod scale_space;
mod selection;
mod tracking;

pub use descriptor::LENGTH;
pub use detect::detect;
pub(crate) use detect::reduced;
pub use guided::{Guide, match_guided};
pub use line_segments::{LineSegment, LineSegmentOptions, line_segments};
pub use matching::{match_features, matches_of};
pub use tracking::track;

/// A place of the photo that is found again from another viewpoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// In pixels of the photo.
    pub x: f32,
    /// In pixels of the photo.
    pub y: f32,
    /// Deviation of the Gaussian at whose scale it stands out, in pixels of the photo.
    pub scale: f32,
    /// Dominant direction of the gradient, in radians from x towards y, at least 0 and less than 2π.
    pub angle: f32,
    /// Contrast: how far the difference of Gaussians is from zero, in grey levels of 0 to 255.
    pub response: f32,
}

/// What was found in one photo.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    /// Sorted by y, x, scale, angle. One place may have several directions, one keypoint each.
    pub keypoints: Vec<Keypoint>,
    /// The descriptor of each keypoint: 4×4 cells of 8 directions.
    pub descriptors: Vec<[u8; LENGTH]>,
    /// Width and height of the photo.
    pub size: (usize, usize),
}

/// Options of [`detect`].
#[derive(Debug, Clone, PartialEq)]
pub struct DetectOptions {
    /// Most places to keep. (Some have two or more directions.)
    pub max_keypoints: usize,
    /// Least contrast, for grey levels 0 to 1 and summed over the three scales of an octave as in OpenCV.
    pub contrast_threshold: f64,
    /// Largest ratio of the principal curvatures.
    pub edge_threshold: f64,
    /// Whether the photo is doubled in size first, which finds about four times as many.
    pub upsample: bool,
    /// RootSIFT: compare the roots of the histograms, which lets no large value dominate.
    pub root: bool,
    /// Whether the contrast threshold is lowered where there are too few.
    pub adaptive: bool,
    /// The longer side in pixels above which the photo is made smaller first; 0 for no limit.
    pub max_size: usize,
    /// Most bytes that may be taken.
    pub max_bytes: u64,
}

impl Default for DetectOptions {
    fn default() -> Self {
        Self {
            max_keypoints: 8000,
            contrast_threshold: 0.04,
            edge_threshold: 10.0,
            upsample: true,
            root: true,
            adaptive: true,
            max_size: 1600,
            max_bytes: 1 << 31,
        }
    }
}

/// Options of [`match_features`] and [`match_guided`].
#[derive(Debug, Clone, PartialEq)]
pub struct MatchOptions {
    /// The nearest descriptor has to be nearer than the second nearest by this factor.
    pub ratio: f64,
    /// Whether each of two has to be the other's nearest.
    pub mutual: bool,
    /// Largest distance of two descriptors, as vectors of unit length: 0 of the same, √2 of those that share nothing.
    /// Under a guide, which leaves few others for the ratio to compare with, this has to tell right from wrong: 0.5.
    pub max_distance: f64,
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self { ratio: 0.75, mutual: true, max_distance: 0.7 }
    }
}

/// Two keypoints that look alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    /// Index in the target's features.
    pub target: u32,
    /// Index in the reference's features.
    pub reference: u32,
}
