//! Filling by coherence transport.
//!
//! After F. Bornemann and T. März, *Fast Image Inpainting Based on Coherence Transport*, J. Math. Imaging Vis. 28 (2007).
//! Void pixels are visited from the valid pixels around them inwards, each once. A pixel becomes a weighted mean of the
//! known pixels around it; where the structure tensor finds an edge or a line there, the weights are concentrated
//! along it, so that it runs on into the void.

use wide::{f32x4, i32x4};

use crate::image::{reserve, reserve_more, zeroed};
use crate::observer::{Observer, report};
use crate::rect::Rect;
use crate::{Image, Mask, Result, Stage};

/// Filled pixels between two reports of progress.
const REPORT_EVERY: usize = 4096;
/// How much more a direction weighs where the structure is a clean edge (κ of the paper, its value).
const SHARPNESS: f32 = 25.0;
/// Taps handled together.
const LANES: usize = 4;
/// Differences of the tensor's eigenvalues, in squared gray levels, below which a direction is taken for noise.
const NOISE: f32 = 25.0;

/// The four neighbours and then the other four.
const NEIGHBOURS: [(isize, isize); 8] = [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];

/// Instead of a number: nothing is known of the cell, it is to be filled, it is a pixel not looked at before.
const UNKNOWN: u32 = 0;
const VOID: u32 = u32::MAX;
const UNSEEN: u32 = u32::MAX - 1;

/// Fills the pixels `voids`, counted row by row, from their borders inwards; what `unknown` marks, which they are part of,
/// carries no information about them. `bounds` is around them all. On an error `image` is untouched.
pub(super) fn fill(
    image: &mut Image,
    voids: &[usize],
    unknown: &Mask,
    bounds: Rect,
    radius: usize,
    observer: &mut dyn Observer,
) -> Result<()> {
    let mut transport = Transport::new(image, unknown, bounds, radius)?;
    // Cells and their numbers: the valid ones around the voids, then the voids as they are reached.
    let mut order = transport.border(voids)?;
    let border = order.len();
    reserve(&mut order, voids.len())?;
    // Steps to four neighbours and to all eight take turns, so that the fronts are octagons. What of the front before the
    // last can only be reached by a diagonal step is then made up for.
    let (mut before, mut last, mut steps) = (0, 0, 4);
    while before < order.len() {
        let front = order.len();
        for i in if steps == 4 { last } else { before }..front {
            for &(x, y) in &NEIGHBOURS[..steps] {
                let next = order[i].0.wrapping_add_signed(transport.cells.step(x, y));
                if transport.numbers[next] == VOID {
                    transport.numbers[next] = UNKNOWN;
                    order.push((next, UNKNOWN));
                }
            }
        }
        // The pixels of a front do not see one another, so their order makes no difference.
        for (i, (cell, number)) in order.iter_mut().enumerate().skip(front) {
            if i.is_multiple_of(REPORT_EVERY) {
                report(observer, Stage::Fill, (i - border) as f32 / voids.len() as f32)?;
            }
            *number = transport.transported(*cell)?;
        }
        for &(cell, number) in &order[front..] {
            transport.numbers[cell] = number;
        }
        (before, last, steps) = (last, front, 12 - steps);
    }
    let Transport { known, cells, .. } = transport;
    let width = image.width();
    for &(cell, number) in &order[border..] {
        let (x, y) = cells.pixel(cell);
        let pixel = &mut image.pixels_mut()[y * width + x];
        let colour = known[number as usize - 1].colour.to_array();
        pixel.iter_mut().zip(colour).for_each(|(own, v)| *own = (v + 0.5) as u8);
        pixel[3] = 255;
    }
    Ok(())
}

/// The pixels of the neighbourhood that a void is drawn from, a disc around it, row by row. The last one is opposite to the
/// first, the last but one to the second, and so on.
struct Disc {
    /// Distance in cells.
    steps: Vec<isize>,
    /// Bell of the distance, for the structure tensor.
    bells: Vec<f32x4>,
    /// Of the first half of them, four by four.
    shapes: Vec<Shape>,
}

/// Four offsets in the disc.
struct Shape {
    /// x² + y², x² − y² and 2xy: what the distance from a line through the centre is made of.
    squared: f32x4,
    difference: f32x4,
    product: f32x4,
    /// 1 / distance.
    nearness: f32x4,
}

/// What is known of a pixel.
struct Known {
    /// Red, green, blue, 1.
    colour: f32x4,
    /// Structure tensor xx, xy, yy, 1 (all 0 where there is no telling).
    tensor: f32x4,
}

/// Where pixels are kept: those of the part of the picture that any disc reaches, with as much padding above, below and
/// between the rows as the disc's radius, so that no disc leaves them.
#[derive(Clone, Copy)]
struct Cells {
    window: Rect,
    padding: usize,
    /// Cells in a row.
    stride: usize,
}

impl Cells {
    fn step(self, x: isize, y: isize) -> isize {
        y * self.stride.cast_signed() + x
    }

