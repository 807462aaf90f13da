//! Plane and parallax: the model x' ~ H x̃ + e·g(x) that a fundamental matrix stands for, and g at the matches.

use super::fundamental::{Fundamental, cross_matrix, epipole};
use crate::geometry::clean::flagged;
use crate::geometry::errors::count;
use crate::geometry::plane::{DepthSample, at, dominant_plane};
use crate::geometry::points::{Point, Points, Projection, transform};
use crate::geometry::vectors::{apply, cross, dot, scale};

/// A match with its relative inverse depth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangulated {
    /// Its place among the points passed.
    pub index: usize,
    pub target: [f64; 2],
    /// Relative inverse depth, in the target and in the reference.
    pub depth: [f64; 2],
    /// By how much its image in the other photo moves with the depth, in the points' units.
    pub motion: f64,
}

/// From the fundamental matrix and the inliers to the model whose plane g = 0 is the one most matches are near to, g of
/// mean square 1, and the third coordinate positive. `unit` is a pixel in the points' coordinates.
///
/// `None` when fewer than eight matches are left or the plane goes through the reference's camera.
#[inline(never)]
pub(super) fn plane_parallax(
    points: &Points,
    inliers: &[bool],
    f: &Fundamental,
    unit: f64,
) -> Option<(Projection, Vec<Triangulated>)> {
    let e = epipole(f)?;
    let a = cross_matrix(e, f);
    let mut projection: Projection = [0, 1, 2].map(|r| [a[r][0], a[r][1], a[r][2], e[r]]);
    let mut matches = Vec::new();
    for (i, point) in points.iter().enumerate().filter(|(i, _)| inliers[*i]) {
        if let Some(found) = triangulated(i, point, f, &projection) {
            matches.push(found);
        }
    }
    // Of all matches in front of both cameras the third coordinate has the same sign.
    let third = |p: &Projection, m: &Triangulated| transform(p, m.target[0], m.target[1], m.depth[0])[2];
    let ahead: Vec<bool> = matches.iter().map(|m| third(&projection, m) > 0.0).collect();
    let most = 2 * count(&ahead) >= ahead.len();
    scale(projection.as_flattened_mut(), if most { 1.0 } else { -1.0 });
    matches = flagged(&matches, &ahead.iter().map(|ahead| *ahead == most).collect::<Vec<_>>());
    for pass in 0..3 {
        if matches.len() < 8 {
            return None;
        }
        let moving: Vec<DepthSample> =
            matches.iter().map(|m| DepthSample { point: m.target, depth: m.depth[0], parallax: m.motion }).collect();
        let plane = dominant_plane(&moving, unit)?;
        for row in &mut projection {
            for c in 0..3 {
                row[c] += row[3] * plane[c];
            }
        }
        matches.iter_mut().for_each(|m| m.depth[0] -= at(plane, m.target));
        if pass < 2 {
            matches = supported(&matches, unit);
        }
    }
    let size = (matches.iter().map(|m| m.depth[0] * m.depth[0]).sum::<f64>() / matches.len() as f64).sqrt();
    if !size.is_normal() {
        return None;
    }
    projection.iter_mut().for_each(|row| row[3] *= size);
    for m in &mut matches {
        m.depth[0] /= size;
        m.motion *= size;
        let w = third(&projection, m);
        m.depth[1] = m.depth[0] / w;
    }
    Some((projection, matches))
}

/// The g that brings the image of a match as close as can be to its place in the reference: the place on the epipolar
/// line next to it.
#[inline(never)]
fn triangulated(index: usize, point: &Point, f: &Fundamental, p: &Projection) -> Option<Triangulated> {
    let Point { x, y, u, v, .. } = *point;
    let [a, b, c] = apply(f, [x, y, 1.0]);
    let offset = (a * u + b * v + c) / (a * a + b * b);
    let place = [u - offset * a, v - offset * b, 1.0];
    let e = [0, 1, 2].map(|r| p[r][3]);
    let across = cross(place, e);
    let depth = -dot(across, cross(place, transform(p, x, y, 0.0))) / dot(across, across);
    let w = transform(p, x, y, depth)[2];
    let [du, dv] = [0, 1].map(|r| (e[r] - place[r] * e[2]) / w);
    let motion = (du * du + dv * dv).sqrt();
    (depth.is_finite() && motion.is_normal()).then_some(Triangulated {
        index,
        target: [x, y],
        depth: [depth, depth],
        motion,
    })
}

/// Drops the matches that hardly any of their neighbours is like. A wrong match that meets the epipolar constraint by
/// chance has any depth.
#[inline(never)]
fn supported(matches: &[Triangulated], unit: f64) -> Vec<Triangulated> {
    const NEIGHBOURS: usize = 9;
    const LIKE: usize = 3;
    // In pixels, and as a share of the distance.
    const TOLERANCE: f64 = 2.0;
    const GRADIENT: f64 = 0.3;
    let keep = |m: &Triangulated| {
        let mut nearest = [(f64::INFINITY, f64::INFINITY); NEIGHBOURS];
        for other in matches.iter().filter(|o| o.index != m.index) {
            let (dx, dy) = (m.target[0] - other.target[0], m.target[1] - other.target[1]);
            let distance = dx * dx + dy * dy;
            let mut next = (distance, (m.depth[0] - other.depth[0]).abs() * m.motion);
            if distance < nearest[NEIGHBOURS - 1].0 {
                for near in &mut nearest {
                    if next.0 < near.0 {
                        std::mem::swap(near, &mut next);
                    }
                }
            }
        }
        nearest.iter().filter(|(square, apart)| *apart < TOLERANCE * unit + GRADIENT * square.sqrt()).count() >= LIKE
    };
    let flags: Vec<bool> = matches.iter().map(keep).collect();
    flagged(matches, &flags)
}
