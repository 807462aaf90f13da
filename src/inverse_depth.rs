//! Inverse-depth maps, and photos that come with one.

use crate::Result;
use crate::image::{ImageView, area, check_len, filled, reserve};

/// A photo and, unless the model has no parallax, its inverse depth.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// The photo.
    pub image: ImageView<'a>,
    /// Inverse depth of the same size; may be missing when the model's e is zero.
    pub depth: Option<&'a InverseDepth>,
}

/// What the numbers of a depth map mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DepthKind {
    /// Inverse depth or disparity, larger is nearer (Depth Anything, MiDaS). 0 is valid: very far.
    #[default]
    Inverse,
    /// Distance along the optical axis, in any unit. Not positive is a hole.
    Metric,
}

/// Inverse depth, one value per pixel of its image, NaN where unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct InverseDepth {
    data: Vec<f32>,
    width: usize,
    height: usize,
}

impl InverseDepth {
    /// From raw values on a `width`×`height` grid, for an image of `image_size` (width, height). Values that are not
    /// finite, equal to `invalid`, or (metric) not positive become holes; another size than the image's is
    /// resampled bilinearly, pixel centres mapped as areas: x_map = (x + ½)·width/image_width − ½.
    ///
    /// # Errors
    /// `invalid-argument` for an empty side of the map or the image, `size-mismatch` for another length, `out-of-memory`.
    pub fn new(
        name: &'static str,
        raw: &[f32],
        (width, height): (usize, usize),
        kind: DepthKind,
        invalid: Option<f32>,
        image_size: (usize, usize),
    ) -> Result<Self> {
        check_len(name, raw.len(), width, height, 1)?;
        let convert = |v: f32| -> f32 {
            if !v.is_finite() || invalid == Some(v) {
                return f32::NAN;
            }
            match kind {
                DepthKind::Inverse => v,
                // The reciprocal of a subnormal is infinite.
                DepthKind::Metric if v >= f32::MIN_POSITIVE => 1.0 / v,
                DepthKind::Metric => f32::NAN,
            }
        };
        let mut data = Vec::new();
        let (w, h) = image_size;
        reserve(&mut data, area(name, w, h)?)?;
        if (w, h) == (width, height) {
            data.extend(raw.iter().map(|&v| convert(v)));
        } else {
            resample(raw, (width, height), (w, h), convert, &mut data);
        }
        Ok(Self { data, width: w, height: h })
    }

    /// Wraps width·height values, row by row, NaN for holes.
    pub(crate) fn from_values(data: Vec<f32>, width: usize, height: usize) -> Self {
        Self { data, width, height }
    }

    /// The values, row by row.
    pub(crate) fn into_values(self) -> Vec<f32> {
        self.data
    }

    /// The same value everywhere.
    ///
    /// # Errors
    /// `invalid-argument` for an empty side, `out-of-memory` when the allocator refuses.
    pub fn constant(value: f32, width: usize, height: usize) -> Result<Self> {
        Ok(Self { data: filled(area("depth", width, height)?, value)?, width, height })
    }

    /// Values row by row, NaN for holes.
    pub fn data(&self) -> &[f32] {
        &self.data
    }
    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }
    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// A map of the same size from a function of index and value.
    pub(crate) fn map_indexed(&self, f: impl Fn(usize, f32) -> f32) -> Result<Self> {
        let mut data = Vec::new();
        reserve(&mut data, self.data.len())?;
        data.extend(self.data.iter().enumerate().map(|(i, &v)| f(i, v)));
        Ok(Self { data, width: self.width, height: self.height })
    }

    /// Bilinear value at (x, y), clamped to the frame; NaN where one of the four neighbours that count is a hole.
    pub fn sample(&self, x: f64, y: f64) -> f64 {
        // Not `clamp`: its panic message would bring the whole float formatting into the wasm module.
        let x = x.max(0.0).min((self.width - 1) as f64);
        let y = y.max(0.0).min((self.height - 1) as f64);
        let (x0, y0) = (x as usize, y as usize);
        let (fx, fy) = (x - x0 as f64, y - y0 as f64);
        let row = |y: usize| {
            let at = |x: usize| f64::from(self.data[y * self.width + x]);
            if fx == 0.0 { at(x0) } else { at(x0) * (1.0 - fx) + at(x0 + 1) * fx }
        };
        if fy == 0.0 { row(y0) } else { row(y0) * (1.0 - fy) + row(y0 + 1) * fy }
    }
}

fn resample(
    raw: &[f32],
    (width, height): (usize, usize),
    (w, h): (usize, usize),
    convert: impl Fn(f32) -> f32,
    out: &mut Vec<f32>,
) {
    let axis = |i: usize, to: usize, from: usize| -> (usize, usize, f32) {
        let p = ((i as f64 + 0.5) * from as f64 / to as f64 - 0.5).max(0.0).min((from - 1) as f64);
        let i0 = p as usize;
        (i0, (i0 + 1).min(from - 1), (p - i0 as f64) as f32)
    };
    for y in 0..h {
        let (y0, y1, fy) = axis(y, h, height);
        for x in 0..w {
            let (x0, x1, fx) = axis(x, w, width);
            let lerp = |y: usize| {
                let (a, b) = (convert(raw[y * width + x0]), convert(raw[y * width + x1]));
                if fx == 0.0 { a } else { a + (b - a) * fx }
            };
            let (a, b) = (lerp(y0), lerp(y1));
            out.push(if fy == 0.0 { a } else { a + (b - a) * fy });
        }
    }
}
