//! Gaussian smoothing of a picture that grows row by row, of which only the last rows are kept.

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
    #[inline(never)]
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

/// How a picture goes on beyond its border.
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
    #[inline(never)]
    pub fn new(width: usize, capacity: usize) -> Result<Self> {
        let blocks = width.div_ceil(BLOCK);
        Ok(Self { data: zeroed(blocks * capacity)?, blocks, capacity, rows: 0 })
    }

    fn start(&self, y: usize) -> usize {
        y % self.capacity * self.blocks
    }

    #[inline(never)]
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
    #[inline(never)]
    pub fn append(&mut self, from: &Window, kernel: &Kernel, to: &mut Window) {
        let y = to.rows as isize;
        let row = |y: isize| from.blocks(self.mirror.index(y, self.height));
        let last = self.line.len() - 1;
        let sums = &mut self.line[1..last];
        for (sum, middle) in sums.iter_mut().zip(row(y)) {
            *sum = times(middle, kernel.weights[0]);
        }
        for (i, &weight) in (1..).zip(&kernel.weights[1..=kernel.radius]) {
            for ((sum, above), below) in sums.iter_mut().zip(row(y - i)).zip(row(y + i)) {
                add(sum, above, below, weight);
            }
        }
        self.mirror_ends(kernel.radius);
        let line: &[f32] = bytemuck::cast_slice(&self.line);
        for (block, out) in to.next().iter_mut().enumerate() {
            let x = BLOCK * (block + 1);
            let mut sum = times(&load(line, x), kernel.weights[0]);
            for (i, &weight) in (1..).zip(&kernel.weights[1..=kernel.radius]) {
                let aside = i * self.channels;
                add(&mut sum, &load(line, x - aside), &load(line, x + aside), weight);
            }
            *out = sum;
        }
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

#[inline(always)]
fn times(v: &Block, weight: f32) -> Block {
    [v[0] * weight, v[1] * weight, v[2] * weight, v[3] * weight]
}

#[inline(always)]
fn add(sum: &mut Block, a: &Block, b: &Block, weight: f32) {
    // Written out, so that the sums stay in registers.
    *sum = [
        sum[0] + (a[0] + b[0]) * weight,
        sum[1] + (a[1] + b[1]) * weight,
        sum[2] + (a[2] + b[2]) * weight,
        sum[3] + (a[3] + b[3]) * weight,
    ];
}

/// A block from any place of a row; zeros past its end.
#[inline(always)]
fn load(row: &[f32], x: usize) -> Block {
    match row.get(x..x + BLOCK).map(|row| row.as_chunks().0) {
        Some(&[a, b, c, d]) => [a, b, c, d].map(f32x4::new),
        _ => Block::default(),
    }
}
