//! Direct forward mapping (paper, section 3.2.1 and table 2, row 3): the simplest of the ablation's warps.

use super::canvas::Canvas;
use super::grid::Map;
use super::project;
use crate::image::zeroed;
use crate::{Image, ImageView, InverseDepth, Mask, Result};

/// What is written: empty, and of the canvas' size.
pub(super) struct Output<'a> {
    pub image: &'a mut Image,
    pub footprint: &'a mut Mask,
    /// Whether the target's own inverse depth is returned.
    pub with_depth: bool,
}

/// Puts every target pixel on the nearest canvas pixel; a later one replaces an earlier one. Returns the target's own
/// inverse depth as [`render`](super::render::render) does, empty if not wanted.
pub(super) fn splat(
    target: &ImageView<'_>,
    depth: Option<&InverseDepth>,
    map: &Map<'_>,
    canvas: &Canvas,
    out: &mut Output<'_>,
) -> Result<Vec<f32>> {
    let mut depths = zeroed(depth.filter(|_| out.with_depth).map_or(0, |_| canvas.width * canvas.height))?;
    let (w, h) = target.size();
    for y in 0..h {
        for x in 0..w {
            let d = depth.map_or(0.0, |d| f64::from(d.data()[y * w + x]));
            let place = project(map.surface.as_ref(), map.model, [x as f64, y as f64], d);
            let Some([u, v]) = place else { continue };
            let u = (u + 0.5).floor() + canvas.offset.0 as f64;
            let v = (v + 0.5).floor() + canvas.offset.1 as f64;
            if !(u >= 0.0 && v >= 0.0 && u < canvas.width as f64 && v < canvas.height as f64) {
                continue;
            }
            let i = v as usize * canvas.width + u as usize;
            let pixel @ [r, g, b, _] = target.pixel(x, y);
            if !target.is_there(pixel) {
                // A hole within the target is a void.
                out.footprint.data_mut()[i] |= map.outside.map_or(0, |outside| !outside.data()[y * w + x]);
                continue;
            }
            out.image.data_mut()[4 * i..4 * i + 4].copy_from_slice(&[r, g, b, 255]);
            out.footprint.data_mut()[i] = 255;
            if let Some(depth) = depths.get_mut(i) {
                *depth = d as f32;
            }
        }
    }
    Ok(depths)
}
