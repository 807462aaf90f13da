//! Where the prior sends each pixel, and along which line its depth moves it.

use super::consistency::Map;
use crate::geometry::Model;
use crate::image::reserve;
use crate::{InverseDepth, Result};

/// A place in the other photo and the epipolar line through it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    /// Where the prior sends the pixel; NaN behind the camera or without depth.
    pub place: [f32; 2],
    /// Unit vector along the line towards larger inverse depth; zero where depth hardly moves the pixel.
    pub direction: [f32; 2],
}

/// The map of one direction.
pub(super) struct Field<'a> {
    pub model: &'a Model,
    pub prior: &'a InverseDepth,
    /// Motion per inverse depth below which depth has no say.
    least: f64,
}

impl<'a> Field<'a> {
    pub fn new(model: &'a Model, prior: &'a InverseDepth) -> Self {
        let (least, most) = prior.data().iter().fold((f32::MAX, f32::MIN), |(a, b), &d| (a.min(d), b.max(d)));
        // Less than a pixel between the nearest and the farthest.
        Self { model, prior, least: 1.0 / (f64::from(most) - f64::from(least)).max(0.0) }
    }

    /// The pixel that stands for block (x, y) of `scale`×`scale` pixels.
    #[inline(always)]
    fn pixel(&self, x: usize, y: usize, scale: usize) -> [usize; 2] {
        let middle = |i: usize, side: usize| (i * scale + scale / 2).min(side - 1);
        [middle(x, self.prior.width()), middle(y, self.prior.height())]
    }

    /// Prior inverse depth of a block.
    #[inline(always)]
    pub fn prior_of(&self, x: usize, y: usize, scale: usize) -> f32 {
        let [x, y] = self.pixel(x, y, scale);
        self.prior.data()[y * self.prior.width() + x]
    }

    /// Where the prior sends a block, the unit vector of [`Motion::direction`], and the place's third coordinate; `None`
    /// behind the camera.
    #[inline(always)]
    fn trace(&self, x: usize, y: usize, scale: usize) -> Option<([f64; 2], [f64; 2], f64)> {
        let d = f64::from(self.prior_of(x, y, scale));
        let [x, y] = self.pixel(x, y, scale);
        let [u, v, w] = self.model.transform(x as f64, y as f64, d);
        let inverse = if w > 0.0 { 1.0 / w } else { return None };
        let place = [u * inverse, v * inverse];
        let slope = self.slope(place).map(|s| s * inverse);
        let length = (slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        let scale = if length > self.least { 1.0 / length } else { 0.0 };
        Some((place, slope.map(|s| s * scale), w))
    }

    /// Motion per inverse depth at a place, times its third coordinate.
    #[inline(always)]
    fn slope(&self, place: [f64; 2]) -> [f64; 2] {
        let e = &self.model.e;
        [e[0] - place[0] * e[2], e[1] - place[1] * e[2]]
    }

    /// Motion of a block.
    #[inline(always)]
    pub fn motion(&self, x: usize, y: usize, scale: usize) -> Motion {
        match self.trace(x, y, scale) {
            Some((place, direction, _)) => {
                Motion { place: place.map(|p| p as f32), direction: direction.map(|d| d as f32) }
            }
            None => Motion { place: [f32::NAN; 2], direction: [0.0; 2] },
        }
    }

    /// Inverse depth that sends a block `shift` pixels farther along its epipolar line than the prior does.
    #[inline(always)]
    fn moved(&self, x: usize, y: usize, scale: usize, shift: f32) -> f32 {
        let (prior, t) = (self.prior_of(x, y, scale), f64::from(shift));
        if t == 0.0 {
            return prior;
        }
        let Some((place, [dx, dy], w)) = self.trace(x, y, scale) else { return prior };
        // (w p + δ e) / (w + δ e₃) = p + t u, along u.
        let slope = self.slope([place[0] + t * dx, place[1] + t * dy]);
        let refined = (f64::from(prior) + w * t / (slope[0] * dx + slope[1] * dy)) as f32;
        // Without a direction it is infinite.
        if refined.is_finite() { refined } else { prior }
    }

    /// The whole map after `shifts`, one per pixel.
    pub fn refined(&self, shifts: &[f32]) -> Result<InverseDepth> {
        let width = self.prior.width();
        self.prior.map_indexed(|i, _| self.moved(i % width, i / width, 1, shifts[i]))
    }

    /// Inverse depth of all blocks after `shifts`.
    pub fn map(&self, shifts: &[f32], (width, height, scale): (usize, usize, usize)) -> Result<Map> {
        let mut data = Vec::new();
        reserve(&mut data, width * height)?;
        data.extend(shifts.iter().enumerate().map(|(i, &shift)| self.moved(i % width, i / width, scale, shift)));
        Ok(Map { data, width, height, scale })
    }

    /// Motion per inverse depth in the middle of the photo.
    pub fn typical_slope(&self) -> f32 {
        let (x, y) = (self.prior.width() / 2, self.prior.height() / 2);
        self.trace(x, y, 1).map_or(0.0, |(place, _, w)| {
            let [gx, gy] = self.slope(place);
            ((gx * gx + gy * gy).sqrt() / w) as f32
        })
    }
}
