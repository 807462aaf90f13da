//! From values at scattered points to a map that is smooth but for the edges of the photo.

use wide::f32x4;

use crate::image::{reserve, zeroed};
use crate::observer::{Observer, report};
use crate::rect::diagonal;
use crate::{ImageView, InverseDepth, Result, Stage};

/// A value at a point of the photo.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub point: [f64; 2],
    pub value: f64,
    /// Its weight next to the others', 1 on average.
    pub weight: f64,
}

// Half and twice of either change PSNR by 0.2 % at most on the evaluation cases.

/// Squared difference of colours, over three channels of 255, that doubles the distance.
const COLOUR: f32 = 3600.0;
/// Colours make the squared distance this many times larger at most.
const MOST: f32 = 10.0;

/// What happens away from the samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernel {
    /// Within so many diagonals all samples have the same weight.
    pub near: f32,
    /// Holds the slopes of the local planes where their samples do not, in squared diagonals.
    pub ridge: f32,
    /// Half way to 0, in diagonals from a single sample.
    pub far: f32,
    /// Whether values drop to 0 there, or fade away slowly.
    pub sharp: bool,
    /// The diagonal in nodes.
    pub nodes: f64,
}

/// Scattered values, ready to be interpolated: moving least squares with local planes (Levin 1998), the weights those of a
/// cross bilateral filter.
pub(super) struct Scattered<'a> {
    /// x, y, red, green, blue, value and weight of four samples; those that fill up the last four weigh nothing.
    lanes: Vec<[f32x4; 7]>,
    kernel: Kernel,
    /// Width and height of the map in pixels.
    size: (usize, usize),
    /// The photo whose colours say what belongs together.
    guide: Option<ImageView<'a>>,
    /// Diagonals per pixel.
    unit: f64,
}

impl<'a> Scattered<'a> {
    pub fn new(samples: &[Sample], kernel: Kernel, size: (usize, usize), guide: Option<ImageView<'a>>) -> Self {
        let unit = 1.0 / diagonal(size);
        let four = |samples: &[Sample]| {
            let mut columns = [[0.0f32; 4]; 7];
            for (k, s) in samples.iter().enumerate() {
                let [r, g, b] = mean_colour(guide, s.point.map(|v| v - 2.0), 5);
                let [x, y] = s.point.map(|v| (v * unit) as f32);
                for (column, v) in columns.iter_mut().zip([x, y, r, g, b, s.value as f32, s.weight as f32]) {
                    column[k] = v;
                }
            }
            columns.map(f32x4::new)
        };
        Self { lanes: samples.chunks(4).map(four).collect(), kernel, size, guide, unit }
    }

    /// The value at (x, y) in diagonals for a pixel of `colour`: of a plane fitted to the samples, the near ones of like
    /// colour weighing most, drawn to 0 where there are none.
    fn value(&self, x: f32, y: f32, colour: [f32; 3]) -> f32 {
        let splat = f32x4::splat;
        let (x, y, [r, g, b]) = (splat(x), splat(y), colour.map(splat));
        let Kernel { near, ridge, far, sharp, .. } = self.kernel;
        let (near, inverse, most, one) = (splat(near * near), splat(1.0 / COLOUR), splat(MOST), splat(1.0));
        let mut sums = [f32x4::ZERO; 9];
        let [s, sx, sy, sxx, sxy, syy, v, vx, vy] = &mut sums;
        for [px, py, pr, pg, pb, value, weight] in &self.lanes {
            let (dx, dy) = (*px - x, *py - y);
            let (dr, dg, db) = (*pr - r, *pg - g, *pb - b);
            let apart = one + (dr * dr + dg * dg + db * db) * inverse;
            let apart = apart.fast_min(most);
            let square = (dx * dx + dy * dy + near) * apart;
            let w = *weight / (square * square * square);
            let (wx, wy, wv) = (w * dx, w * dy, w * *value);
            // Written out, so that the sums stay in registers.
            (*s, *sx, *sy) = (*s + w, *sx + wx, *sy + wy);
            (*sxx, *sxy, *syy) = (*sxx + wx * dx, *sxy + wx * dy, *syy + wy * dy);
            (*v, *vx, *vy) = (*v + wv, *vx + wv * dx, *vy + wv * dy);
        }
        let total = |lanes: f32x4| {
            let [a, b, c, d] = lanes.to_array();
            (a + b) + (c + d)
        };
        let [s, sx, sy, sxx, sxy, syy, v, vx, vy] = sums.map(total);
        // Squared distance of a single sample of the same weight.
        let square = 1.0 / libm::cbrtf(s);
        let q = square / (far * far);
        let share = 1.0 / (1.0 + if sharp { q * q * q } else { q });
        // The plane's value at its origin, by Cramer's rule.
        let (xx, yy) = (sxx + ridge * s, syy + ridge * s);
        let (a, b, c) = (xx * yy - sxy * sxy, sy * sxy - sx * yy, sx * sxy - sy * xx);
        let value = share * (v * a + vx * b + vy * c) / (s * a + sx * b + sy * c);
        if value.is_finite() { value } else { 0.0 }
    }

