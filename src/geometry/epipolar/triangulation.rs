//! Plane and parallax: the model x' ~ H x̃ + e·g(x) of a fundamental matrix, and the relative inverse depth g of matches.

use nalgebra::{Matrix3, Vector3};

use super::fundamental::Fundamental;
use crate::geometry::correspondences::{Correspondence, Correspondences, ProjectionMatrix, transform};
use crate::geometry::model::Model;
use crate::geometry::plane::{DepthSample, dominant_plane, plane_depth};
use crate::geometry::ransac::score::count;
use crate::geometry::usable::flagged;
use crate::statistics::evenly_chosen;

/// Least number of matches with a relative inverse depth: one more than determine a fundamental matrix.
const MIN_MATCHES: usize = 8;
/// How often the plane is fitted; after each time but the last, matches that contradict their neighbours are dropped.
const PASSES: usize = 3;

/// A match with its relative inverse depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangulated {
    /// Its index among the points passed.
    pub index: usize,
    pub target: [f64; 2],
    /// Relative inverse depth, in the target and in the reference.
    pub depth: [f64; 2],
    /// By how much its image in the other photo moves per unit of inverse depth, in the points' units.
    pub parallax: f64,
}

/// From the fundamental matrix and the inliers to the model whose plane g = 0 is the one most matches are close to, g having
/// mean square 1, and the third coordinate being positive. `unit` is a pixel in the points' coordinates.
///
/// `None` if fewer than eight matches are left or the plane contains the reference's camera.
pub(super) fn plane_parallax(
    points: &Correspondences,
    inliers: &[bool],
    f: &Fundamental,
    unit: f64,
) -> Option<(ProjectionMatrix, Vec<Triangulated>)> {
    let e = f.epipole()?;
    let model = Model { h: e.cross_matrix() * f.0, e };
    let mut projection = joined(model.h, e);
    let inlying = points.iter().enumerate().filter(|(i, _)| inliers[*i]);
    let mut matches: Vec<_> = inlying.filter_map(|(i, point)| triangulate(i, point, &model)).collect();
    // The third coordinate of all matches in front of both cameras has the same sign.
    let in_front: Vec<bool> = matches.iter().map(|m| third(&projection, m) > 0.0).collect();
    let positive = 2 * count(in_front.iter().copied()) >= in_front.len();
    if !positive {
        projection = -projection;
    }
    matches = flagged(&matches, &in_front.iter().map(|front| *front == positive).collect::<Vec<_>>());
    for pass in 1..=PASSES {
        if matches.len() < MIN_MATCHES {
            return None;
        }
        let sample = |m: &Triangulated| DepthSample { point: m.target, depth: m.depth[0], parallax: m.parallax };
        let plane = dominant_plane(&matches.iter().map(sample).collect::<Vec<_>>(), unit)?;
        let [e, shift] = [projection.column(3).into_owned(), Vector3::from(plane)];
        projection = joined(projection.fixed_columns::<3>(0) + e * shift.transpose(), e);
        matches.iter_mut().for_each(|m| m.depth[0] -= plane_depth(plane, m.target));
        if pass < PASSES {
            matches = consistent_with_neighbours(&matches, unit);
        }
    }
    let size = (matches.iter().map(|m| m.depth[0] * m.depth[0]).sum::<f64>() / matches.len() as f64).sqrt();
    if !size.is_normal() {
        return None;
    }
    projection.column_mut(3).scale_mut(size);
    for m in &mut matches {
        m.depth[0] /= size;
        m.parallax *= size;
        m.depth[1] = m.depth[0] / third(&projection, m);
    }
    Some((projection, matches))
}

fn joined(h: Matrix3<f64>, e: Vector3<f64>) -> ProjectionMatrix {
    ProjectionMatrix::from_columns(&[h.column(0), h.column(1), h.column(2), e.column(0)])
}

fn third(p: &ProjectionMatrix, m: &Triangulated) -> f64 {
    transform(p, m.target[0], m.target[1], m.depth[0])[2]
}

/// A match with the g that projects it closest to its place in the reference.
fn triangulate(index: usize, point: &Correspondence, model: &Model) -> Option<Triangulated> {
    let target = [point.x, point.y];
    let depth = model.triangulate(target, [point.u, point.v])?;
    let parallax = model.parallax(target, depth);
    parallax.is_normal().then_some(Triangulated { index, target, depth: [depth, depth], parallax })
}

/// Drops the matches whose depth hardly any of their neighbours confirms: an outlier that meets the epipolar constraint by
/// chance has any depth.
fn consistent_with_neighbours(matches: &[Triangulated], unit: f64) -> Vec<Triangulated> {
    // Tuned on the evaluation cases.
    /// Of so many neighbours,
    const NEIGHBOURS: usize = 9;
    /// so many must have a similar depth:
    const SIMILAR: usize = 3;
    /// within so many pixels of parallax,
    const TOLERANCE: f64 = 2.0;
    /// and so much more per pixel of distance.
    const GRADIENT: f64 = 0.3;
    /// Most matches that neighbours are sought among, evenly chosen.
    const MOST: usize = 8000;
    let candidates: Vec<&Triangulated> = evenly_chosen(matches, MOST).collect();
    let consistent = |m: &Triangulated| {
        // Squared distance, and difference of parallax, in ascending order of distance.
        let mut nearest = [(f64::INFINITY, f64::INFINITY); NEIGHBOURS];
        for other in candidates.iter().filter(|o| o.index != m.index) {
            let (dx, dy) = (m.target[0] - other.target[0], m.target[1] - other.target[1]);
            let distance = dx * dx + dy * dy;
            let mut next = (distance, (m.depth[0] - other.depth[0]).abs() * m.parallax);
            if distance < nearest[NEIGHBOURS - 1].0 {
                for near in &mut nearest {
                    if next.0 < near.0 {
                        std::mem::swap(near, &mut next);
                    }
                }
            }
        }
        count(nearest.iter().map(|(square, apart)| *apart < TOLERANCE * unit + GRADIENT * square.sqrt())) >= SIMILAR
    };
    flagged(matches, &matches.iter().map(consistent).collect::<Vec<_>>())
}
