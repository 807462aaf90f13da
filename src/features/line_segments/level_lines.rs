//! The level lines of a smoothed and reduced photo (sections 2.1 to 2.3 of the paper).

use wide::{CmpGt, f32x4};

use super::LineSegmentOptions;
use crate::distance::STRAIGHT;
use crate::features::luma::{Luma, luma};
use crate::image::{reserve, zeroed};
use crate::lanes::{LANES, add_weighted, load};
use crate::transparency::distance_to_missing;
use crate::{ImageView, Result};

/// Pixels of the reduced photo from a masked one within which nothing has a direction: the smoothing reaches as far.
const MARGIN: f64 = 3.0;
/// Bins of the pseudo-ordering by gradient.
const BINS: usize = 1024;

/// At every pixel the direction of the level line and how steep the gray levels are across it.
pub(super) struct LevelLines {
    pub width: usize,
    pub height: usize,
    /// Unit vectors, the gradient turned by a quarter; zero where the gradient is too weak to have a direction.
    pub directions: Vec<[f32; 2]>,
    /// Magnitude of the gradient in gray levels per pixel; 0 where it is too weak.
    pub magnitudes: Vec<f32>,
}

impl LevelLines {
    /// Of the reduced photo; gradients up to `weak` have no direction.
    pub fn new(image: ImageView<'_>, options: &LineSegmentOptions, weak: f64) -> Result<Self> {
        let gray = luma(image, image.size())?;
        let Luma { data, width, height } = reduce(&gray, options.scale, options.sigma_scale)?;
        drop(gray);
        let (mut directions, mut magnitudes) = (zeroed::<[f32; 2]>(width * height)?, zeroed::<f32>(width * height)?);
        let (weak, half) = (f32x4::splat(weak as f32), f32x4::splat(0.5));
        for y in 1..height {
            let row = (y - 1) * width..y * width - 1;
            let out = directions[row.clone()].chunks_mut(LANES).zip(magnitudes[row.clone()].chunks_mut(LANES));
            for (from, (directions, magnitudes)) in row.step_by(LANES).zip(out) {
                let [a, b] = [0, 1].map(|x| load(&data, from + x));
                let [c, d] = [0, 1].map(|x| load(&data, from + width + x));
                let (falling, rising) = (d - a, b - c);
                let (x, y) = (half * (falling + rising), half * (falling - rising));
                let norm = (x * x + y * y).sqrt();
                let steep = norm.cmp_gt(weak);
                let [u, v, norm] = [-y / norm, x / norm, norm].map(|value| (value & steep).to_array());
                directions.iter_mut().zip(u).zip(v).for_each(|((direction, u), v)| *direction = [u, v]);
                magnitudes.copy_from_slice(&norm[..magnitudes.len()]);
            }
        }
        let mut found = Self { width, height, directions, magnitudes };
        found.drop_missing(image, options.scale)?;
        Ok(found)
    }

    /// Leaves no direction where the photo is masked, nor next to that: it would be that of the mask's outline.
    fn drop_missing(&mut self, image: ImageView<'_>, scale: f64) -> Result<()> {
        let Some(distances) = distance_to_missing(image)? else { return Ok(()) };
        let least = ((MARGIN / scale) * f64::from(STRAIGHT)) as u16;
        // A gradient belongs to the middle of the four pixels that it was computed from.
        let place = |i: usize, side: usize| (((i + 1) as f64 / scale) as usize).min(side - 1);
        for i in 0..self.magnitudes.len() {
            let (x, y) = (place(i % self.width, image.width()), place(i / self.width, image.height()));
            if distances[y * image.width() + x] < least {
                (self.directions[i], self.magnitudes[i]) = ([0.0; 2], 0.0);
            }
        }
        Ok(())
    }

    /// Pixels with a direction, steepest first (in bins, as a full order changes nothing).
    pub fn by_strength(&self) -> Result<Vec<usize>> {
        let most = self.magnitudes.iter().fold(0.0, |most: f32, &m| most.max(m));
        let bin = |magnitude: f32| BINS - 1 - ((magnitude / most * BINS as f32) as usize).min(BINS - 1);
        let defined = || self.magnitudes.iter().enumerate().filter(|&(_, &magnitude)| magnitude > 0.0);
        let mut starts = [0; BINS + 1];
        for (_, &magnitude) in defined() {
            starts[bin(magnitude) + 1] += 1;
        }
        for i in 1..=BINS {
            starts[i] += starts[i - 1];
        }
        let mut order: Vec<usize> = zeroed(starts[BINS])?;
        for (i, &magnitude) in defined() {
            let next = &mut starts[bin(magnitude)];
            order[*next] = i;
            *next += 1;
        }
        Ok(order)
    }
}

/// The picture at `scale` of its size, smoothed by a Gaussian of `sigma` pixels of the result, and [`LANES`] zeros. Sides are rounded
/// up.
fn reduce(gray: &Luma, scale: f64, sigma: f64) -> Result<Luma> {
    let reduced = |side: usize| ((side as f64 * scale).ceil() as usize).max(1);
    let (width, height) = (reduced(gray.width), reduced(gray.height));
    let sigma = sigma / scale;
    // Beyond, the Gaussian is below a thousandth.
    let radius = (3.717 * sigma).ceil() as usize;
    let columns = Taps::all(width, gray.width, scale, sigma, radius)?;
    let rows = Taps::all(height, gray.height, scale, sigma, radius)?;
    let mut data = Vec::new();
    reserve(&mut data, width * height + LANES)?;
    // One smoothed row, its end values repeated on either side.
    let mut line: Vec<f32> = zeroed(gray.width + 2 * radius)?;
    for row in &rows {
        line.fill(0.0);
        let inner = &mut line[radius..radius + gray.width];
        for (weight, y) in row.weights.iter().zip(row.first..) {
            let y = y.saturating_sub(radius).min(gray.height - 1);
            add_weighted(inner, &gray.data[y * gray.width..][..gray.width], *weight);
        }
        let (left, right) = (inner[0], inner[gray.width - 1]);
        line[..radius].fill(left);
        line[radius + gray.width..].fill(right);
        data.extend(
            columns
                .iter()
                .map(|c| c.weights.iter().zip(&line[c.first..]).map(|(weight, value)| weight * value).sum::<f32>()),
        );
    }
    data.resize(width * height + LANES, 0.0);
    Ok(Luma { data, width, height })
}

/// The weights of one value of the reduced picture.
struct Taps {
    /// Index of the first value, `radius` more than in the picture.
    first: usize,
    weights: Vec<f32>,
}

impl Taps {
    fn all(reduced: usize, full: usize, scale: f64, sigma: f64, radius: usize) -> Result<Vec<Self>> {
        let mut all = Vec::new();
        reserve(&mut all, reduced)?;
        for i in 0..reduced {
            let centre = ((i as f64 + 0.5) / scale - 0.5).max(0.0).min((full - 1) as f64);
            let first = (centre + 0.5) as usize;
            let mut weights = Vec::new();
            reserve(&mut weights, 2 * radius + 1)?;
            weights.extend((0..=2 * radius).map(|k| {
                let from = ((first + k) as f64 - radius as f64 - centre) / sigma;
                libm::exp(-0.5 * from * from) as f32
            }));
            let sum: f32 = weights.iter().sum();
            weights.iter_mut().for_each(|weight| *weight /= sum);
            all.push(Self { first, weights });
        }
        Ok(all)
    }
}
