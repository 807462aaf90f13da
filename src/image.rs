//! Pictures, masks and inverse-depth maps: what the stages pass to each other.

use bytemuck::Zeroable;
use bytemuck::allocation::try_zeroed_slice_box;

use crate::{Error, Result};

/// A borrowed RGBA picture, 8 bit, row by row from the top left. The alpha of an input photo is ignored.
#[derive(Debug, Clone, Copy)]
pub struct ImageView<'a> {
    data: &'a [u8],
    width: usize,
    height: usize,
}

impl<'a> ImageView<'a> {
    /// Wraps `data`, 4·width·height bytes; `name` is how errors call it.
    ///
    /// # Errors
    /// `invalid-argument` for an empty side, `size-mismatch` for another length.
    pub fn new(name: &'static str, data: &'a [u8], width: usize, height: usize) -> Result<Self> {
        check_len(name, data.len(), width, height, 4)?;
        Ok(Self { data, width, height })
    }

    /// Bytes, RGBA.
    pub fn data(&self) -> &'a [u8] {
        self.data
    }
    /// Pixels, RGBA, row by row.
    pub fn pixels(&self) -> &'a [[u8; 4]] {
        self.data.as_chunks().0
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
    /// The four bytes of a pixel, clamped to the frame.
    #[inline]
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 4] {
        let i = 4 * (y.min(self.height - 1) * self.width + x.min(self.width - 1));
        [self.data[i], self.data[i + 1], self.data[i + 2], self.data[i + 3]]
    }
}

/// An owned RGBA image, 8 bit, row by row from the top left. In results alpha is validity: 255 where there is a pixel, 0
/// (and black) elsewhere.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    data: Vec<u8>,
    width: usize,
    height: usize,
}

impl Image {
    /// Wraps `data`, 4·width·height bytes.
    ///
    /// # Errors
    /// `invalid-argument` for an empty side, `size-mismatch` for another length.
    pub fn new(data: Vec<u8>, width: usize, height: usize) -> Result<Self> {
        check_len("image", data.len(), width, height, 4)?;
        Ok(Self { data, width, height })
    }

    /// A fully transparent image.
    ///
    /// # Errors
    /// `invalid-argument` for an empty side, `out-of-memory` when the allocator refuses.
    pub fn transparent(width: usize, height: usize) -> Result<Self> {
        let bytes = area("image", width, height)?.saturating_mul(4);
        Ok(Self { data: zeroed(bytes)?, width, height })
    }

    /// Wraps `data`, which the caller knows to be 4·width·height bytes.
    pub(crate) fn from_bytes(data: Vec<u8>, width: usize, height: usize) -> Self {
        debug_assert_eq!(data.len(), 4 * width * height);
        Self { data, width, height }
    }

    /// Borrows the image.
    pub fn view(&self) -> ImageView<'_> {
        ImageView { data: &self.data, width: self.width, height: self.height }
    }

    /// Bytes, RGBA.
    pub fn data(&self) -> &[u8] {
        &self.data
    }
    /// Bytes, RGBA.
    pub fn data_mut(&mut self) -> &mut [u8] {
        &mut self.data
    }
    /// Bytes, RGBA.
    pub fn into_data(self) -> Vec<u8> {
        self.data
    }
    /// Pixels, RGBA, row by row.
    pub fn pixels(&self) -> &[[u8; 4]] {
        self.data.as_chunks().0
    }
    /// Pixels, RGBA, row by row.
    pub fn pixels_mut(&mut self) -> &mut [[u8; 4]] {
        self.data.as_chunks_mut().0
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
}

/// A mask, one byte per pixel, row by row from the top left: 0 is no, anything else (255 when made here) is yes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    data: Vec<u8>,
    width: usize,
    height: usize,
}

impl Mask {
    /// Wraps `data`, width·height bytes.
    ///
    /// # Errors
    /// `invalid-argument` for an empty side, `size-mismatch` for another length.
    pub fn new(data: Vec<u8>, width: usize, height: usize) -> Result<Self> {
        check_len("mask", data.len(), width, height, 1)?;
        Ok(Self { data, width, height })
    }

