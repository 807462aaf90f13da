//! Extrema of the difference of Gaussians, to a fraction of a pixel (Lowe 2004, sections 3.1 and 4).

use wide::{CmpGe, CmpGt, CmpLe, CmpLt, f32x4};

use crate::lanes::load;
use crate::rows::Window;

/// Scales per octave at which extrema are looked for (Lowe 2004, section 3.3).
pub(super) const SCALES: usize = 3;
/// Pixels at the border of an octave where no extremum is looked for.
const BORDER: usize = 5;
/// Rows above and below the scanned one that may be read: how far a fit may move, and one more.
pub(super) const REACH: usize = 4;
/// A fit is accepted when its extremum is nearer to its sample than this. It is a little more than one half, as halfway between
/// two samples each may point to the other.
const NEAR: f32 = 0.6;
/// Most steps of a fit.
const STEPS: usize = 5;

/// Thresholds that an extremum must pass.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    /// Least contrast of the fitted extremum, in gray levels.
    pub contrast: f32,
    /// Largest (r + 1)²/r of the principal curvatures' ratio r.
    pub edge: f32,
}

/// An extremum in scale space.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extremum {
    pub octave: u8,
    /// 1, 2 or 3.
    pub level: u8,
    /// The nearest sample, in the octave's pixels.
    pub pixel: [u32; 2],
    /// Where it lies from there: x, y, level.
    pub offset: [f32; 3],
    /// Contrast, in gray levels.
    pub response: f32,
}

impl Extremum {
    /// Octave, level, y, x.
    pub fn place(&self) -> [u32; 4] {
        [self.octave.into(), self.level.into(), self.pixel[1], self.pixel[0]]
    }
}

/// Scans an octave row by row, as the rows become available.
pub(super) struct Scanner {
    octave: u8,
    width: usize,
    height: usize,
    next: usize,
}

impl Scanner {
    pub fn new(octave: u8, (width, height): (usize, usize)) -> Self {
        Self { octave, width, height, next: BORDER }
    }

    /// Scans all rows that `differences` has the neighbours of.
    pub fn scan(&mut self, differences: &[Window], limits: &Limits, found: &mut Vec<Extremum>) {
        let Some(rows) = differences.last().map(|last| last.rows) else { return };
        let end = if rows == self.height { rows - BORDER } else { rows.saturating_sub(REACH) };
        while self.next < end {
            for level in 1..=SCALES {
                self.scan_row(differences, level, limits, found);
            }
            self.next += 1;
        }
    }

    #[inline(never)] // the first detection takes 350 ms instead of 364, see `crate::rows`
    fn scan_row(&self, differences: &[Window], level: usize, limits: &Limits, found: &mut Vec<Extremum>) {
        let y = self.next;
        // The fit may raise the contrast of a sample.
        let least = f32x4::splat(0.5 * limits.contrast);
        let row = |level: usize, y: usize| differences[level].row(y);
        let centre = row(level, y);
        let (above, below) = (row(level, y - 1), row(level, y + 1));
        let [finer, coarser] = [level - 1, level + 1].map(|level| [y - 1, y, y + 1].map(|y| row(level, y)));
        let before = [finer[1], above, finer[0], finer[2]];
        let after = [coarser[1], below, coarser[0], coarser[2]];
        // Four samples at a time, the cheapest and most selective tests first.
        'samples: for x in (BORDER..self.width - BORDER).step_by(4) {
            let value = load(centre, x);
            let strong = value.abs().cmp_gt(least);
            if strong.none() {
                continue;
            }
            // Extremum among the four neighbours in its row and column. Of equal neighbours the last one is the extremum.
            let last = |(most, least): (f32x4, f32x4), v| (most & value.cmp_ge(v), least & value.cmp_le(v));
            let first = |(most, least): (f32x4, f32x4), v| (most & value.cmp_gt(v), least & value.cmp_lt(v));
            let mut extreme = last(last((strong, strong), load(centre, x - 1)), load(above, x));
            extreme = first(first(extreme, load(centre, x + 1)), load(below, x));
            // Among all 26 in scale space.
            for (before, after) in before.into_iter().zip(after) {
                if (extreme.0 | extreme.1).none() {
                    continue 'samples;
                }
                for x in x - 1..x + 2 {
                    extreme = first(last(extreme, load(before, x)), load(after, x));
                }
            }
            let (most, least) = extreme;
            // A maximum must be positive and a minimum negative.
            let zero = f32x4::splat(0.0);
            let lanes = ((most & value.cmp_gt(zero)) | (least & zero.cmp_gt(value))).move_mask();
            for lane in 0..4.min(self.width - BORDER - x) {
                if lanes >> lane & 1 != 0 {
                    found.extend(self.fit(differences, level, x + lane, limits));
                }
            }
        }
    }

    /// Fits a quadric (M. Brown and D. Lowe, BMVC 2002), and moves to another sample while the extremum is nearer to that.
    #[inline(never)] // the first detection takes 350 ms instead of 364, see `crate::rows`
    fn fit(&self, differences: &[Window], level: usize, x: usize, limits: &Limits) -> Option<Extremum> {
        let (mut level, mut x, mut y) = (level, x, self.next);
        for _ in 0..STEPS {
            let cube = Cube::new(differences, level, x, y);
            let offset = cube.extremum()?;
            if offset.iter().all(|v| v.abs() < NEAR) {
                let contrast = cube.value + 0.5 * (0..3).map(|i| cube.slope[i] * offset[i]).sum::<f32>();
                let kept = contrast.abs() >= limits.contrast && !cube.is_edge(limits.edge);
                return kept.then_some(Extremum {
                    octave: self.octave,
                    level: level as u8,
                    pixel: [x as u32, y as u32],
                    offset,
                    response: contrast.abs(),
                });
            }
            let step = |at: usize, offset: f32| -> Option<usize> {
                let whole = if offset > 0.0 { offset + 0.5 } else { offset - 0.5 } as i32;
                at.checked_add_signed(whole as isize)
            };
            (x, y, level) = (step(x, offset[0])?, step(y, offset[1])?, step(level, offset[2])?);
            let inside = |at: usize, size: usize| (BORDER..size - BORDER).contains(&at);
            let known = y.abs_diff(self.next) < REACH;
            if !known || !inside(x, self.width) || !inside(y, self.height) || !(1..=SCALES).contains(&level) {
                return None;
            }
        }
        None
    }
}