    fn cell(self, x: usize, y: usize) -> usize {
        (y - self.window.y + self.padding) * self.stride + x - self.window.x + self.padding
    }

    fn pixel(self, cell: usize) -> (usize, usize) {
        let (x, y) = ((cell - self.padding) % self.stride, (cell - self.padding) / self.stride - self.padding);
        (self.window.x + x, self.window.y + y)
    }
}

/// The filling's state: what is known so far.
struct Transport<'a> {
    image: &'a Image,
    unknown: &'a Mask,
    disc: Disc,
    /// 1 / 16ε², where ε is the disc's radius.
    falloff: f32,
    cells: Cells,
    /// Of every cell what it is, or which of `known`, counted from 1.
    numbers: Vec<u32>,
    known: Vec<Known>,
    /// The taps of a disc on known pixels, or those opposite in the first half, and the numbers of these.
    near: Vec<[u32; 2]>,
    /// Weight of each tap of the first half of a disc.
    weights: Vec<f32x4>,
}

impl<'a> Transport<'a> {
    fn new(image: &'a Image, unknown: &'a Mask, bounds: Rect, radius: usize) -> Result<Self> {
        let window = bounds.grown(radius, image.size());
        let cells = Cells { window, padding: radius, stride: window.width + radius };
        let disc = Disc::new(radius, cells.stride)?;
        let mut numbers = zeroed((window.height + 2 * radius + 1) * cells.stride)?;
        for y in window.y..window.y + window.height {
            let first = cells.cell(window.x, y);
            numbers[first..first + window.width].fill(UNSEEN);
        }
        let falloff = 1.0 / (16 * radius * radius) as f32;
        let (near, weights) = (zeroed(disc.steps.len())?, zeroed(disc.shapes.len())?);
        Ok(Self { image, unknown, disc, falloff, cells, numbers, known: Vec::new(), near, weights })
    }

    /// Colour of a valid pixel; `None` elsewhere, and outside the picture.
    #[inline(always)]
    fn valid(&self, x: usize, y: usize) -> Option<f32x4> {
        let (width, height) = self.image.size();
        if x >= width || y >= height || self.unknown.data()[y * width + x] != 0 {
            return None;
        }
        let [r, g, b, alpha] = self.image.pixels()[y * width + x];
        (alpha != 0).then(|| f32x4::from_i32x4(i32x4::new([r, g, b, 1].map(i32::from))))
    }

    /// Marks the voids; the valid cells next to them, and their numbers.
    fn border(&mut self, voids: &[usize]) -> Result<Vec<(usize, u32)>> {
        let (cells, width) = (self.cells, self.image.width());
        let cell = |void: usize| cells.cell(void % width, void / width);
        for &void in voids {
            self.numbers[cell(void)] = VOID;
        }
        let mut border = Vec::new();
        for &void in voids {
            reserve_more(&mut border, NEIGHBOURS.len())?;
            for &(x, y) in &NEIGHBOURS {
                let next = cell(void).wrapping_add_signed(cells.step(x, y));
                if self.numbers[next] == UNSEEN && self.look(next)? != UNKNOWN {
                    border.push((next, self.numbers[next]));
                }
            }
        }
        Ok(border)
    }

    /// The number of a cell not looked at before; [`UNKNOWN`] when nothing is known of it.
    fn look(&mut self, cell: usize) -> Result<u32> {
        let (x, y) = self.cells.pixel(cell);
        self.numbers[cell] = match self.valid(x, y) {
            Some(colour) => self.push(Known { colour, tensor: self.tensor(x, y, colour) })?,
            None => UNKNOWN,
        };
        Ok(self.numbers[cell])
    }

    fn push(&mut self, pixel: Known) -> Result<u32> {
        reserve_more(&mut self.known, 1)?;
        self.known.push(pixel);
        Ok(self.known.len() as u32)
    }

    /// Structure tensor of the plane that fits the valid pixels of the 3×3 neighbourhood best, summed over the channels.
    fn tensor(&self, x: usize, y: usize, centre: f32x4) -> f32x4 {
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let (mut along_x, mut along_y) = (f32x4::ZERO, f32x4::ZERO);
        for &(i, j) in &NEIGHBOURS {
            if let Some(colour) = self.valid(x.wrapping_add_signed(i), y.wrapping_add_signed(j)) {
                let (i, j) = (i as f32, j as f32);
                (xx, xy, yy) = (xx + i * i, xy + i * j, yy + j * j);
                along_x += (colour - centre) * f32x4::splat(i);
                along_y += (colour - centre) * f32x4::splat(j);
            }
        }
        let determinant: f32 = xx * yy - xy * xy;
        if determinant < 0.5 {
            return f32x4::ZERO; // fewer than two directions: no gradient
        }
        let solved = |a: f32, u: f32x4, b: f32, v: f32x4| {
            (u * f32x4::splat(a) - v * f32x4::splat(b)) / f32x4::splat(determinant)
        };
        let (gx, gy) = (solved(yy, along_x, xy, along_y), solved(xx, along_y, xy, along_x));
        f32x4::new([(gx * gx).reduce_add(), (gx * gy).reduce_add(), (gy * gy).reduce_add(), 1.0])
    }

