//! How far something found is from the truth.

use depthstitch::geometry::Model;

use super::pair::Pair;

pub fn distance([a, b]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    let (x, y) = (a - u, b - v);
    (x * x + y * y).sqrt()
}

pub fn median(values: Vec<f64>) -> f64 {
    quantile(values, 0.5)
}

/// The value that this share of the others is below, 0 to 1; of two in the middle the greater one.
pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((share * values.len() as f64) as usize).min(values.len() - 1)]
}

/// Median distance between a model's map and the true one over the target: within the reference's frame, and outside.
pub fn map_error(model: &Model, pair: &Pair<'_>) -> [f64; 2] {
    let (mut within, mut beyond) = (Vec::new(), Vec::new());
    let width = pair.target.width;
    let (right, bottom) = (pair.reference.width as f64 - 1.0, pair.reference.height as f64 - 1.0);
    for (i, place) in pair.map().into_iter().enumerate() {
        let Some([u, v]) = place else { continue };
        let found = model.project((i % width) as f64, (i / width) as f64, 1.0 / pair.target.depth[i]).unwrap();
        let inside = (0.0..=right).contains(&u) && (0.0..=bottom).contains(&v);
        let errors = if inside { &mut within } else { &mut beyond };
        errors.push(distance(found, [u, v]));
    }
    assert!(within.len() > 5000 && beyond.len() > 1000, "{} pixels within, {} beyond", within.len(), beyond.len());
    [median(within), median(beyond)]
}