    /// The value where sample `i` is, by all the others.
    pub fn without(&mut self, i: usize) -> f64 {
        let Some(lanes) = self.lanes.get_mut(i / 4) else { return 0.0 };
        let kept = lanes[6];
        let mut weights = kept.to_array();
        weights[i % 4] = 0.0;
        lanes[6] = f32x4::new(weights);
        let [x, y, r, g, b] = [0, 1, 2, 3, 4].map(|k| lanes[k].to_array()[i % 4]);
        let value = self.value(x, y, [r, g, b]);
        self.lanes[i / 4][6] = kept;
        f64::from(value)
    }

    /// A map of the photo's size: exact at nodes, and bilinear between them.
    pub fn dense(&self, observer: &mut dyn Observer) -> Result<InverseDepth> {
        let (w, h) = self.size;
        let step = ((1.0 / (self.unit * self.kernel.nodes)) as usize).max(1);
        // Nodes lie in the middle of blocks, the first and last of them beyond the photo's border.
        let (columns, rows) = (w.div_ceil(step) + 2, h.div_ceil(step) + 2);
        let corner = |i: usize| i as f64 * step as f64 - step as f64;
        let middle = |i: usize| ((corner(i) + 0.5 * (step - 1) as f64) * self.unit) as f32;
        let mut nodes: Vec<f32> = zeroed(columns * rows)?;
        for (j, row) in nodes.chunks_exact_mut(columns).enumerate() {
            if j % 8 == 0 {
                report(observer, Stage::Depth, j as f32 / rows as f32)?;
            }
            for (i, node) in row.iter_mut().enumerate() {
                *node = self.value(middle(i), middle(j), mean_colour(self.guide, [corner(i), corner(j)], step));
            }
        }
        let place = |p: usize| {
            let p = (2 * p + step + 1) as f32 / (2 * step) as f32;
            (p as usize, p - p.floor())
        };
        let mut across = Vec::new();
        reserve(&mut across, w)?;
        across.extend((0..w).map(place));
        let mut data = Vec::new();
        reserve(&mut data, w * h)?;
        let mut row: Vec<f32> = zeroed(columns)?;
        for y in 0..h {
            let (j, fy) = place(y);
            let (above, below) = (&nodes[j * columns..], &nodes[(j + 1) * columns..]);
            for ((v, a), b) in row.iter_mut().zip(above).zip(below) {
                *v = a + (b - a) * fy;
            }
            data.extend(across.iter().map(|&(i, fx)| row[i] + (row[i + 1] - row[i]) * fx));
        }
        Ok(InverseDepth::from_values(data, w, h))
    }
}

/// Mean red, green and blue of the `size`×`size` pixels from (x, y) on, as far as they are in the photo.
pub(super) fn mean_colour(image: Option<ImageView<'_>>, [x, y]: [f64; 2], size: usize) -> [f32; 3] {
    let Some(image) = image else { return [0.0; 3] };
    let range = |from: f64, length: usize| {
        let clamp = |v: f64| v.max(0.0).min((length - 1) as f64) as usize;
        let from = (from + 0.5).floor();
        clamp(from)..clamp(from + (size - 1) as f64) + 1
    };
    let (columns, rows) = (range(x, image.width()), range(y, image.height()));
    let (mut sums, mut n) = ([0u32; 3], 0u32);
    for row in image.pixels().chunks_exact(image.width()).take(rows.end).skip(rows.start) {
        for pixel in &row[columns.clone()] {
            sums.iter_mut().zip(pixel).for_each(|(sum, v)| *sum += u32::from(*v));
            n += 1;
        }
    }
    sums.map(|sum| sum as f32 / n as f32)
}
