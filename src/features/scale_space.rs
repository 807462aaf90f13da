//! The Gaussian scale space, octave by octave (D. Lowe, *Distinctive Image Features from Scale-Invariant Keypoints*, IJCV
//! 60 (2004), section 3).
//!
//! An octave is a pipeline of rows: each level is smoothed out of the one above as soon as that has enough rows, and
//! only as many rows are kept as the next step reaches. What stays is the three levels that keypoints are described
//! on and the picture that the next octave starts from.

use wide::f32x4;

use super::extrema::{self, Extremum, SCALES};
use super::luma::Luma;
use crate::image::reserve;
use crate::observer::{Observer, report};
use crate::rows::{BLOCK, Block, Kernel, Mirror, Smoother, Window};
use crate::upsampling::{WEIGHTS, neighbours};
use crate::{Result, Stage};

/// Deviation of an octave's first level, in its pixels.
pub(super) const SIGMA: f64 = 1.6;
/// Assumed blur of a photo, in its pixels (Lowe 2004, section 3.3).
const CAMERA_SIGMA: f64 = 0.5;
/// Rows each step of the pipeline makes at a time.
const BATCH: usize = 8;
/// Turns of the pipeline between two reports of progress.
const TURNS: usize = 32;
/// No octave is smaller than this.
pub(super) const LEAST_SIDE: usize = 16;

/// Every how many pixels of the octave each level is stored, 1 or 2: the coarsest is smooth enough for every second one.
const STEPS: [usize; SCALES] = [1, 1, 2];

/// One level, or every `step`-th pixel of it, in rows of `stride` gray levels.
pub(super) struct Plane {
    pub step: usize,
    pub data: Vec<f32>,
    pub width: usize,
    pub height: usize,
    pub stride: usize,
}

impl Plane {
    /// For an octave of this size.
    fn new(width: usize, height: usize, step: usize) -> Result<Self> {
        let (width, height) = (width.div_ceil(step), height.div_ceil(step));
        // So that four pixels from any column on lie in the row.
        let stride = (width + 4).next_multiple_of(BLOCK);
        let mut data = Vec::new();
        reserve(&mut data, stride * height)?;
        Ok(Self { data, width, height, stride, step })
    }

    /// Takes in row `y` of the octave.
    fn push(&mut self, y: usize, row: &[f32]) {
        if y.is_multiple_of(self.step) {
            match self.step {
                1 => self.data.extend_from_slice(row),
                step => self.data.extend(row.iter().step_by(step)),
            }
            self.data.resize((y / self.step + 1) * self.stride, 0.0);
        }
    }

    /// Every how many rows gradients are taken: all levels are smooth enough for every second row of the octave.
    pub fn rows_apart(&self) -> usize {
        2 / self.step
    }
}

/// The levels 1, 2, 3 of an octave.
pub(super) type Levels = [Plane; SCALES];

/// The image that an octave starts from.
pub(super) enum Base {
    /// The photo, to be doubled in size or not.
    Photo { luma: Luma, doubled: bool },
    /// Every second pixel of the level with twice the octave's first σ.
    Halved(Luma),
}

impl Base {
    fn size(&self) -> (usize, usize) {
        match self {
            Base::Photo { luma, doubled: true } => (2 * luma.width, 2 * luma.height),
            Base::Photo { luma, .. } | Base::Halved(luma) => (luma.width, luma.height),
        }
    }

    /// Row `y` in the octave's pixels.
    fn row(&self, y: usize, out: &mut [Block]) {
        let out: &mut [f32] = bytemuck::cast_slice_mut(out);
        match self {
            Base::Photo { luma, doubled: true } => double(luma, y, out),
            Base::Photo { luma, .. } | Base::Halved(luma) => {
                out[..luma.width].copy_from_slice(&luma.data[y * luma.width..][..luma.width]);
            }
        }
    }

