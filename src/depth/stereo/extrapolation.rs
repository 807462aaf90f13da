//! Extrapolates corrections from reliable pixels to all others.

use super::epipolar_line::EpipolarLines;
use crate::Result;
use crate::image::{reserve, zeroed};

/// Difference of parallax between neighbours, in pixels, that halves how strongly they are linked. Tuned on the evaluation
/// cases: PSNR and bending are flat between 0.25 and 1.
const EDGE: f32 = 0.5;

struct Layer {
    width: usize,
    height: usize,
    shift: Vec<f32>,
    reliable: Vec<u8>,
    /// Weights of the links to the pixel to the right and to the one below, and the inverse of the sum of all that act on the
    /// pixel; 0 where its value is fixed.
    links: Vec<[f32; 3]>,
}

/// The shifts, those that are not reliable replaced by a membrane (a discrete Poisson equation, solved from coarse to fine)
/// that is fixed at the reliable ones, torn where the prior has an edge, and drawn to zero over `reach` pixels.
pub(super) fn extrapolated(
    lines: &EpipolarLines<'_>,
    shifts: &[f32],
    reliable: &[u8],
    (width, height, scale): (usize, usize, usize),
    reach: f32,
) -> Result<Vec<f32>> {
    let per_depth = lines.typical_slope();
    let mut guide = Vec::new();
    reserve(&mut guide, width * height)?;
    for y in 0..height {
        guide.extend((0..width).map(|x| lines.prior_of(x, y, scale) * per_depth));
    }
    let mut layers = Vec::new();
    let mut next = Layer { width, height, shift: copy(shifts)?, reliable: copy(reliable)?, links: Vec::new() };
    let (mut edge, mut pixels) = (EDGE, 1.0);
    loop {
        next.link(&guide, edge, (pixels / reach) * (pixels / reach))?;
        let more = next.width.min(next.height) > 4;
        let half = if more { Some(next.half(&mut guide)?) } else { None };
        layers.push(next);
        let Some(half) = half else { break };
        next = half;
        edge *= std::f32::consts::SQRT_2;
        pixels *= 2.0;
    }
    let mut coarser: Option<Layer> = None;
    while let Some(mut layer) = layers.pop() {
        layer.start(coarser.as_ref());
        // The coarse layers carry far, the finest only smooths.
        for _ in 0..if layers.is_empty() { 1 } else { 3 } {
            layer.relax();
        }
        coarser = Some(layer);
    }
    Ok(coarser.map(|layer| layer.shift).unwrap_or_default())
}

fn copy<T: Copy>(values: &[T]) -> Result<Vec<T>> {
    let mut out = Vec::new();
    reserve(&mut out, values.len())?;
    out.extend_from_slice(values);
    Ok(out)
}

impl Layer {
    fn link(&mut self, guide: &[f32], edge: f32, fade: f32) -> Result<()> {
        let (w, inverse) = (self.width, 1.0 / (edge * edge));
        self.links = zeroed(guide.len())?;
        for y in 0..self.height {
            let mut left = 0.0;
            for x in 0..w {
                let at = y * w + x;
                let weight = |there: usize| {
                    // Both values are fixed.
                    if self.reliable.get(there).is_none_or(|there| self.reliable[at] & there != 0) {
                        return 0.0;
                    }
                    let difference = guide[there] - guide[at];
                    let weight = 1.0 / (1.0 + difference * difference * inverse);
                    // 0 for NaN.
                    if weight > 0.0 { weight } else { 0.0 }
                };
                let right = if x + 1 < w { weight(at + 1) } else { 0.0 };
                let below = weight(at + w);
                let above = if y > 0 { self.links[at - w][1] } else { 0.0 };
                let all = if self.reliable[at] == 0 { 1.0 / (right + below + left + above + fade) } else { 0.0 };
                self.links[at] = [right, below, all];
                left = right;
            }
        }
        Ok(())
    }

    /// The layer at half the size, and its guide.
    fn half(&self, guide: &mut Vec<f32>) -> Result<Layer> {
        let (w, h) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut half =
            Layer { width: w, height: h, shift: zeroed(w * h)?, reliable: zeroed(w * h)?, links: Vec::new() };
        for y in 0..h {
            for x in 0..w {
                let (mut sum, mut n, mut near) = (0.0, 0.0f32, 0.0);
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (u, v) = ((2 * x + dx).min(self.width - 1), (2 * y + dy).min(self.height - 1));
                    let at = v * self.width + u;
                    near += 0.25 * guide[at];
                    if self.reliable[at] != 0 {
                        sum += self.shift[at];
                        n += 1.0;
                    }
                }
                let at = y * w + x;
                // Written where nothing is read any more.
                guide[at] = near;
                half.shift[at] = sum / n.max(1.0);
                half.reliable[at] = u8::from(n > 0.0);
            }
        }
        guide.truncate(w * h);
        Ok(half)
    }

    fn start(&mut self, coarser: Option<&Layer>) {
        for y in 0..self.height {
            for x in 0..self.width {
                let at = y * self.width + x;
                if self.reliable[at] == 0 {
                    self.shift[at] = coarser.map_or(0.0, |c| c.shift[y / 2 * c.width + x / 2]);
                }
            }
        }
    }

    /// One sweep of Gauss–Seidel down, one up.
    fn relax(&mut self) {
        let (w, n) = (self.width, self.shift.len());
        for i in 0..2 * n {
            let at = if i < n { i } else { 2 * n - 1 - i };
            let [right, below, share] = self.links[at];
            if share == 0.0 {
                continue;
            }
            // Links beyond the border are zero, whatever pixel they seem to lead to.
            let link = |at: usize| self.links.get(at).copied().unwrap_or_default();
            let value = |at: usize| self.shift.get(at).copied().unwrap_or_default();
            let (left, above) = (at.wrapping_sub(1), at.wrapping_sub(w));
            let beside = right * value(at + 1) + link(left)[0] * value(left);
            let sum = beside + (below * value(at + w) + link(above)[1] * value(above));
            self.shift[at] = sum * share;
        }
    }
}
