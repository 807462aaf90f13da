//! From matches to the fundamental matrix and its inliers.

use super::fundamental::{Fundamental, cross_matrix, epipole};
use super::refine::refine;
use super::seven_point::{SAMPLE, seven_point};
use crate::geometry::errors::{Scales, count, errors, inliers_of, inlying};
use crate::geometry::points::{Point, Points, Projection};
use crate::geometry::ransac::Search;
use crate::geometry::vectors::{apply, cross, dot};
use crate::sampler::Sampler;
use crate::statistics::{meaningful_consensus, median};

/// The fundamental matrix and the matches that agree with it.
#[derive(Debug, Clone)]
pub(super) struct Epipolar {
    pub fundamental: Fundamental,
    pub inliers: Vec<bool>,
    /// What chose the inliers, normalised.
    pub threshold: f64,
    /// Standard deviation of the inliers' distances, normalised.
    pub sigma: f64,
    pub trials: u32,
}

/// Error of the best localised matches, in pixels: what is smaller is rounding.
const FINEST: f64 = 0.05;

impl Epipolar {
    /// Whether the inliers miss what `plane` maps them to by more than they miss the epipolar lines, and by more than a
    /// choice of that many matches and numbers explains. `pixel` is one in the points' coordinates, `chance` that a wrong
    /// match is an inlier.
    ///
    /// With σ from the distances to the lines, each inlier gains min(r²/σ², 9) of both; one direction more makes that 1 on
    /// average with the variance 2. Those far off the plane count only when there are more of them on the lines than the
    /// best of all epipoles finds among wrong matches.
    #[inline(never)]
    pub fn shows_parallax(&self, points: &Points, plane: &Projection, pixel: f64, chance: f64) -> bool {
        const CAP: f64 = 9.0;
        const FAR: f64 = 18.0;
        // σ comes out small, as the lines were fitted to the matches.
        const SLACK: f64 = 1.3;
        let sigma = self.sigma.max(FINEST * pixel);
        let (mut near, mut far, mut gain, mut far_gain, mut off) = (0, 0, 0.0, 0.0, 0);
        let lines = errors(points, &self.fundamental);
        for ((line, point), inlier) in lines.iter().zip(errors(points, plane)).zip(&self.inliers) {
            // Half of a squared transfer error, as a Sampson distance is shared by both points.
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
        gain > SLACK * n + 3.0 * (2.0 * n).sqrt() + 3.0 * libm::log((2.0 * n).max(1.0))
    }
}

/// Two matches off the plane fix the epipole; as many again, as the plane gives way within the noise of its own matches.
const EPIPOLE: usize = 4;

/// The least number of samples: among the clean ones most tell little, on one plane as their matches may be.
const LEAST_TRIALS: f64 = 200.0;
const COARSE: f64 = 1e-2;
const FINE: f64 = 1e-9;

/// The best-so-far matrix, refined on its inliers whenever it gets better (Chum, Matas & Kittler 2003).
struct Best<'a> {
    points: &'a Points,
    scales: Scales,
    fundamental: Option<Fundamental>,
    cost: f64,
}

impl Best<'_> {
    /// Whether `f` is better than what there was.
    #[inline(never)]
    fn offer(&mut self, f: Fundamental) -> bool {
        let sampled = self.scales.cost(self.points, &f, self.cost);
        if sampled >= self.cost || sampled.is_nan() {
            return false;
        }
        (self.fundamental, self.cost) = (Some(f), sampled);
        for threshold in self.scales.0 {
            let Some(f) = self.fundamental else { break };
            let inliers = inliers_of(self.points, &f, threshold);
            if count(&inliers) < SAMPLE + 1 {
                continue;
            }
            let local = refine(&self.points.select(&inliers), &f, COARSE);
            let refined = self.scales.cost(self.points, &local, self.cost);
            if refined < self.cost {
                (self.fundamental, self.cost) = (Some(local), refined);
            }
        }
        true
    }

    /// The share of inliers among these matches.
    #[inline(never)]
    fn share(&self, among: &[usize]) -> f64 {
        let Some(f) = self.fundamental else { return 0.0 };
        let inliers = inliers_of(self.points, &f, self.scales.narrowest());
        among.iter().filter(|&&i| inliers[i]).count() as f64 / among.len() as f64
    }
}

