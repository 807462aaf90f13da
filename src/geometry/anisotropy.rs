//! How far a map is from being a similarity: what leans, and what is squeezed.

use super::Model;
use crate::rect::diagonal;

/// The photo is looked at at about so many points a row.
const COLUMNS: usize = 64;
/// Fewer points say nothing.
const FEW: usize = 30;
/// How far inside the border what lands inside of the other photo still counts, as a share of its diagonal: a mosaic often
/// shows it.
const BESIDE: f64 = 0.05;
/// The most a point counts: where the map folds, or squeezes things beyond recognition.
const MOST: f64 = 3.0;

/// Mean of ln(σ₁/σ₂) over a photo of `size` that `model` maps, σ₁ ≥ σ₂ the singular values of the map's Jacobian: 0 for a
/// similarity, which leaves shapes as they are; where the map folds, 3. `depth` is the photo's inverse depth at x, y. With
/// `reference` only what lands outside of a photo of that width and height counts, or close to its border. `None` when there
/// is hardly anything.
pub fn anisotropy(
    model: &Model,
    size: (usize, usize),
    depth: &dyn Fn(f64, f64) -> f64,
    reference: Option<(usize, usize)>,
) -> Option<f64> {
    let step = (size.0 as f64 / COLUMNS as f64).max(1.0);
    let (mut sum, mut count) = (0.0, 0usize);
    let place = |x: f64, y: f64| model.project(x, y, depth(x, y));
    let inside =
        |[u, v]: [f64; 2]| reference.is_some_and(|size| border_distance([u, v], size) >= BESIDE * diagonal(size));
    let mut y = 0.0;
    while y + step < size.1 as f64 {
        let mut x = 0.0;
        let mut next = place(x, y);
        while x + step < size.0 as f64 {
            let (here, right) = (next, place(x + step, y));
            next = right;
            if !here.is_some_and(inside) {
                let jacobian = here.zip(right).zip(place(x, y + step)).map(|((a, b), c)| {
                    [b[0] - a[0], c[0] - a[0], b[1] - a[1], c[1] - a[1]].map(|difference| difference / step)
                });
                sum += jacobian.map_or(MOST, ratio);
                count += 1;
            }
            x += step;
        }
        y += step;
    }
    (count >= FEW).then(|| sum / count as f64)
}

/// How far a point is inside the border of a photo, in pixels; negative outside.
fn border_distance([u, v]: [f64; 2], (w, h): (usize, usize)) -> f64 {
    let along = |p: f64, side: usize| p.min((side - 1) as f64 - p);
    along(u, w).min(along(v, h))
}

/// ln(σ₁/σ₂) of a matrix, row by row.
fn ratio([a, b, c, d]: [f64; 4]) -> f64 {
    // σ₁² + σ₂² and σ₁σ₂.
    let (squares, product) = (a * a + b * b + c * c + d * d, a * d - b * c);
    if product.is_nan() || product <= 0.0 {
        return MOST;
    }
    let mean = (0.5 * squares / product).max(1.0);
    libm::log(mean + (mean * mean - 1.0).sqrt()).min(MOST)
}
