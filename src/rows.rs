//! Gaussian smoothing of an image that grows row by row, of which only the last rows are stored.
//!
//! A WebAssembly engine replaces a function's first, slow code when the function is called again, never in the middle of a
//! call. So the body of a loop that runs for a whole photo is a function of its own, kept so by `#[inline(never)]` where the
//! compiler would inline it and the first call would take longer for it. Times given there are those of 1000×690 pixels.

use wide::f32x4;

use crate::Result;
use crate::image::zeroed;

/// Floats handled together: four vectors, enough to keep the adders busy.
pub(crate) const BLOCK: usize = 16;
pub(crate) type Block = [f32x4; BLOCK / 4];
/// Most taps on one side.
const MOST: usize = 10;

/// A symmetric kernel of unit sum.
pub(crate) struct Kernel {
    /// Taps on one side.
    pub radius: usize,
    /// Weight at 0, 1, … from the centre.
    weights: [f32; MOST + 1],
}

impl Kernel {
    /// A Gaussian of deviation `sigma`, at most 3.7 samples, cut off at 3 σ. What that takes off its variance is made good by
    /// starting from a wider bell.
    pub fn gaussian(sigma: f64) -> Self {
        let radius = ((3.0 * sigma + 0.5) as usize).clamp(1, MOST);
        let variance = sigma * sigma;
        let (mut kernel, mut measured) = Self::bell(variance, radius);
        let mut wider = variance;
        for _ in 1..8 {
            wider *= variance / measured;
            (kernel, measured) = Self::bell(wider, radius);
        }
        kernel
    }

    /// A Gaussian of this variance, cut off at `radius`, at most 10; and what variance that leaves.
    pub fn bell(variance: f64, radius: usize) -> (Self, f64) {
        let mut bell = [0.0; MOST + 1];
        let mut moments = [0.0; 2];
        for (i, weight) in bell.iter_mut().enumerate().take(radius + 1) {
            let square = (i * i) as f64;
            *weight = libm::exp(-square / (2.0 * variance));
            let twice = if i > 0 { 2.0 * *weight } else { *weight };
            moments = [moments[0] + twice, moments[1] + twice * square];
        }
        let weights = bell.map(|weight| (weight / moments[0]) as f32);
        (Self { radius, weights }, moments[1] / moments[0])
    }
}

/// How a picture is mirrored beyond its border.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Mirror {
    /// d c b | a b c d | c b a
    AtPixel,
    /// d c b a | a b c d | d c b a
    AtEdge,
}

impl Mirror {
    /// The index inside that stands for `i`.
    fn index(self, i: isize, len: usize) -> usize {
        let (last, edge) = (len as isize - 1, isize::from(self == Mirror::AtEdge));
        let period = 2 * (last + edge).max(1);
        let at = i.rem_euclid(period);
        at.min(period - edge - at).min(last) as usize
    }
}

/// The last rows of a picture that grows downwards. Row y is kept at y mod capacity.
pub(crate) struct Window {
    data: Vec<Block>,
    blocks: usize,
    capacity: usize,
    /// Rows taken in so far.
    pub rows: usize,
}

impl Window {
    pub fn new(width: usize, capacity: usize) -> Result<Self> {
        let blocks = width.div_ceil(BLOCK);
        Ok(Self { data: zeroed(blocks * capacity)?, blocks, capacity, rows: 0 })
    }

    fn start(&self, y: usize) -> usize {
        y % self.capacity * self.blocks
    }

    pub fn blocks(&self, y: usize) -> &[Block] {
        &self.data[self.start(y)..][..self.blocks]
    }

    /// Row `y`, with some floats of no meaning at its end.
    pub fn row(&self, y: usize) -> &[f32] {
        bytemuck::cast_slice(self.blocks(y))
    }

    /// The place of the next row, to be written.
    pub fn next(&mut self) -> &mut [Block] {
        let start = self.start(self.rows);
        self.rows += 1;
        &mut self.data[start..][..self.blocks]
    }
}

/// Smooths rows; holds one row between the passes.
pub(crate) struct Smoother {
    width: usize,
    height: usize,
    /// Values of a pixel, next to each other; times the kernel's radius at most [`BLOCK`].
    channels: usize,
    mirror: Mirror,
    /// One row with [`BLOCK`] floats on either side.
    line: Vec<Block>,
}

impl Smoother {
    pub fn new(width: usize, height: usize, channels: usize, mirror: Mirror) -> Result<Self> {
        let line = zeroed((channels * width).div_ceil(BLOCK) + 2)?;
        Ok(Self { width, height, channels, mirror, line })
    }

    /// Appends the smoothed next row of `from` to `to`. The window must reach `kernel.radius` rows either side of it.
    pub fn append(&mut self, from: &Window, kernel: &Kernel, to: &mut Window) {
        let y = to.rows as isize;
        let row = |y: isize| from.row(self.mirror.index(y, self.height));
        let last = self.line.len() - 1;
        let mut sides = [(&[] as &[f32], &[] as &[f32]); MOST];
        for (i, side) in (1..).zip(&mut sides[..kernel.radius]) {
            *side = (row(y - i), row(y + i));
        }
        weigh(row(y), &sides, kernel, &mut self.line[1..last]);
        self.mirror_ends(kernel.radius);
        let line: &[f32] = bytemuck::cast_slice(&self.line);
        for (i, side) in (1..).zip(&mut sides[..kernel.radius]) {
            let aside = i * self.channels;
            *side = (&line[BLOCK - aside..], &line[BLOCK + aside..]);
        }
        weigh(&line[BLOCK..], &sides, kernel, to.next());
    }

    fn mirror_ends(&mut self, radius: usize) {
        let line: &mut [f32] = bytemuck::cast_slice_mut(&mut self.line);
        let (width, radius) = (self.width as isize, radius as isize);
        for outside in (-radius..0).chain(width..width + radius) {
            let inside = BLOCK + self.channels * self.mirror.index(outside, self.width);
            let outside = (BLOCK as isize + self.channels as isize * outside) as usize;
            line.copy_within(inside..inside + self.channels, outside);
        }
    }
}

/// The weighted sum of rows: the middle one, and one on either side for every tap.
fn weigh(middle: &[f32], sides: &[(&[f32], &[f32]); MOST], kernel: &Kernel, out: &mut [Block]) {
    let [first, weights @ ..] = &kernel.weights;
    let taps = kernel.radius.min(MOST);
    for (x, out) in (0..).step_by(BLOCK).zip(out) {
        let Some(middle) = block(middle, x) else { return };
        // Written out, so that the sums stay in registers.
        let [a, b, c, d] = middle.map(f32x4::new);
        let mut sum = [a * *first, b * *first, c * *first, d * *first];
        for ((before, after), &weight) in sides[..taps].iter().zip(weights) {
            let (Some(before), Some(after)) = (block(before, x), block(after, x)) else { return };
            let pair = |i: usize| (f32x4::new(before[i]) + f32x4::new(after[i])) * weight;
            sum = [sum[0] + pair(0), sum[1] + pair(1), sum[2] + pair(2), sum[3] + pair(3)];
        }
        *out = sum;
    }
}

/// A block from any place of a row.
#[inline(always)]
fn block(row: &[f32], x: usize) -> Option<&[[f32; 4]; BLOCK / 4]> {
    row.get(x..x + BLOCK)?.as_chunks().0.first_chunk()
}
