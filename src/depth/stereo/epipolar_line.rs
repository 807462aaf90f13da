//! Where the prior projects each pixel in the other photo, and the epipolar line along which depth moves that projection.

use crate::InverseDepth;
use crate::geometry::{Model, epipolar_direction};

/// A projection in the other photo and the epipolar line through it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EpipolarLine {
    /// The projection by the prior; NaN behind the camera or without depth.
    pub place: [f32; 2],
    /// Unit vector along the line towards larger inverse depth; zero where depth hardly moves the projection.
    pub direction: [f32; 2],
}

/// The epipolar lines of all pixels of one photo.
pub(super) struct EpipolarLines<'a> {
    pub model: &'a Model,
    pub prior: &'a InverseDepth,
    /// Parallax per inverse depth, in pixels, below which depth does not count.
    least: f64,
}

impl<'a> EpipolarLines<'a> {
    pub fn new(model: &'a Model, prior: &'a InverseDepth) -> Self {
        let (mut least, mut most) = (f32::MAX, f32::MIN);
        for &d in prior.data() {
            (least, most) = (if d < least { d } else { least }, if d > most { d } else { most });
        }
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

    /// The homogeneous image of a block by the prior, the derivative of its projection by inverse depth, times the third
    /// coordinate squared, and the length of that; `None` behind the camera.
    #[inline(always)]
    fn trace(&self, x: usize, y: usize, scale: usize) -> Option<([f64; 3], [f64; 2], f64)> {
        let d = f64::from(self.prior_of(x, y, scale));
        let [x, y] = self.pixel(x, y, scale);
        let image = self.model.transform(x as f64, y as f64, d);
        let slope = epipolar_direction(&self.model.e, image);
        let length = (slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        (image[2] > 0.0).then_some((image, slope, length))
    }

    /// The epipolar line of a block.
    #[inline(always)]
    pub fn line(&self, x: usize, y: usize, scale: usize) -> EpipolarLine {
        let Some(([u, v, w], slope, length)) = self.trace(x, y, scale) else {
            return EpipolarLine { place: [f32::NAN; 2], direction: [0.0; 2] };
        };
        let inverse = 1.0 / w;
        let unit = if length > self.least * w * w { 1.0 / length } else { 0.0 };
        EpipolarLine { place: [u, v].map(|p| (p * inverse) as f32), direction: slope.map(|s| (s * unit) as f32) }
    }

    /// Inverse depth that projects a block `shift` pixels farther along its epipolar line than the prior does.
    #[inline(always)]
    pub fn depth_at(&self, x: usize, y: usize, scale: usize, shift: f32) -> f32 {
        let (prior, t) = (self.prior_of(x, y, scale), f64::from(shift));
        if t == 0.0 {
            return prior;
        }
        match self.trace(x, y, scale) {
            // (w p + δ e) / (w + δ e₃) = p + t u, along u.
            Some(([_, _, w], _, length)) if length > self.least * w * w => {
                (f64::from(prior) + w * w * t / (length - w * t * self.model.e[2])) as f32
            }
            _ => prior,
        }
    }

    /// Parallax per inverse depth, in pixels, in the middle of the photo.
    pub fn typical_slope(&self) -> f32 {
        let (x, y) = (self.prior.width() / 2, self.prior.height() / 2);
        self.trace(x, y, 1).map_or(0.0, |([_, _, w], _, length)| (length / (w * w)) as f32)
    }
}
