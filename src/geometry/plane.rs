//! The plane of relative inverse depth that most of the points are near to.

use super::linear::solve;
use crate::statistics::median;

/// A point of one photo with its inverse depth.
#[derive(Debug, Clone, Copy)]
pub struct DepthSample {
    /// x, y in pixels.
    pub point: [f64; 2],
    /// Inverse depth there.
    pub depth: f64,
    /// By how many pixels its image in the other photo moves per unit of inverse depth.
    pub parallax: f64,
}

/// a, b, c of depth = ax + by + c with the least sum of distances in the other photo, by reweighted least squares; what is
/// within `unit` of the plane counts as on it. `None` when the points lie on one line.
#[inline(never)]
pub(crate) fn dominant_plane(points: &[DepthSample], unit: f64) -> Option<[f64; 3]> {
    let mut plane = [0.0, 0.0, median(points.iter().map(|m| m.depth).collect())?];
    for _ in 0..20 {
        let (mut normal, mut solved) = ([0.0; 9], [0.0; 3]);
        for m in points {
            let p = [m.point[0], m.point[1], 1.0];
            let residual = (m.depth - at(plane, m.point)).abs() * m.parallax;
            let weight = m.parallax * m.parallax / if residual > unit { residual } else { unit };
            for r in 0..3 {
                let weighted = weight * p[r];
                solved[r] += weighted * m.depth;
                for c in 0..=r {
                    normal[3 * r + c] += weighted * p[c];
                }
            }
        }
        solve(&mut normal, &mut solved)?;
        plane = solved;
    }
    Some(plane)
}

/// The plane's depth at a point.
pub(crate) fn at([a, b, c]: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    a * x + b * y + c
}
