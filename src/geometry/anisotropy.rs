//! How far a map is from being a similarity: what leans, and what is squeezed.

/// The photo is looked at at about so many points a row.
const COLUMNS: usize = 64;
/// Fewer points say nothing.
const FEW: usize = 30;
/// The most a point counts: where the map folds, or squeezes things beyond recognition.
pub(crate) const MOST_ANISOTROPY: f64 = 3.0;

/// Mean of ln(σ₁/σ₂) over a photo of `size` that a map takes from x, y to a `place`, σ₁ ≥ σ₂ the singular values of its Jacobian: 0 for a
/// similarity, which leaves shapes as they are; where it folds or has no place, 3. `None` of a photo of hardly any pixels.
pub fn anisotropy(size: (usize, usize), place: &dyn Fn(f64, f64) -> Option<[f64; 2]>) -> Option<f64> {
    let step = (size.0 as f64 / COLUMNS as f64).max(1.0);
    let (mut sum, mut count) = (0.0, 0usize);
    let mut y = 0.0;
    while y + step < size.1 as f64 {
        let mut x = 0.0;
        let mut next = place(x, y);
        while x + step < size.0 as f64 {
            let (here, right) = (next, place(x + step, y));
            next = right;
            let jacobian = here.zip(right).zip(place(x, y + step)).map(|((a, b), c)| {
                [b[0] - a[0], c[0] - a[0], b[1] - a[1], c[1] - a[1]].map(|difference| difference / step)
            });
            sum += jacobian.map_or(MOST_ANISOTROPY, log_singular_value_ratio);
            count += 1;
            x += step;
        }
        y += step;
    }
    (count >= FEW).then(|| sum / count as f64)
}

/// ln(σ₁/σ₂) of a matrix, row by row; 3 where it folds.
pub(crate) fn log_singular_value_ratio([a, b, c, d]: [f64; 4]) -> f64 {
    // σ₁² + σ₂² and σ₁σ₂.
    let (squares, product) = (a * a + b * b + c * c + d * d, a * d - b * c);
    if product.is_nan() || product <= 0.0 {
        return MOST_ANISOTROPY;
    }
    let mean = (0.5 * squares / product).max(1.0);
    libm::log(mean + (mean * mean - 1.0).sqrt()).min(MOST_ANISOTROPY)
}
