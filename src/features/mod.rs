//! SIFT keypoints, their descriptors, matches between two photos, and tracking.
//!
//! D. Lowe, *Distinctive Image Features from Scale-Invariant Keypoints*, IJCV 60 (2004), with a contrast threshold that adapts
//! to the photo.

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
mod walsh;

pub use descriptor::DESCRIPTOR_LENGTH;
pub use detect::detect;
pub(crate) use detect::reduced;
pub(crate) use guided::match_again;
pub use guided::{MatchGuide, match_guided};
pub(crate) use line_segments::join_collinear;
pub use line_segments::{LineSegment, LineSegmentOptions, line_segments};
pub(crate) use luma::{Luma, luma, visible_luma};
pub use matching::{match_features, matches_of};
pub(crate) use tracking::align_patch;
pub use tracking::track;

use std::cmp::Ordering;

use crate::Result;
use crate::image::{indices, reserve};
use crate::sort::sort_indices;

/// A distinctive place of a photo: an extremum of the difference of Gaussians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// In pixels of the photo.
    pub x: f32,
    /// In pixels of the photo.
    pub y: f32,
    /// Scale: standard deviation of the Gaussian, in pixels of the photo.
    pub scale: f32,
    /// Orientation of the gradient in radians, from x towards y, at least 0 and less than 2π.
    pub angle: f32,
    /// Contrast: absolute value of the difference of Gaussians, in gray levels of 0 to 255.
    pub response: f32,
}

/// Keypoints and descriptors of one photo.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    /// Keypoints by decreasing response, those of equal response by y, x, scale, angle. One place may have several
    /// orientations, one keypoint each.
    pub keypoints: Vec<Keypoint>,
    /// The descriptor of each keypoint: 4×4 cells of 8 directions.
    pub descriptors: Vec<[u8; DESCRIPTOR_LENGTH]>,
    /// Width and height of the photo.
    pub size: (usize, usize),
}

impl Keypoint {
    /// Order by y, x, scale, angle.
    fn by_place(&self, other: &Self) -> Ordering {
        let key = |k: &Self| [k.y, k.x, k.scale, k.angle];
        let differing = key(self).into_iter().zip(key(other)).map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne());
        differing.unwrap_or(Ordering::Equal)
    }
}

impl Features {
    /// The features with these indices.
    fn permuted(&self, order: &[u32]) -> Result<Self> {
        let (mut keypoints, mut descriptors) = (Vec::new(), Vec::new());
        reserve(&mut keypoints, order.len())?;
        reserve(&mut descriptors, order.len())?;
        keypoints.extend(order.iter().map(|&i| self.keypoints[i as usize]));
        descriptors.extend(order.iter().map(|&i| self.descriptors[i as usize]));
        Ok(Self { keypoints, descriptors, size: self.size })
    }

    /// The features ordered by place, and the index that each has here.
    fn ordered_by_place(&self) -> Result<(Self, Vec<u32>)> {
        let mut order = indices(self.keypoints.len())?;
        let at = |i: u32| &self.keypoints[i as usize];
        sort_indices(&mut order, &|a, b| at(a).by_place(at(b)).then(a.cmp(&b)));
        Ok((self.permuted(&order)?, order))
    }
}

/// Options of [`detect`].
#[derive(Debug, Clone, PartialEq)]
pub struct DetectOptions {
    /// Largest number of places. Some have two or more orientations, and give as many keypoints.
    pub max_keypoints: usize,
    /// Least contrast, for gray levels 0 to 1 and summed over the three scales of an octave as in OpenCV.
    pub contrast_threshold: f64,
    /// Largest ratio of the principal curvatures.
    pub edge_threshold: f64,
    /// Whether the photo is doubled in size first, which finds about four times as many keypoints.
    pub upsample: bool,
    /// RootSIFT: descriptors are square roots of the histograms, so that no large value dominates a distance.
    pub root: bool,
    /// Whether the contrast threshold is lowered where there are too few keypoints.
    pub adaptive: bool,
    /// Longer side in pixels above which the photo is reduced first; 0 for no limit.
    pub max_size: usize,
    /// Memory limit in bytes.
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
    /// Ratio test: the nearest descriptor's distance must be less than this times the second nearest one's.
    pub ratio: f64,
    /// Whether each of the two must be the other's nearest neighbour.
    pub mutual: bool,
    /// Largest distance between descriptors, as unit vectors: 0 if they are equal, √2 if they are orthogonal. The pipeline uses
    /// the same limit for guided matching.
    pub max_distance: f64,
}

impl Default for MatchOptions {
    fn default() -> Self {
        Self { ratio: 0.75, mutual: true, max_distance: 0.7 }
    }
}

/// Two matching keypoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    /// Index in the target's features.
    pub target: u32,
    /// Index in the reference's features.
    pub reference: u32,
}