    /// A mask that is no everywhere.
    ///
    /// # Errors
    /// `invalid-argument` for an empty side, `out-of-memory` when the allocator refuses.
    pub fn empty(width: usize, height: usize) -> Result<Self> {
        Ok(Self { data: zeroed(area("mask", width, height)?)?, width, height })
    }

    /// Wraps `data`, which the caller knows to be width·height bytes.
    pub(crate) fn from_bytes(data: Vec<u8>, width: usize, height: usize) -> Self {
        debug_assert_eq!(data.len(), width * height);
        Self { data, width, height }
    }

    /// How many pixels are set.
    pub fn count(&self) -> usize {
        marked(&self.data)
    }

    /// Bytes row by row.
    pub fn data(&self) -> &[u8] {
        &self.data
    }
    /// Bytes row by row.
    pub fn data_mut(&mut self) -> &mut [u8] {
        &mut self.data
    }
    /// Bytes row by row.
    pub fn into_data(self) -> Vec<u8> {
        self.data
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
}

/// width·height, or the largest number if that overflows.
fn area(name: &'static str, width: usize, height: usize) -> Result<usize> {
    check_sides(name, width, height)?;
    Ok(width.saturating_mul(height))
}

/// How many are not 0.
pub(crate) fn marked(marks: &[u8]) -> usize {
    marks.iter().filter(|&&mark| mark != 0).count()
}

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
    /// `invalid-argument` for an empty side, `size-mismatch` for another length, `out-of-memory`.
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
        reserve(&mut data, w * h)?;
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
    /// `out-of-memory` when the allocator refuses.
    pub fn constant(value: f32, width: usize, height: usize) -> Result<Self> {
        Ok(Self { data: filled(width * height, value)?, width, height })
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

/// Checks that `len` values are what width × height × `channels` asks for, without overflow.
pub(crate) fn check_len(name: &'static str, len: usize, width: usize, height: usize, channels: u64) -> Result<()> {
    check_sides(name, width, height)?;
    let expected = (width as u64).saturating_mul(height as u64).saturating_mul(channels);
    if len as u64 != expected {
        return Err(Error::SizeMismatch { name, expected, actual: len as u64 }.into());
    }
    Ok(())
}

fn check_sides(name: &'static str, width: usize, height: usize) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(Error::InvalidArgument { name, expected: "at least one pixel wide and high", value: 0.0 }.into());
    }
    Ok(())
}

/// Checks that something is as large as what it belongs to.
pub(crate) fn check_size(name: &'static str, size: (usize, usize), expected: (usize, usize)) -> Result<()> {
    if size == expected {
        return Ok(());
    }
    let pixels = |(w, h): (usize, usize)| w as u64 * h as u64;
    Err(Error::SizeMismatch { name, expected: pixels(expected), actual: pixels(size) }.into())
}

/// `len` zeros, refusing instead of aborting when memory is out.
pub(crate) fn zeroed<T: Zeroable>(len: usize) -> Result<Vec<T>> {
    try_zeroed_slice_box(len).map(Vec::from).map_err(|()| out_of_memory(len, size_of::<T>()))
}

/// `len` defaults, refusing instead of aborting when memory is out.
pub(crate) fn defaults<T: Clone + Default>(len: usize) -> Result<Vec<T>> {
    filled(len, T::default())
}

/// `len` times the same, refusing instead of aborting when memory is out.
pub(crate) fn filled<T: Clone>(len: usize, value: T) -> Result<Vec<T>> {
    let mut v = Vec::new();
    reserve(&mut v, len)?;
    v.resize(len, value);
    Ok(v)
}

/// The numbers 0 to `len` − 1, refusing instead of aborting when memory is out.
pub(crate) fn indices(len: usize) -> Result<Vec<u32>> {
    let mut all = Vec::new();
    reserve(&mut all, len)?;
    all.extend(0..len as u32);
    Ok(all)
}

/// Reserves room for `len` more values, refusing instead of aborting when memory is out.
pub(crate) fn reserve<T>(v: &mut Vec<T>, len: usize) -> Result<()> {
    v.try_reserve_exact(len).map_err(|_| out_of_memory(len, size_of::<T>()))
}

#[cold]
fn out_of_memory(len: usize, size: usize) -> Box<Error> {
    Error::OutOfMemory { bytes: (len as u64).saturating_mul(size as u64) }.into()
}