/// Random search by seven matches, and by the dominant plane, when there is one, with two matches off it: where most
/// matches lie on one plane hardly any seven tell more than the plane (Chum, Werner & Matas 2005).
///
/// `None` when no sample gave a matrix.
#[inline(never)]
pub(super) fn search(
    points: &Points,
    plane: Option<&Projection>,
    search: &Search,
    sampler: &mut Sampler,
) -> Option<Epipolar> {
    let n = points.len();
    if n < SAMPLE + 1 {
        return None;
    }
    let mut best = Best { points, scales: search.scales, fundamental: None, cost: f64::INFINITY };
    let mut trials = 0;
    if let Some(plane) = plane {
        let limit = search.scales.narrowest();
        let off: Vec<usize> =
            errors(points, plane).into_iter().enumerate().filter(|(_, e)| *e > limit * limit).map(|(i, _)| i).collect();
        let h = plane.map(|row| [row[0], row[1], row[2]]);
        // The line that a match and its image by the plane span goes through the epipole.
        let line = |i: usize| {
            let Point { x, y, u, v, .. } = points[i];
            cross([u, v, 1.0], apply(&h, [x, y, 1.0]))
        };
        let mut needed = f64::from(search.max_trials);
        let mut drawn = 0.0;
        while drawn < needed && off.len() >= 2 {
            drawn += 1.0;
            let mut pair = [0; 2];
            sampler.sample(off.len(), &mut pair);
            let [a, b] = pair.map(|i| line(off[i]));
            if best.offer(cross_matrix(cross(a, b), &h)) {
                needed = search.needed(best.share(&off), 2, LEAST_TRIALS);
            }
        }
        trials += drawn as u32;
    }
    let all: Vec<usize> = (0..n).collect();
    let mut needed = search.needed(best.share(&all), SAMPLE, LEAST_TRIALS);
    let mut drawn = 0.0;
    while drawn < needed {
        drawn += 1.0;
        let mut sample = [0; SAMPLE];
        sampler.sample(n, &mut sample);
        for f in seven_point(points, sample) {
            if oriented(points, &sample, &f) && best.offer(f) {
                needed = search.needed(best.share(&all), SAMPLE, LEAST_TRIALS);
            }
        }
    }
    trials += drawn as u32;
    let settled = settled(points, best.fundamental?, &search.scales)?;
    Some(Epipolar { trials, ..settled })
}

/// Whether all of the sample lie on the same side of both cameras (Chum, Werner & Matas 2004).
#[inline(never)]
fn oriented(points: &Points, sample: &[usize], f: &Fundamental) -> bool {
    let Some(e) = epipole(f) else { return false };
    let side = |i: &usize| {
        let Point { x, y, u, v, .. } = points[*i];
        dot(apply(f, [x, y, 1.0]), cross(e, [u, v, 1.0])) > 0.0
    };
    let ahead = sample.iter().filter(|i| side(i)).count();
    ahead == 0 || ahead == sample.len()
}

/// Least squares and choice of inliers in turns, down to what the inliers' own scale tells. A lens that bends straight lines
/// makes what is far from the middle miss the epipolar lines that suit all others best. So the matrix may begin with those
/// that miss by more: where that brings in half as many again as a sample, all that are within the widest threshold stay.
#[inline(never)]
fn settled(points: &Points, f: Fundamental, scales: &Scales) -> Option<Epipolar> {
    let wide = scales.widest();
    let strict = narrowed(points, f, &scales.0);
    let lenient = narrowed(points, f, &[4.0 * wide, 2.0 * wide, wide]);
    let [near, far] = [&strict, &lenient].map(|f| inlying(points, f, wide));
    let bent = far.len() > near.len() + SAMPLE * 3 / 2;
    let (mut f, errors) = if bent { (lenient, far) } else { (strict, near) };
    // The median of a normal deviate's absolute value is 0.6745 σ.
    let sigma = median(errors)?.sqrt() / 0.6745;
    let threshold = if bent { wide } else { (3.0 * sigma).max(0.03 * wide).min(wide) };
    for _ in 0..10 {
        let inliers = inliers_of(points, &f, threshold);
        if count(&inliers) <= SAMPLE {
            return None;
        }
        f = refine(&points.select(&inliers), &f, FINE);
        if inliers_of(points, &f, threshold) == inliers {
            break;
        }
    }
    Some(Epipolar { fundamental: f, inliers: inliers_of(points, &f, threshold), threshold, sigma, trials: 0 })
}

/// Least squares and choice of inliers in turns, from threshold to threshold.
#[inline(never)]
fn narrowed(points: &Points, mut f: Fundamental, thresholds: &[f64; 3]) -> Fundamental {
    for &threshold in thresholds {
        for _ in 0..3 {
            let inliers = inliers_of(points, &f, threshold);
            if count(&inliers) <= SAMPLE {
                break;
            }
            f = refine(&points.select(&inliers), &f, COARSE);
        }
    }
    f
}