/// Derivatives at a sample: x, y, level.
struct Cube {
    value: f32,
    slope: [f32; 3],
    /// xx, yy, ss
    curvature: [f32; 3],
    /// ys, xs, xy
    twist: [f32; 3],
}

impl Cube {
    fn new(differences: &[Window], level: usize, x: usize, y: usize) -> Self {
        let rows = [level - 1, level, level + 1].map(|level| [y - 1, y, y + 1].map(|y| differences[level].row(y)));
        let at = |s: usize, row: usize, x: usize| rows[s][row + 1 - y][x];
        let value = at(1, y, x);
        let ends = [[at(1, y, x - 1), at(1, y, x + 1)], [at(1, y - 1, x), at(1, y + 1, x)], [at(0, y, x), at(2, y, x)]];
        let twist = |[a, b, c, d]: [f32; 4]| 0.25 * ((a - b) - (c - d));
        Self {
            value,
            slope: ends.map(|[before, after]| 0.5 * (after - before)),
            curvature: ends.map(|[before, after]| (after + before) - 2.0 * value),
            twist: [
                twist([at(2, y + 1, x), at(2, y - 1, x), at(0, y + 1, x), at(0, y - 1, x)]),
                twist([at(2, y, x + 1), at(2, y, x - 1), at(0, y, x + 1), at(0, y, x - 1)]),
                twist([at(1, y + 1, x + 1), at(1, y + 1, x - 1), at(1, y - 1, x + 1), at(1, y - 1, x - 1)]),
            ],
        }
    }

    /// The stationary point of the quadric by Cramer's rule; `None` when it is far away.
    fn extremum(&self) -> Option<[f32; 3]> {
        let ([a, b, c], [f, e, d]) = (self.curvature, self.twist);
        // The inverse of [a d e; d b f; e f c] times its determinant.
        let (aa, dd, ee) = (b * c - f * f, e * f - d * c, d * f - b * e);
        let (bb, ff, cc) = (a * c - e * e, d * e - a * f, a * b - d * d);
        let scale = -1.0 / (a * aa + d * dd + e * ee);
        let [x, y, s] = self.slope;
        let offset = [
            (aa * x + dd * y + ee * s) * scale,
            (dd * x + bb * y + ff * s) * scale,
            (ee * x + ff * y + cc * s) * scale,
        ];
        offset.iter().all(|v| v.abs() < 1e3).then_some(offset)
    }

    /// Whether the ratio of the principal curvatures is too large (Lowe 2004, section 4.1).
    fn is_edge(&self, limit: f32) -> bool {
        let [xx, yy, _] = self.curvature;
        let (trace, det) = (xx + yy, xx * yy - self.twist[2] * self.twist[2]);
        det <= 0.0 || trace * trace >= limit * det
    }
}
