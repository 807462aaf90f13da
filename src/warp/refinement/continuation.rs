//! Continues corrections from where they are trusted to where they are not.

use super::motion::Field;
use crate::Result;
use crate::image::{reserve, zeroed};

/// Pixels of parallax between neighbours that make half an edge.
const EDGE: f32 = 0.5;

struct Layer {
    width: usize,
    height: usize,
    shift: Vec<f32>,
    trusted: Vec<u8>,
    /// How strongly each pixel holds on to the one to the right, and to the one below.
    links: Vec<[f32; 2]>,
}

/// The shifts, those that are not trusted replaced by a membrane that is held at the trusted ones, torn where the prior has an
/// edge, and drawn to zero over `reach` pixels.
#[inline(never)]
pub(super) fn continued(
    field: &Field<'_>,
    shifts: &[f32],
    trusted: &[u8],
    (width, height, scale): (usize, usize, usize),
    reach: f32,
) -> Result<Vec<f32>> {
    let per_depth = field.typical_slope();
    let mut guide = Vec::new();
    reserve(&mut guide, width * height)?;
    for y in 0..height {
        guide.extend((0..width).map(|x| field.prior_of(x, y, scale) * per_depth));
    }
    let mut layers = Vec::new();
    let mut next = Layer { width, height, shift: copy(shifts)?, trusted: copy(trusted)?, links: Vec::new() };
    let mut edge = EDGE;
    loop {
        next.link(&guide, edge)?;
        let more = next.width.min(next.height) > 4;
        let half = if more { Some(next.half(&mut guide)?) } else { None };
        layers.push(next);
        let Some(half) = half else { break };
        next = half;
        edge *= std::f32::consts::SQRT_2;
    }
    let mut pixels = (1u64 << (layers.len() - 1)) as f32;
    let mut coarser: Option<Layer> = None;
    while let Some(mut layer) = layers.pop() {
        let fade = (pixels / reach) * (pixels / reach);
        layer.start(coarser.as_ref());
        // The coarse layers carry far, the finest only smooths.
        for _ in 0..if layers.is_empty() { 1 } else { 3 } {
            layer.relax(fade);
        }
        pixels *= 0.5;
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
    fn link(&mut self, guide: &[f32], edge: f32) -> Result<()> {
        let (w, inverse) = (self.width, 1.0 / (edge * edge));
        reserve(&mut self.links, guide.len())?;
        for (at, &here) in guide.iter().enumerate() {
            let hold = |there: Option<&f32>| {
                let difference = there.map_or(0.0, |there| there - here);
                let hold = 1.0 / (1.0 + difference * difference * inverse);
                if hold > 0.0 { hold } else { 0.0 }
            };
            // Between pixels that are both trusted nothing is ever pulled.
            let pulls = |there: usize| self.trusted.get(there).is_some_and(|there| self.trusted[at] & there == 0);
            let right = if (at + 1) % w != 0 && pulls(at + 1) { hold(guide.get(at + 1)) } else { 0.0 };
            let below = if pulls(at + w) { hold(guide.get(at + w)) } else { 0.0 };
            self.links.push([right, below]);
        }
        Ok(())
    }

    /// The layer at half the size, and its guide.
    fn half(&self, guide: &mut Vec<f32>) -> Result<Layer> {
        let (w, h) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut half = Layer { width: w, height: h, shift: zeroed(w * h)?, trusted: zeroed(w * h)?, links: Vec::new() };
        for y in 0..h {
            for x in 0..w {
                let (mut sum, mut n, mut near) = (0.0, 0.0f32, 0.0);
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (u, v) = ((2 * x + dx).min(self.width - 1), (2 * y + dy).min(self.height - 1));
                    let at = v * self.width + u;
                    near += 0.25 * guide[at];
                    if self.trusted[at] != 0 {
                        sum += self.shift[at];
                        n += 1.0;
                    }
                }
                let at = y * w + x;
                // Written where nothing is read any more.
                guide[at] = near;
                half.shift[at] = sum / n.max(1.0);
                half.trusted[at] = u8::from(n > 0.0);
            }
        }
        guide.truncate(w * h);
        Ok(half)
    }

    fn start(&mut self, coarser: Option<&Layer>) {
        for y in 0..self.height {
            for x in 0..self.width {
                let at = y * self.width + x;
                if self.trusted[at] == 0 {
                    self.shift[at] = coarser.map_or(0.0, |c| c.shift[y / 2 * c.width + x / 2]);
                }
            }
        }
    }

    /// One sweep of Gauss and Seidel down, one up.
    fn relax(&mut self, fade: f32) {
        let (w, n) = (self.width, self.shift.len());
        let mut visit = |at: usize| {
            if self.trusted[at] != 0 {
                return;
            }
            let [right, below] = self.links[at];
            // Links beyond the border are zero, whatever pixel they seem to lead to.
            let left = if at > 0 { self.links[at - 1][0] } else { 0.0 };
            let above = if at >= w { self.links[at - w][1] } else { 0.0 };
            let value = |at: usize| self.shift.get(at).copied().unwrap_or(0.0);
            let sum = right * value(at + 1)
                + below * value(at + w)
                + left * value(at.wrapping_sub(1))
                + above * value(at.wrapping_sub(w));
            self.shift[at] = sum / (right + below + left + above + fade);
        };
        (0..n).for_each(&mut visit);
        (0..n).rev().for_each(&mut visit);
    }
}