    /// Standard deviation of the smoothing that is missing to reach [`SIGMA`]; `None` for none.
    fn sigma(&self) -> Option<f64> {
        match self {
            Base::Photo { doubled, .. } => {
                let camera = if *doubled { 2.0 * CAMERA_SIGMA } else { CAMERA_SIGMA };
                Some((SIGMA * SIGMA - camera * camera).sqrt())
            }
            Base::Halved(_) => None,
        }
    }
}

/// Row `y` of the image upsampled by 2.
#[inline(never)] // the first detection takes 345 ms instead of 364, see `crate::rows`
fn double(luma: &Luma, y: usize, out: &mut [f32]) {
    let [near, far] = neighbours(y, luma.height).map(|y| &luma.data[y * luma.width..][..luma.width]);
    let value = |near: f32, far: f32| WEIGHTS[0] * near + WEIGHTS[1] * far;
    let mut before = value(near[0], far[0]);
    let mut here = before;
    let after = near
        .iter()
        .zip(far)
        .skip(1)
        .map(|(&n, &f)| value(n, f))
        .chain([value(near[luma.width - 1], far[luma.width - 1])]);
    for (pair, after) in out.as_chunks_mut::<2>().0.iter_mut().zip(after) {
        *pair = [value(here, before), value(here, after)];
        (before, here) = (here, after);
    }
}

/// The kernels between the levels: level i has deviation σ·2^(i/3).
fn kernels() -> [Kernel; SCALES + 2] {
    // 2^(2/3), squared ratio of neighbouring deviations.
    const RATIO: f64 = 1.587_401_051_968_199_4;
    let mut variance = SIGMA * SIGMA;
    std::array::from_fn(|_| {
        let kernel = Kernel::gaussian((variance * (RATIO - 1.0)).sqrt());
        variance *= RATIO;
        kernel
    })
}

/// Builds octaves from the finest on.
pub(super) struct Builder {
    base: Base,
    kernels: [Kernel; SCALES + 2],
}

impl Builder {
    pub fn new(luma: Luma, doubled: bool) -> Self {
        Self { base: Base::Photo { luma, doubled }, kernels: kernels() }
    }

    /// The next octave's levels; its extrema go to `found`. `None` when it would be too small.
    pub fn octave(
        &mut self,
        octave: u8,
        limits: &extrema::Limits,
        found: &mut Vec<Extremum>,
        observer: &mut dyn Observer,
    ) -> Result<Option<Levels>> {
        let (width, height) = self.base.size();
        if width.min(height) < LEAST_SIDE {
            return Ok(None);
        }
        let mut pipeline = Pipeline::new(&self.base, &self.kernels)?;
        let mut scanner = extrema::Scanner::new(octave, (width, height));
        // An octave is a quarter of the one before, so that the first takes three quarters of the time.
        let left = 1.0 / (1u64 << (2 * octave)) as f32;
        for turn in 0.. {
            let done = pipeline.differences[SCALES + 1].rows;
            if done == height {
                break;
            }
            if turn % TURNS == 0 {
                let fraction = 1.0 - left + 0.75 * left * done as f32 / height as f32;
                report(observer, Stage::Detect, 0.5 * fraction)?;
            }
            pipeline.turn(&self.base, &self.kernels);
            scanner.scan(&pipeline.differences, limits, found);
        }
        let Pipeline { levels, next, .. } = pipeline;
        self.base = Base::Halved(next);
        Ok(Some(levels))
    }
}

/// The rows of an octave on their way from the base to the differences of Gaussians.
struct Pipeline {
    height: usize,
    /// Smooths the base to the first level; `None` if it is that already.
    first: Option<Kernel>,
    smoother: Smoother,
    /// The base.
    source: Window,
    /// The levels 0 to [`SCALES`] + 2, and the differences between them.
    gauss: Vec<Window>,
    differences: Vec<Window>,
    levels: Levels,
    /// What the next octave starts from.
    next: Luma,
}

