//! Colours of void pixels from the known pixels around them.

use super::window::{Cell, Window};
use crate::image::{reserve, zeroed};
use crate::{Image, Result};

/// How much more a direction weighs where the structure is a clean edge (κ of the paper, its value).
const SHARPNESS: f32 = 25.0;
/// Differences of the tensor's eigenvalues, in squared grey levels, below which a direction is taken for noise.
const NOISE: f32 = 25.0;

/// One void pixel and the neighbourhood it is drawn from: the disc around it, one entry per pixel.
struct Disc {
    /// Distance in the window's cells.
    step: Vec<isize>,
    /// x² + y², x² − y² and 2xy of the offset: what its distance from a line through the centre is made of.
    squared: Vec<f32>,
    difference: Vec<f32>,
    product: Vec<f32>,
    /// 1 / distance.
    nearness: Vec<f32>,
    /// Gaussian of the distance, for the structure tensor.
    bell: Vec<f32>,
    /// 1 / 16ε².
    spread: f32,
}

impl Disc {
    fn new(radius: usize, width: usize) -> Result<Self> {
        let side = 2 * radius + 1;
        let floats = || -> Result<Vec<f32>> {
            let mut v = Vec::new();
            reserve(&mut v, side * side)?;
            Ok(v)
        };
        let (squared, difference, product) = (floats()?, floats()?, floats()?);
        let (nearness, bell) = (floats()?, floats()?);
        let mut step = Vec::new();
        reserve(&mut step, side * side)?;
        let mut disc =
            Self { step, squared, difference, product, nearness, bell, spread: 1.0 / (16 * radius * radius) as f32 };
        let r = radius as i32;
        // Half a pixel more, so that the disc of radius 1 has its diagonal neighbours: a front may have no others.
        let limit = r * r + r;
        for (x, y) in (-r..=r).flat_map(|y| (-r..=r).map(move |x| (x, y))) {
            let d2 = x * x + y * y;
            if d2 == 0 || d2 > limit {
                continue;
            }
            disc.step.push(y as isize * width.cast_signed() + x as isize);
            disc.squared.push(d2 as f32);
            disc.difference.push((x * x - y * y) as f32);
            disc.product.push((2 * x * y) as f32);
            disc.nearness.push(1.0 / (d2 as f32).sqrt());
            // σ is half the radius, and at least one pixel.
            let sigma = (f64::from(r) / 2.0).max(1.0);
            disc.bell.push(libm::exp(f64::from(-d2) / (2.0 * sigma * sigma)) as f32);
        }
        Ok(disc)
    }
}

/// A known pixel: four numbers each, so that one SIMD register holds them.
struct Known {
    /// Red, green, blue, 1.
    colour: [f32; 4],
    /// Structure tensor xx, xy, yy, 1 (all 0 where there is no telling).
    tensor: [f32; 4],
}

/// The filling's state: what is known so far.
pub(super) struct Transport {
    disc: Disc,
    /// Which of `known` a cell of the window is; 0 is none.
    index: Vec<usize>,
    /// Known pixels, then filled ones in the order of filling. The first is a placeholder.
    known: Vec<Known>,
    /// Where the filled ones begin.
    filled: usize,
    /// Scratch: weight of each pixel of the disc, and those of the disc that are known.
    weights: Vec<f32>,
    near: Vec<(usize, usize)>,
}

impl Transport {
    /// Takes in the known pixels of the window; `voids` is how many are going to be filled.
    pub fn new(window: &Window, image: &Image, radius: usize, voids: usize) -> Result<Self> {
        let disc = Disc::new(radius, window.width)?;
        let mut index = zeroed(window.cells.len())?;
        let mut known = Vec::new();
        let count = window.cells.iter().filter(|&&cell| cell == Cell::Known).count();
        reserve(&mut known, 1 + count + voids)?;
        known.push(Known { colour: [0.0; 4], tensor: [0.0; 4] });
        for (cells, pixels) in window.rows(image) {
            let pixels = image.data[4 * pixels.start..4 * pixels.end].as_chunks().0;
            for ((cell, index), &[r, g, b, _]) in window.cells[cells.clone()].iter().zip(&mut index[cells]).zip(pixels)
            {
                if *cell == Cell::Known {
                    *index = known.len();
                    let colour = [f32::from(r), f32::from(g), f32::from(b), 1.0];
                    known.push(Known { colour, tensor: [0.0; 4] });
                }
            }
        }
        for cell in (0..window.cells.len()).filter(|&cell| index[cell] != 0) {
            let tensor = tensor(&index, &known, cell, window.width);
            known[index[cell]].tensor = tensor;
        }
        let weights = zeroed(disc.step.len())?;
        let mut near = Vec::new();
        reserve(&mut near, disc.step.len())?;
        Ok(Self { disc, index, filled: known.len(), known, weights, near })
    }

