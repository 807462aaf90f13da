//! How far the warp is from a homography where the target alone shows.

use crate::geometry::{Match, Model, homography};
use crate::image::check_size;
use crate::rect::diagonal;
use crate::{InverseDepth, Result};

/// The target is looked at at about so many points a row.
const COLUMNS: usize = 150;
/// Fewer points outside the reference say nothing.
const FEW: usize = 50;

/// RMS distance of the points of the target that `forward` puts outside the reference from the homography that fits them
/// best, in % of the reference's diagonal. True depth bends a little, too; much is a sign of depth gone astray. `size` and
/// `reference` are width and height of the photos. `None` when hardly anything lies outside.
///
/// # Errors
/// `size-mismatch` for depth of another size than the target.
pub fn bending(
    size: (usize, usize),
    forward: &Model,
    depth: Option<&InverseDepth>,
    reference: (usize, usize),
) -> Result<Option<f64>> {
    if let Some(depth) = depth {
        check_size("targetDepth", depth.size(), size)?;
    }
    let step = (size.0 / COLUMNS).max(2);
    let mut outside = Vec::new();
    for y in (0..size.1).step_by(step) {
        for x in (0..size.0).step_by(step) {
            let d = depth.map_or(0.0, |depth| f64::from(depth.data()[y * size.0 + x]));
            let (x, y) = (x as f64, y as f64);
            let Some([u, v]) = forward.project(x, y, d) else { continue };
            if u < 0.0 || v < 0.0 || u >= reference.0 as f64 || v >= reference.1 as f64 {
                outside.push(Match { target: [x, y], reference: [u, v] });
            }
        }
    }
    if outside.len() <= FEW {
        return Ok(None);
    }
    let Some(fitted) = homography(&outside) else { return Ok(None) };
    let squared = |m: &Match| {
        let [u, v] = fitted.project(m.target[0], m.target[1], 0.0)?;
        let [x, y] = [u - m.reference[0], v - m.reference[1]];
        Some(x * x + y * y)
    };
    let squares: Option<f64> = outside.iter().map(squared).sum();
    Ok(squares.map(|squares| 100.0 * (squares / outside.len() as f64).sqrt() / diagonal(reference)))
}
