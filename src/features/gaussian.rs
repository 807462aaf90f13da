//! Gaussian smoothing of single rows out of a window of rows.

use wide::f32x4;

use crate::Result;
use crate::image::zeroed;

/// Floats handled together: four vectors, enough to keep the adders busy.
pub(super) const BLOCK: usize = 16;
pub(super) type Block = [f32x4; BLOCK / 4];
/// Most taps on one side.
const MOST: usize = 10;

/// A symmetric kernel of unit sum.
pub(super) struct Kernel {
    /// Taps on one side.
    pub radius: usize,
    /// Weight at 0, 1, … from the centre.
    weights: [f32; MOST + 1],
}

impl Kernel {
    /// A Gaussian of deviation `sigma`, at most 3.7 samples, cut off at 3 σ. What that takes off its variance is made good by
    /// starting from a wider bell.
    #[inline(never)]
    pub fn gaussian(sigma: f64) -> Self {
        let radius = ((3.0 * sigma + 0.5) as usize).clamp(1, MOST);
        let variance = sigma * sigma;
        let mut wider = variance;
        let mut weights = [0.0; MOST + 1];
        for _ in 0..8 {
            let mut moments = [1.0, 0.0];
            for (i, weight) in weights.iter_mut().enumerate().take(radius + 1) {
                let square = (i * i) as f64;
                *weight = libm::exp(-square / (2.0 * wider));
                if i > 0 {
                    moments[0] += 2.0 * *weight;
                    moments[1] += 2.0 * *weight * square;
                }
            }
            wider *= variance * moments[0] / moments[1];
            weights.iter_mut().for_each(|weight| *weight /= moments[0]);
        }
        Self { radius, weights: weights.map(|weight| weight as f32) }
    }
}

/// Index where d c b | a b c d | c b a goes on for ever.
pub(super) fn mirror(i: isize, len: usize) -> usize {
    let period = 2 * (len as isize - 1).max(1);
    let at = i.rem_euclid(period);
    at.min(period - at).min(len as isize - 1) as usize
}

/// The last rows of a picture that grows downwards. Row y is kept at y mod capacity.
pub(super) struct Window {
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
pub(super) struct Smoother {
    width: usize,
    height: usize,
    /// One row with `BLOCK` floats on either side.
    line: Vec<Block>,
}

impl Smoother {
    pub fn new(width: usize, height: usize) -> Result<Self> {
        Ok(Self { width, height, line: zeroed(width.div_ceil(BLOCK) + 2)? })
    }

    /// Appends the smoothed next row of `from` to `to`. The window must reach `kernel.radius` rows either side of it.
    #[inline(never)]
    pub fn append(&mut self, from: &Window, kernel: &Kernel, to: &mut Window) {
        let y = to.rows as isize;
        let mut above = [0; MOST + 1];
        let mut below = [0; MOST + 1];
        for i in 0..=kernel.radius {
            above[i] = from.start(mirror(y - i as isize, self.height));
            below[i] = from.start(mirror(y + i as isize, self.height));
        }
        let taps = || kernel.weights.iter().zip(above.iter().zip(&below)).skip(1).take(kernel.radius);
        let last = self.line.len() - 1;
        for (x, out) in self.line[1..last].iter_mut().enumerate() {
            let mut sum = from.data[above[0] + x].map(|v| v * kernel.weights[0]);
            for (&weight, (&above, &below)) in taps() {
                let (a, b) = (&from.data[above + x], &from.data[below + x]);
                for k in 0..sum.len() {
                    sum[k] += (a[k] + b[k]) * weight;
                }
            }
            *out = sum;
        }
        self.mirror_ends(kernel.radius);
        let line: &[f32] = bytemuck::cast_slice(&self.line);
        for (block, out) in to.next().iter_mut().enumerate() {
            let x = BLOCK * (block + 1);
            let mut sum = load(line, x).map(|v| v * kernel.weights[0]);
            for (i, &weight) in kernel.weights.iter().enumerate().take(kernel.radius + 1).skip(1) {
                let (a, b) = (load(line, x - i), load(line, x + i));
                for k in 0..sum.len() {
                    sum[k] += (a[k] + b[k]) * weight;
                }
            }
            *out = sum;
        }
    }

    fn mirror_ends(&mut self, radius: usize) {
        let width = self.width;
        let line: &mut [f32] = bytemuck::cast_slice_mut(&mut self.line);
        for i in 1..=radius as isize {
            line[BLOCK - i as usize] = line[BLOCK + mirror(-i, width)];
        }
        for i in 0..radius {
            line[BLOCK + width + i] = line[BLOCK + mirror((width + i) as isize, width)];
        }
    }
}

/// A block from any place of a row; zeros past its end.
#[inline(always)]
fn load(row: &[f32], x: usize) -> Block {
    match row.get(x..).and_then(|rest| rest.first_chunk::<BLOCK>()) {
        Some(v) => bytemuck::cast(*v),
        None => Block::default(),
    }
}
