//! Self-calibration: the focal length from the pairs of photos, before any camera is known.
//!
//! With the right one, the essential matrix of a pair has two equal singular values (Mendonça & Cipolla 1999), and the
//! homography of a pair that only turned is a rotation. Either hardly constrains it in some pairs, and is wrong in others: hence a weak
//! prior, and a bounded cost of each pair.

use nalgebra::Matrix3;

use super::{Lens, PairLink};
use crate::geometry::calibrated::LOG_FOCAL;
use crate::geometry::eigen::eigenpairs;
use crate::geometry::{Match, Model, ModelKind};
use crate::rect::diagonal;

/// The standard deviation of ln f for given focal lengths: those in a photo's metadata are rounded, and some refer to the width of 35 mm
/// film.
const SET_FOCAL_DEVIATION: f64 = 0.05;
/// Shortest and longest focal length that is tried, in diagonals, and how many.
const RANGE: [f64; 2] = [0.3, 3.0];
const STEPS: u32 = 60;
/// Between the focal lengths to start from. Of a real set without any, bundle adjustment knows minima at 1130, 1310 and 1520 pixels: of
/// mean square errors of 1.4, 4.5 and 1.1 px².
const START_RATIO: f64 = 1.2;
/// Standard deviation of the relative difference of singular values that should be equal.
const GAP: f64 = 0.02;
/// The most that a pair counts, in standard deviations, squared.
const CAP: f64 = 9.0;

/// Focal lengths of a set of photos.
#[derive(Debug, Clone)]
pub(super) struct Focal {
    /// Each photo's, as a share of a common one.
    pub shares: Vec<f64>,
    /// The first estimate of each photo's share, where it is an unknown.
    pub estimates: Vec<Option<f64>>,
    /// The common one, in diagonals.
    pub value: f64,
    /// Mean and standard deviation of the prior of its logarithm.
    pub prior: [f64; 2],
}

impl Focal {
    /// Others to start from, unless it was given, or each photo has its own: then almost anything can be explained.
    pub fn alternatives(&self) -> Vec<Self> {
        let common = self.prior == LOG_FOCAL && self.estimates.iter().all(Option::is_none);
        let factors = [1.0 / START_RATIO, START_RATIO].into_iter().filter(|_| common);
        factors.map(|factor| Self { value: self.value * factor, ..self.clone() }).collect()
    }

    /// Those of two photos, in their diagonals.
    pub fn of(&self, photos: [usize; 2]) -> [f64; 2] {
        photos.map(|photo| self.value * self.shares[photo])
    }
}

/// The focal length of the photos: as given, where any is; otherwise one for all, as a share of the diagonal.
pub(super) fn calibrate(lenses: &[Lens], links: &[PairLink]) -> Focal {
    let estimates = vec![None; lenses.len()];
    let known: Vec<f64> = lenses.iter().filter_map(|lens| lens.focal.map(|f| f / diagonal(lens.size))).collect();
    if let Some(value) = crate::statistics::median(known) {
        let share = |lens: &Lens| lens.focal.map_or(1.0, |f| f / diagonal(lens.size) / value);
        let prior = [libm::log(value), SET_FOCAL_DEVIATION];
        return Focal { shares: lenses.iter().map(share).collect(), estimates, value, prior };
    }
    let shares = vec![1.0; lenses.len()];
    let value = common_focal(lenses, links, &shares);
    Focal { shares, estimates, value, prior: LOG_FOCAL }
}

/// The common focal length in diagonals, of which those of the photos are `shares`.
pub(super) fn common_focal(lenses: &[Lens], links: &[PairLink], shares: &[f64]) -> f64 {
    let models: Vec<_> = links.iter().map(|link| (link, link.centred(lenses))).collect();
    let total: f64 = links.iter().map(|link| (link.matches.len() as f64).sqrt()).sum();
    let mut best = (f64::INFINITY, 1.0);
    let ratio = libm::log(RANGE[1] / RANGE[0]) / f64::from(STEPS);
    for step in 0..=STEPS {
        let log_focal = libm::log(RANGE[0]) + ratio * f64::from(step);
        let f = libm::exp(log_focal);
        let off = (log_focal - LOG_FOCAL[0]) / LOG_FOCAL[1];
        let mut cost = off * off;
        for (link, model) in &models {
            let focals = link.photos.map(|photo| f * shares[photo]);
            let matrix = match link.kind {
                ModelKind::TwoView => essential(model, focals),
                _ => calibrated(&model.h, focals),
            };
            let gap = singular_value_gap(&matrix, link.kind == ModelKind::TwoView) / GAP;
            // The average pair counts twice as much as the prior.
            let weight = 2.0 * (link.matches.len() as f64).sqrt() * models.len() as f64 / total;
            cost += weight * gap * gap / (1.0 + gap * gap / CAP);
        }
        if cost < best.0 {
            best = (cost, f);
        }
    }
    best.1
}

/// The focal length in pixels of the second of two photos, taken with the same lens, by the `model` from the first to it.
pub(crate) fn pair_focal(sizes: [(usize, usize); 2], model: &Model, kind: ModelKind, matches: &[Match]) -> f64 {
    let lenses = sizes.map(|size| Lens { size, focal: None });
    // With any depth the epipolar geometry is the same; the infinite homography is not known.
    let kind = if kind == ModelKind::Homography { kind } else { ModelKind::TwoView };
    let link = PairLink { photos: [0, 1], features: Vec::new(), matches: matches.to_vec(), model: *model, kind };
    calibrate(&lenses, &[link]).value * diagonal(sizes[1])
}

/// The homography of centred coordinates in calibrated ones, K'⁻¹ H K, of focal lengths in diagonals.
pub(super) fn calibrated(h: &Matrix3<f64>, [from, to]: [f64; 2]) -> Matrix3<f64> {
    let mut scaled = *h;
    scaled.column_mut(0).scale_mut(from);
    scaled.column_mut(1).scale_mut(from);
    scaled.row_mut(0).scale_mut(1.0 / to);
    scaled.row_mut(1).scale_mut(1.0 / to);
    scaled
}

/// The essential matrix K'ᵀ [e]× H K of a model of centred coordinates.
pub(super) fn essential(model: &Model, [from, to]: [f64; 2]) -> Matrix3<f64> {
    calibrated(&(model.e.cross_matrix() * model.h), [from, 1.0 / to])
}

/// The relative difference of the two largest singular values, or of the largest and the smallest.
fn singular_value_gap(m: &Matrix3<f64>, two: bool) -> f64 {
    // The eigenvalues of MᵀM are the squares.
    let Some(pairs) = eigenpairs(&(m.transpose() * *m)) else { return 1.0 };
    let [most, middle, least] = pairs.map(|(value, _)| value.max(0.0).sqrt());
    let other = if two { middle } else { least };
    if most > 0.0 { (most - other) / (most + other) } else { 1.0 }
}