impl Pipeline {
    fn new(base: &Base, kernels: &[Kernel; SCALES + 2]) -> Result<Self> {
        let (width, height) = base.size();
        let reach: usize = kernels[1..].iter().map(|k| k.radius).sum();
        let mut gauss = Vec::with_capacity(SCALES + 3);
        for level in 0..SCALES + 3 {
            let radius = kernels.get(level).map_or(0, |k| k.radius);
            gauss.push(Window::new(width, 2 * radius + 1 + BATCH)?);
        }
        let mut differences = Vec::with_capacity(SCALES + 2);
        for _ in 0..SCALES + 2 {
            differences.push(Window::new(width, reach + 2 * BATCH + 2 * extrema::REACH + 2)?);
        }
        let first = base.sigma().map(Kernel::gaussian);
        let radius = first.as_ref().map_or(0, |k| k.radius);
        let source = Window::new(width, 2 * radius + 1 + BATCH)?;
        let smoother = Smoother::new(width, height, 1, Mirror::AtPixel)?;
        let plane = |i: usize| Plane::new(width, height, STEPS[i]);
        let levels = [plane(0)?, plane(1)?, plane(2)?];
        let mut next = Luma { data: Vec::new(), width: width / 2, height: height / 2 };
        reserve(&mut next.data, next.width * next.height)?;
        Ok(Self { height, first, smoother, source, gauss, differences, levels, next })
    }

    /// Makes up to [`BATCH`] rows of each level.
    fn turn(&mut self, base: &Base, kernels: &[Kernel; SCALES + 2]) {
        let height = self.height;
        // How many rows of a level can be made from the rows of the one above it.
        let ready = |above: &Window, radius: usize, level: &Window| {
            let ready = if above.rows == height { height } else { above.rows.saturating_sub(radius) };
            ready.saturating_sub(level.rows).min(BATCH)
        };
        for _ in 0..BATCH.min(height - self.source.rows) {
            let y = self.source.rows;
            base.row(y, self.source.next());
        }
        let radius = self.first.as_ref().map_or(0, |k| k.radius);
        for _ in 0..ready(&self.source, radius, &self.gauss[0]) {
            match &self.first {
                Some(kernel) => self.smoother.append(&self.source, kernel, &mut self.gauss[0]),
                None => {
                    let y = self.gauss[0].rows;
                    self.gauss[0].next().copy_from_slice(self.source.blocks(y));
                }
            }
        }
        for (level, kernel) in (1..).zip(kernels) {
            let Some(([.., above], [here, ..])) = self.gauss.split_at_mut_checked(level) else { break };
            for _ in 0..ready(above, kernel.radius, here) {
                let y = here.rows;
                self.smoother.append(above, kernel, here);
                subtract(here.blocks(y), above.blocks(y), self.differences[level - 1].next());
                if let Some(plane) = self.levels.get_mut(level - 1) {
                    plane.push(y, here.row(y));
                }
                if level == SCALES && y % 2 == 0 && y / 2 < self.next.height {
                    let pairs = &here.row(y).as_chunks::<2>().0[..self.next.width];
                    self.next.data.extend(pairs.iter().map(|pair| pair[0]));
                }
            }
        }
    }
}

#[inline(never)] // the first detection takes 345 ms instead of 364, see `crate::rows`
fn subtract(a: &[Block], b: &[Block], out: &mut [Block]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = std::array::from_fn(|k| a[k] - b[k]);
    }
}

impl Plane {
    /// Central differences along x and y at four pixels from (x, y) on, in half gray levels. Not at the plane's border.
    #[inline(always)]
    pub fn gradient(&self, x: usize, y: usize) -> (f32x4, f32x4) {
        let at = y * self.stride + x;
        (self.difference(at + 1, at - 1), self.difference(at + self.stride, at - self.stride))
    }

    #[inline(always)]
    fn difference(&self, a: usize, b: usize) -> f32x4 {
        let four = |at: usize| self.data.get(at..).and_then(|rest| rest.first_chunk());
        match (four(a), four(b)) {
            (Some(a), Some(b)) => f32x4::new(*a) - f32x4::new(*b),
            _ => f32x4::ZERO,
        }
    }
}
