//! Pictures and masks, and the checks and allocations that all buffers share.

use bytemuck::Zeroable;
use bytemuck::allocation::try_zeroed_slice_box;

use crate::{Error, Result};

/// A pixel of a photo with a smaller alpha is masked; one with this alpha or more is opaque.
pub const LEAST_ALPHA: u8 = 128;

/// A borrowed RGBA picture, 8 bit, row by row from the top left. Pixels with an alpha below [`LEAST_ALPHA`] are masked: no stage
/// makes anything of them. All others are opaque.
#[derive(Debug, Clone, Copy)]
pub struct ImageView<'a> {
    data: &'a [u8],
    width: usize,
    height: usize,
    masked: bool,
}

impl<'a> ImageView<'a> {
    /// Wraps `data`, 4·width·height bytes; `name` is how errors call it.
    ///
    /// # Errors
    /// `invalid-argument` for an empty side, `size-mismatch` for another length.
    pub fn new(name: &'static str, data: &'a [u8], width: usize, height: usize) -> Result<Self> {
        check_len(name, data.len(), width, height, 4)?;
        Ok(Self::of(data, width, height))
    }

    /// Of so many bytes.
    fn of(data: &'a [u8], width: usize, height: usize) -> Self {
        // In pieces, so that each is a loop without a way out, which the compiler turns into SIMD.
        let least = |pixels: &[[u8; 4]]| pixels.iter().fold(u8::MAX, |least, pixel| least.min(pixel[3]));
        let masked = data.as_chunks().0.chunks(4096).any(|pixels| least(pixels) < LEAST_ALPHA);
        Self { data, width, height, masked }
    }

    /// Whether any pixel is masked.
    pub fn is_masked(&self) -> bool {
        self.masked
    }

    /// Whether a pixel of this picture is there.
    #[inline]
    pub fn is_there(&self, pixel: [u8; 4]) -> bool {
        !self.masked || pixel[3] >= LEAST_ALPHA
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

    /// Borrows the image. Looks once at the alpha of all pixels.
    pub fn view(&self) -> ImageView<'_> {
        ImageView::of(&self.data, self.width, self.height)
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

/// width·height, or the largest number if that overflows: no allocator has room for so many.
pub(crate) fn area(name: &'static str, width: usize, height: usize) -> Result<usize> {
    check_sides(name, width, height)?;
    Ok(width.saturating_mul(height))
}

/// How many are not 0.
pub(crate) fn marked(marks: &[u8]) -> usize {
    marks.iter().filter(|&&mark| mark != 0).count()
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
    if size == expected { Ok(()) } else { Err(Error::WrongSize { name, expected, actual: size }.into()) }
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

/// Makes room for some more values where there is none: for lists that grow.
pub(crate) fn reserve_more<T>(list: &mut Vec<T>, count: usize) -> Result<()> {
    if list.capacity() - list.len() < count { reserve(list, list.len().max(1024)) } else { Ok(()) }
}

#[cold]
fn out_of_memory(len: usize, size: usize) -> Box<Error> {
    Error::OutOfMemory { bytes: (len as u64).saturating_mul(size as u64) }.into()
}
