//! One geometry for many photos: cameras, rotations or homographies from the matches of pairs of photos.
//!
//! Focal length from the pairs ([`self_calibration`]), one for all photos or of their own ([`lens_ratios`]), relative poses ([`relative_pose`]), rotation averaging ([`rotations`]),
//! positions one photo after another ([`growth`]), bundle adjustment of all ([`bundle`]), and the distortion of the lens ([`lens`]). Where chained homographies
//! explain everything as well as that ([`homographies`]), they are the geometry: a scene that is flat or far says nothing of
//! cameras.
//!
//! In calibrated coordinates (ray (x, y, 1), w = 1/z) a rigid motion is (x', y', 1, w') ~ [R t; 0 1] (x, y, 1, w); so from photo i
//! to photo j, with X_cam = R X + t, H∞ = K_j R_j R_iᵀ K_i⁻¹ and e' = K_j (t_j − R_j R_iᵀ t_i), d being 1/z in the scale of
//! the translations.

mod baselines;
mod bundle;
mod choice;
mod growth;
mod homographies;
mod jacobian;
mod least_squares;
mod lens;
mod lens_ratios;
mod loops;
mod pairs;
mod relative_pose;
mod resection;
mod residual;
mod rotations;
mod scene;
mod self_calibration;
mod solution;
mod spanning_tree;
mod tracks;

pub use choice::multi_view;
pub(crate) use least_squares::Equations;
pub use scene::Camera;
pub(crate) use self_calibration::pair_focal;
pub use solution::{MultiView, MultiViewKind, ObservedPair};

use nalgebra::{Matrix3, Vector3};

use super::{Match, Model, ModelKind};
use crate::rect::diagonal;

/// A photo and what is known of its lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Width and height in pixels.
    pub size: (usize, usize),
    /// Focal length in pixels, if known to about five per cent.
    pub focal: Option<f64>,
}

impl Lens {
    /// From pixels to coordinates from the photo's centre, in its diagonals.
    fn centred(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [cx, cy] = self.centre();
        let scale = 1.0 / diagonal(self.size);
        [(x - cx) * scale, (y - cy) * scale]
    }

    /// From centred coordinates to pixels.
    fn pixel(&self, place: [f64; 2]) -> [f64; 2] {
        let (centre, scale) = (self.centre(), diagonal(self.size));
        [0, 1].map(|k| scale * place[k] + centre[k])
    }

    /// The principal point in pixels: the middle.
    fn centre(&self) -> [f64; 2] {
        [self.size.0, self.size.1].map(|side| 0.5 * (side as f64 - 1.0))
    }

    /// From centred coordinates, in diagonals, to pixels.
    fn to_pixels(self) -> Matrix3<f64> {
        let ([cx, cy], scale) = (self.centre(), diagonal(self.size));
        Matrix3::new(scale, 0.0, cx, 0.0, scale, cy, 0.0, 0.0, 1.0)
    }

    /// From pixels to centred coordinates.
    fn to_centred(self) -> Matrix3<f64> {
        let ([cx, cy], scale) = (self.centre(), 1.0 / diagonal(self.size));
        Matrix3::new(scale, 0.0, -scale * cx, 0.0, scale, -scale * cy, 0.0, 0.0, 1.0)
    }

    /// The calibration matrix K of a focal length in diagonals, and its inverse.
    fn calibration(&self, focal: f64) -> [Matrix3<f64>; 2] {
        let scaled = |f: f64| Matrix3::from_diagonal(&Vector3::new(f, f, 1.0));
        [(self.to_pixels() * scaled(focal)), (scaled(1.0 / focal) * self.to_centred())]
    }
}

/// A verified pair of photos: an edge of the pair graph.
#[derive(Debug, Clone, PartialEq)]
pub struct PairLink {
    /// Indices of both photos, ascending.
    pub photos: [usize; 2],
    /// The features of each inlier in both photos: what ties pairs together to tracks.
    pub features: Vec<[u32; 2]>,
    /// The same by position in pixels.
    pub matches: Vec<Match>,
    /// First to second photo.
    pub model: Model,
    /// [`ModelKind::TwoView`], or a homography.
    pub kind: ModelKind,
}

impl PairLink {
    /// The model in centred coordinates of both photos.
    fn centred(&self, lenses: &[Lens]) -> Model {
        let [a, b] = self.photos.map(|photo| &lenses[photo]);
        let to = b.to_centred();
        Model { h: (to * (self.model.h * a.to_pixels())), e: to * self.model.e }
    }

    /// The matches in centred coordinates.
    fn centred_matches(&self, lenses: &[Lens]) -> Vec<[[f64; 2]; 2]> {
        let [a, b] = self.photos.map(|photo| &lenses[photo]);
        self.matches.iter().map(|m| [a.centred(m.target), b.centred(m.reference)]).collect()
    }
}