    /// Draws a void pixel from what is known around it; its number.
    fn transported(&mut self, cell: usize) -> Result<u32> {
        let (mut count, last) = (0, self.disc.steps.len() - 1);
        let mut structure = f32x4::ZERO;
        for i in 0..=last {
            let tap = cell.wrapping_add_signed(self.disc.steps[i]);
            let mut number = self.numbers[tap];
            if number == UNSEEN {
                number = self.look(tap)?;
            }
            if let Some(known) = self.known.get(number.wrapping_sub(1) as usize) {
                self.near[count] = [i.min(last - i) as u32, number];
                count += 1;
                structure += known.tensor * self.disc.bells[i];
            }
        }
        // w = 1/r · e^(−μ²t²/2ε²), where t is the distance from the line through the centre along the structure, ε the
        // disc's radius and μ from 1 (no direction: near pixels weigh most) to 1 + κ (an edge).
        let [xx, xy, yy, _] = mean(structure).to_array();
        let (difference, product) = (xx - yy, 2.0 * xy);
        let gap = (difference * difference + product * product).sqrt(); // between the eigenvalues
        // Across the structure, at angle θ: cos 2θ and sin 2θ. The coherence is 1 for a straight edge, 0 for a texture.
        let (cos, sin) = if gap > 0.0 { (difference / gap, product / gap) } else { (0.0, 0.0) };
        let coherence = gap / (xx + yy + NOISE);
        let mu = 1.0 + SHARPNESS * coherence * coherence;
        let [cos, sin, scale] = [cos, sin, mu * mu * self.falloff].map(f32x4::splat);
        for (weight, shape) in self.weights.iter_mut().zip(&self.disc.shapes) {
            let t2 = (shape.squared + cos * shape.difference + sin * shape.product) / f32x4::splat(2.0);
            *weight = shape.nearness * bell(scale * t2);
        }
        let weights: &[f32] = bytemuck::cast_slice(&self.weights);
        let (mut colour, mut tensor) = (f32x4::ZERO, f32x4::ZERO);
        for &[tap, number] in &self.near[..count] {
            let (known, weight) = (&self.known[number as usize - 1], f32x4::splat(weights[tap as usize]));
            colour += known.colour * weight;
            tensor += known.tensor * weight;
        }
        self.push(Known { colour: mean(colour), tensor: mean(tensor) })
    }
}

impl Disc {
    fn new(radius: usize, stride: usize) -> Result<Self> {
        let side = 2 * radius + 1;
        let (mut steps, mut bells, mut shapes) = (Vec::new(), Vec::new(), Vec::new());
        reserve(&mut steps, side * side)?;
        reserve(&mut bells, side * side)?;
        // Four x and then four y.
        let mut offsets: Vec<[f32x4; 2]> = zeroed((side * side).div_ceil(LANES))?;
        let lanes: &mut [f32] = bytemuck::cast_slice_mut(&mut offsets);
        let r = radius.cast_signed();
        // σ is half the radius, and at least one pixel.
        let variance = ((r * r) as f32 / 4.0).max(1.0);
        for place in 0..side * side {
            let (x, y) = ((place % side).cast_signed() - r, (place / side).cast_signed() - r);
            let d2 = x * x + y * y;
            // Half a pixel more, so that the disc of radius 1 has its diagonal neighbours: a front may have no others.
            if d2 > 0 && d2 <= r * r + r {
                let lane = steps.len() / LANES * 2 * LANES + steps.len() % LANES;
                (lanes[lane], lanes[lane + LANES]) = (x as f32, y as f32);
                bells.push(bell(f32x4::splat(d2 as f32 / (16.0 * variance))));
                steps.push(y * stride.cast_signed() + x);
            }
        }
        let half = (steps.len() / 2).div_ceil(LANES);
        reserve(&mut shapes, half)?;
        shapes.extend(offsets[..half].iter().map(|&[x, y]| {
            let squared = x * x + y * y;
            let nearness = f32x4::splat(1.0) / squared.sqrt();
            Shape { squared, difference: x * x - y * y, product: (x + x) * y, nearness }
        }));
        Ok(Self { steps, bells, shapes })
    }
}

/// (1 + z)⁻⁸: nearly the bell e⁻⁸ᶻ, but plain arithmetic, and never 0.
fn bell(z: f32x4) -> f32x4 {
    let one = f32x4::splat(1.0);
    let z2 = (one + z) * (one + z);
    let z4 = z2 * z2;
    one / (z4 * z4)
}

/// A weighted sum over its weight; nothing stays nothing.
fn mean(sum: f32x4) -> f32x4 {
    let weight = sum.to_array()[3];
    if weight > 0.0 { sum / f32x4::splat(weight) } else { sum }
}
