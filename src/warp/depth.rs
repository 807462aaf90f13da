//! Inverse depth on the canvas.

use nalgebra::Vector3;

use super::grid::Map;
use crate::{Image, InverseDepth};

/// Turns the target's own inverse depth d at the pixels of the canvas, of which `image` shows those that are opaque, into
/// the reference's frame: d' = d/λ' with λ' x̃' = H s̃ + e·d. `None` of no depth.
///
/// The place s in the target is not needed: taking the product with c = h₁×h₂ of H's first two columns leaves
/// λ'·(c·x̃') = det H + d·(c·e), even when H is singular. On a projection surface x̃' is the ray of the pixel.
pub(super) fn in_reference_frame(
    mut depth: Vec<f32>,
    image: &Image,
    map: &Map<'_>,
    offset: (usize, usize),
) -> Option<InverseDepth> {
    if depth.is_empty() {
        return None;
    }
    let model = map.model;
    let columns: [Vector3<f64>; 3] = [0, 1, 2].map(|k| model.h.column(k).into_owned());
    let c = columns[0].cross(&columns[1]);
    let (det, ce, step) = (c.dot(&columns[2]) as f32, c.dot(&model.e) as f32, c.x as f32);
    if let Some(surface) = &map.surface {
        let rays = surface.rays([-(offset.0 as f64), -(offset.1 as f64)], image.size());
        let c = [c.x as f32, c.y as f32, c.z as f32];
        for (i, (d, pixel)) in depth.iter_mut().zip(image.pixels()).enumerate() {
            let [x, y, z] = rays.at(i % image.width(), i / image.width());
            let shown = *d * (c[0] * x + c[1] * y + c[2] * z) / (det + *d * ce);
            *d = if pixel[3] != 0 { shown } else { f32::NAN };
        }
        return Some(InverseDepth::from_values(depth, image.width(), image.height()));
    }
    let rows = depth.chunks_exact_mut(image.width()).zip(image.data().chunks_exact(4 * image.width()));
    for (y, (depths, pixels)) in rows.enumerate() {
        let first = (c.y * (y as f64 - offset.1 as f64) + c.z - c.x * offset.0 as f64) as f32;
        // Whole words and no branch: the compiler turns this into SIMD.
        for (x, (d, pixel)) in (0i32..).zip(depths.iter_mut().zip(pixels.as_chunks().0)) {
            let shown = *d * (first + step * x as f32) / (det + *d * ce);
            *d = if u32::from_le_bytes(*pixel) >> 24 != 0 { shown } else { f32::NAN };
        }
    }
    Some(InverseDepth::from_values(depth, image.width(), image.height()))
}
