//! From matches to the fundamental matrix and its inliers.

use super::fundamental::{COARSE, FINE, Fundamental, FundamentalEstimator, PlaneAndParallax};
use super::refine::refine_robustly;
use super::seven_point::SAMPLE;
use crate::geometry::correspondences::{Correspondences, ProjectionMatrix};
use crate::geometry::ransac::local_optimisation::anneal;
use crate::geometry::ransac::score::{Scales, count, inlier_errors, inliers_of, squared_errors};
use crate::geometry::ransac::{Config, Found, ransac};
use crate::sampler::Sampler;
use crate::statistics::{NORMAL_MEDIAN, meaningful_consensus, median};

/// The fundamental matrix and the matches that agree with it.
#[derive(Debug, Clone)]
pub(super) struct Epipolar {
    pub fundamental: Fundamental,
    pub inliers: Vec<bool>,
    /// The threshold of the inliers, normalised.
    pub threshold: f64,
    /// Standard deviation of the inliers' distances, normalised.
    pub sigma: f64,
    pub trials: u32,
}

/// Least standard deviation of a match, in pixels: smaller errors are rounding.
const MIN_SIGMA: f64 = 0.05;

/// Fewest and most independent searches. The cost often has several minima of about the same depth, and one search ends in this or that, by its
/// seed. Of 110 real pairs, four seeds change the outline or the warnings of 20, but of 31 with one search; eight searches of every pair
/// leave 20 as well.
const SEARCHES: [usize; 2] = [3, 20];
/// Matches times searches, between these: of few matches a search takes little time.
const MATCHES_SEARCHED: usize = 4000;

/// Two matches off the plane determine the epipole; twice as many, as the plane adapts within the noise of its own matches.
const EPIPOLE: usize = 4;

impl Epipolar {
    /// Whether the inliers differ from their images by the homography of a `plane` by more than from their epipolar lines,
    /// and by more than a choice of that many matches and parameters explains. `pixel` is one in the points' coordinates,
    /// `chance` the probability that an outlier is within the threshold.
    ///
    /// With σ from the distances to the lines, an inlier contributes the difference of both min(r²/σ², 9); one more direction
    /// of noise makes that 1 on average with variance 2. Matches far off the plane count only if there are more of them on
    /// the lines than the best of all epipoles finds among outliers.
    pub fn shows_parallax(&self, points: &Correspondences, plane: &ProjectionMatrix, pixel: f64, chance: f64) -> bool {
        /// Three standard deviations, squared.
        const CAP: f64 = 9.0;
        /// More than noise in two directions.
        const FAR: f64 = 18.0;
        /// σ is underestimated, as the lines were fitted to the matches. Tuned on flat scenes.
        const CORRECTION: f64 = 1.3;
        let sigma = self.sigma.max(MIN_SIGMA * pixel);
        let (mut near, mut far, mut gain, mut far_gain, mut off) = (0, 0, 0.0, 0.0, 0);
        let lines = squared_errors(points, &self.fundamental);
        for ((line, point), inlier) in lines.iter().zip(squared_errors(points, plane)).zip(&self.inliers) {
            // Half of a squared transfer error, as both points share a Sampson distance.
            let [line, point] = [*line, 0.5 * point].map(|e| e / (sigma * sigma));
            let gained = point.min(CAP) - line.min(CAP);
            off += usize::from(point > FAR);
            match (*inlier, point > FAR) {
                (true, true) => (far, far_gain) = (far + 1, far_gain + gained),
                (true, false) => (near, gain) = (near + 1, gain + gained),
                _ => {}
            }
        }
        if far > EPIPOLE && far >= meaningful_consensus(off, EPIPOLE, chance) {
            (near, gain) = (near + far, gain + far_gain);
        }
        let n = f64::from(near as u32);
        gain > CORRECTION * n + 3.0 * (2.0 * n).sqrt() + 3.0 * libm::log((2.0 * n).max(1.0))
    }
}

/// The matrix that a search found, and the same refined.
type Start = [Fundamental; 2];