    /// Fills the cells of one front. They see the earlier fronts but not one another: the order within a front, and
    /// so the picture's orientation, makes no difference.
    pub fn advance(&mut self, front: &[usize]) {
        let first = self.known.len();
        for &cell in front {
            let pixel = self.transported(cell);
            self.known.push(pixel);
        }
        for (slot, &cell) in (first..).zip(front) {
            self.index[cell] = slot;
        }
    }

    /// Writes the filled pixels, which are the first of `order`, into the picture.
    pub fn paint(&self, order: &[usize], window: &Window, image: &mut Image) {
        for (&cell, Known { colour, .. }) in order.iter().zip(&self.known[self.filled..]) {
            let at = 4 * window.pixel(cell, image);
            let [r, g, b, _] = colour.map(|v| (v + 0.5) as u8);
            image.data[at..at + 4].copy_from_slice(&[r, g, b, 255]);
        }
    }

    fn transported(&mut self, cell: usize) -> Known {
        let Self { disc, index, known, weights, near, .. } = self;
        near.clear();
        near.extend(disc.step.iter().enumerate().filter_map(|(i, &step)| {
            let slot = index[cell.wrapping_add_signed(step)];
            (slot != 0).then_some((i, slot))
        }));
        let mut structure = [0.0; 4];
        for &(i, slot) in near.iter() {
            add(&mut structure, disc.bell[i], &known[slot].tensor);
        }
        weigh(disc, structure, weights);
        let (mut colour, mut tensor) = ([0.0; 4], [0.0; 4]);
        for &(i, slot) in near.iter() {
            add(&mut colour, weights[i], &known[slot].colour);
            add(&mut tensor, weights[i], &known[slot].tensor);
        }
        Known { colour: mean(colour), tensor: mean(tensor) }
    }
}

/// w = 1/r · e^(−μ²t²/2ε²) of every pixel of the disc, where t is its distance from the line through the centre along
/// the structure, ε the disc's radius and μ from 1 (no direction: near pixels weigh most) to 1 + κ (an edge).
///
/// The exponential is replaced by (1 + z/8)⁻⁸, which is nearly the same bell, but plain arithmetic, and never 0.
fn weigh(disc: &Disc, structure: [f32; 4], weights: &mut [f32]) {
    let [xx, xy, yy, _] = mean(structure);
    let (difference, product) = (xx - yy, 2.0 * xy);
    let gap = (difference * difference + product * product).sqrt(); // between the eigenvalues
    // Across the structure, at angle θ: cos 2θ and sin 2θ. The coherence is 1 for a straight edge, 0 for a texture.
    let (cos, sin) = if gap > 0.0 { (difference / gap, product / gap) } else { (0.0, 0.0) };
    let coherence = gap / (xx + yy + NOISE);
    let mu = 1.0 + SHARPNESS * coherence * coherence;
    let scale = mu * mu * disc.spread;
    let offsets = disc.squared.iter().zip(&disc.difference).zip(&disc.product).zip(&disc.nearness);
    for (weight, (((&r2, &d), &p), &nearness)) in weights.iter_mut().zip(offsets) {
        let t2 = (r2 + cos * d + sin * p) / 2.0;
        let z = 1.0 + scale * t2;
        let z4 = (z * z) * (z * z);
        *weight = nearness / (z4 * z4);
    }
}

/// Structure tensor of the plane that fits the known pixels of the 3×3 neighbourhood best, summed over the channels.
fn tensor(index: &[usize], known: &[Known], cell: usize, width: usize) -> [f32; 4] {
    let centre = known[index[cell]].colour;
    let (mut xx, mut xy, mut yy) = (0.0f32, 0.0f32, 0.0f32);
    let (mut along_x, mut along_y) = ([0.0; 4], [0.0; 4]);
    for (x, y) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
        let slot = index[cell.wrapping_add_signed(y * width.cast_signed() + x)];
        if slot != 0 {
            let (x, y) = (x as f32, y as f32);
            let mut step = known[slot].colour;
            add(&mut step, -1.0, &centre);
            (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
            add(&mut along_x, x, &step);
            add(&mut along_y, y, &step);
        }
    }
    let determinant = xx * yy - xy * xy;
    if determinant < 0.5 {
        return [0.0; 4]; // fewer than two directions: no gradient
    }
    let mut tensor = [0.0, 0.0, 0.0, 1.0];
    for c in 0..3 {
        let gx = (yy * along_x[c] - xy * along_y[c]) / determinant;
        let gy = (xx * along_y[c] - xy * along_x[c]) / determinant;
        add(&mut tensor, 1.0, &[gx * gx, gx * gy, gy * gy, 0.0]);
    }
    tensor
}

fn add(sum: &mut [f32; 4], weight: f32, value: &[f32; 4]) {
    for (s, v) in sum.iter_mut().zip(value) {
        *s += weight * v;
    }
}

/// A weighted sum over its weight; nothing stays nothing.
fn mean(sum: [f32; 4]) -> [f32; 4] {
    if sum[3] > 0.0 { sum.map(|v| v / sum[3]) } else { sum }
}
