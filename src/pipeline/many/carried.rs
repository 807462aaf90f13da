//! Depth carried from photo to photo: what another one's neighbours saw need not be guessed.

use crate::InverseDepth;
use crate::depth::{sample_grid, sample_step};
use crate::geometry::MultiView;

/// What the other photos know of the depth of `photo`, where it does not know itself: points and inverse depth there. `known` are
/// maps that are NaN where nothing is. Of what lands close together the nearest is visible.
pub(super) fn carried(
    photo: usize,
    known: &[Option<InverseDepth>],
    (width, height): (usize, usize),
    geometry: &MultiView,
) -> Vec<([f64; 2], f64)> {
    let step = sample_step((width, height));
    let columns = width.div_ceil(step);
    let mut nearest: Vec<Option<([f64; 2], f64)>> = vec![None; columns * height.div_ceil(step)];
    for (other, map) in known.iter().enumerate().filter(|(other, _)| *other != photo) {
        let (Some(map), Some(model)) = (map, geometry.model([other, photo])) else { continue };
        for (x, y) in sample_grid(map.size()) {
            let depth = f64::from(map.data()[y * map.width() + x]);
            // NaN lands nowhere.
            let [u, v, third] = model.transform(x as f64, y as f64, depth);
            let (point, depth) = ([u / third, v / third], depth / third);
            let inside = |p: f64, side: usize| p >= 0.0 && p < side as f64;
            if !(third > 0.0 && inside(point[0], width) && inside(point[1], height)) {
                continue;
            }
            let [column, row] = point.map(|p| p as usize);
            let itself = known[photo].as_ref().is_some_and(|own| !own.data()[row * width + column].is_nan());
            let cell = &mut nearest[row / step * columns + column / step];
            if !itself && cell.is_none_or(|(_, before)| depth > before) {
                *cell = Some((point, depth));
            }
        }
    }
    nearest.into_iter().flatten().collect()
}