/// Robust searches by plane and parallax, if there is a dominant plane, and by seven matches; the one of least cost is refined.
///
/// `None` if no sample gave a matrix.
pub(super) fn search(
    points: &Correspondences,
    plane: Option<&ProjectionMatrix>,
    config: &Config,
    sampler: &mut Sampler,
) -> Option<Epipolar> {
    if points.len() <= SAMPLE {
        return None;
    }
    let off_plane = plane.map(|plane| {
        let on_plane = inliers_of(points, plane, config.scales.narrowest());
        let off: Vec<usize> = (0..points.len()).filter(|&i| !on_plane[i]).collect();
        (PlaneAndParallax(plane.fixed_columns::<3>(0).into_owned()), off)
    });
    let all: Vec<usize> = (0..points.len()).collect();
    let mut trials = 0;
    let starts = (0..(MATCHES_SEARCHED / points.len()).clamp(SEARCHES[0], SEARCHES[1])).filter_map(|_| {
        let mut found = Found::none();
        if let Some((estimator, off)) = &off_plane {
            found = ransac(estimator, points, off, config, sampler, found);
        }
        found = ransac(&FundamentalEstimator, points, &all, config, sampler, found);
        trials += found.trials;
        let found = found.model?;
        let refined = refine_narrowing(points, &found, &narrowing(&config.scales), COARSE);
        let cost = config.scales.cost(points, &refined, f64::INFINITY);
        Some(([found, refined], cost))
    });
    let (best, _) = starts.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    let refined = refine_inliers(points, best, &config.scales)?;
    Some(Epipolar { trials, ..refined })
}

/// Supports of the cost from wide to narrow: a matrix that is somewhat off still gets to the right minimum.
fn narrowing(scales: &Scales) -> [f64; 3] {
    let wide = scales.widest();
    [4.0 * wide, 2.0 * wide, wide]
}

/// Refines with one support after the other.
fn refine_narrowing(points: &Correspondences, start: &Fundamental, supports: &[f64], tolerance: f64) -> Fundamental {
    supports.iter().fold(*start, |f, support| refine_robustly(points, &f, *support, tolerance))
}

/// Refines down to the threshold that the inliers' own standard deviation implies.
///
/// Lens distortion moves points far from the centre off the epipolar lines that suit all others best. So refinement may also
/// start from a wider threshold; if that adds half as many inliers again as a minimal sample, all within the widest
/// threshold stay.
///
/// A smooth cost takes the place of inliers, a wide one first: where a set of inliers no longer changes depends on where refinement
/// started, and so on the seed.
fn refine_inliers(points: &Correspondences, [found, refined]: Start, scales: &Scales) -> Option<Epipolar> {
    const ITERATIONS: usize = 3;
    /// From what distance on matches are all the same, in thresholds: 4.5 standard deviations, at which Tukey's biweight is nearly as
    /// efficient as least squares.
    const SUPPORT: f64 = 1.5;
    let wide = scales.widest();
    // So far it was refined just enough to be compared.
    let strict = refine_robustly(points, &refined, wide, FINE);
    let lenient = anneal(&FundamentalEstimator, points, &found, narrowing(scales), ITERATIONS, COARSE);
    let [near, far] = [&strict, &lenient].map(|f| inlier_errors(points, f, wide));
    let distorted = far.len() > near.len() + SAMPLE * 3 / 2;
    let (start, errors) = if distorted { (lenient, far) } else { (strict, near) };
    let sigma = median(errors)?.sqrt() / NORMAL_MEDIAN;
    let threshold = if distorted { wide } else { (3.0 * sigma).max(0.03 * wide).min(wide) };
    // What is distorted is to keep its weight.
    let supports = if distorted { &[3.0 * wide][..] } else { &[2.0 * SUPPORT * threshold, SUPPORT * threshold] };
    let fundamental = refine_narrowing(points, &start, supports, FINE);
    let inliers = inliers_of(points, &fundamental, threshold);
    if count(inliers.iter().copied()) <= SAMPLE {
        return None;
    }
    Some(Epipolar { fundamental, inliers, threshold, sigma, trials: 0 })
}
