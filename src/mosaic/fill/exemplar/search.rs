//! The nearest-neighbour field of PatchMatch: for the target patch around each void the source patch most like it.

use wide::{i16x8, i32x4, u8x16};

use super::level::{BEFORE, Level, SIDE, Void};
use crate::Result;
use crate::image::reserve;
use crate::sampler::Sampler;

/// Most that a source at another depth than the background costs, as a sum of squared differences: 16 levels in each
/// channel of each pixel.
const DEPTH_COST: f32 = (3 * 256 * SIDE * SIDE) as f32;
/// The same for a source as far away as it should be at most: 36 levels. What continues a structure is mostly near (K. He, J. Sun,
/// *Statistics of Patch Offsets for Image Completion*, ECCV 2012).
const DISTANCE_COST: f32 = (3 * 36 * 36 * SIDE * SIDE) as f32;
/// Sum of squared differences that hardly lessens a vote: one level in each channel of each pixel.
const SMALL: f32 = (3 * SIDE * SIDE) as f32;
/// How many places are tried at random for a void's first source.
const FIRST_TRIES: usize = 32;

/// The source patch of a void's target patch.
#[derive(Clone, Copy)]
pub(super) struct Source {
    /// The cell whose patch it is.
    pub cell: usize,
    /// What its vote counts: the less, the more the two patches differ. 0 before any comparison.
    pub weight: f32,
}

/// A source that is considered.
struct Candidate {
    cell: usize,
    /// Sum of squared differences, and what depth and distance cost.
    cost: u32,
}

/// The nearest-neighbour field of one level: a source patch for each void.
pub(super) struct NearestNeighbours {
    pub sources: Vec<Source>,
    /// The known patch that is farthest away: a source that every void may have.
    farthest: usize,
    /// How far from a void its sources should be at most.
    reach: f32,
}

impl NearestNeighbours {
    fn new(level: &Level, reach: f32) -> Result<Option<Self>> {
        let mut farthest = 0;
        for (cell, &depth) in level.nearest.iter().enumerate() {
            if depth < level.nearest[farthest] {
                farthest = cell;
            }
        }
        if level.nearest[farthest] == f32::INFINITY {
            return Ok(None);
        }
        let mut sources = Vec::new();
        reserve(&mut sources, level.voids.len())?;
        Ok(Some(Self { sources, farthest, reach }))
    }

    /// Sources at random, or nothing when the level has no whole patch.
    pub fn random(level: &Level, reach: f32, random: &mut Sampler) -> Result<Option<Self>> {
        let Some(mut field) = Self::new(level, reach)? else { return Ok(None) };
        let (width, height) = level.size();
        for void in &level.voids {
            let mut tries = (0..FIRST_TRIES).map(|_| level.cell(random.below(width), random.below(height)));
            let cell = tries.find(|&cell| level.nearest[cell] <= void.limit).unwrap_or(field.farthest);
            field.sources.push(Source { cell, weight: 0.0 });
        }
        Ok(Some(field))
    }

    /// The sources and colours of the next coarser level.
    pub fn refined(&self, coarse: &Level, level: &mut Level, reach: f32) -> Result<Option<Self>> {
        let Some(mut field) = Self::new(level, reach)? else { return Ok(None) };
        let (width, height) = level.size();
        for number in 0..level.voids.len() {
            let void = level.voids[number];
            let (x, y) = level.position(void.cell);
            let above = coarse.cell(x / 2, y / 2);
            level.colour[void.cell] = coarse.colour[above];
            // The next patch up there, as far apart as it is from this one.
            let centre =
                above - above % coarse.width % coarse.stride - above / coarse.width % coarse.stride * coarse.width;
            let above = if coarse.index[centre] != 0 { centre } else { above };
            let (u, v) = coarse.position(self.sources[coarse.index[above] as usize - 1].cell);
            let (left, top) = coarse.position(above);
            let cell = level.cell((2 * u + x - 2 * left).min(width - 1), (2 * v + y - 2 * top).min(height - 1));
            let allowed = level.nearest[cell] <= void.limit;
            field.sources.push(Source { cell: if allowed { cell } else { field.farthest }, weight: 1.0 });
        }
        Ok(Some(field))
    }

    /// One step of PatchMatch (Barnes et al. 2009). Propagation: the sources of the neighbours visited before, which come
    /// behind when going `backwards`. Random search: places within `radius` cells, halved from one to the next.
    pub fn improve(&mut self, level: &Level, number: usize, backwards: bool, radius: usize, random: &mut Sampler) {
        let void = &level.voids[number];
        let mut best = Candidate { cell: self.sources[number].cell, cost: u32::MAX };
        self.try_source(level, void, best.cell, &mut best);
        for step in [level.stride, level.stride * level.width] {
            let (neighbour, back) =
                if backwards { (void.cell + step, step.wrapping_neg()) } else { (void.cell - step, step) };
            let neighbour = level.index[neighbour] as usize;
            if neighbour != 0 {
                let cell = self.sources[neighbour - 1].cell.wrapping_add(back);
                self.try_source(level, void, cell, &mut best);
            }
        }
        let (width, height) = level.size();
        let mut radius = radius;
        while radius > 0 {
            let (x, y) = level.position(best.cell);
            let mut around = |at: usize, side: usize| {
                let first = at.saturating_sub(radius);
                first + random.below((at + radius + 1).min(side) - first)
            };
            let cell = level.cell(around(x, width), around(y, height));
            self.try_source(level, void, cell, &mut best);
            radius /= 2;
        }
        self.sources[number] = Source { cell: best.cell, weight: 1.0 / (best.cost as f32 + SMALL) };
    }

    /// Takes a source if it is allowed and better.
    fn try_source(&self, level: &Level, void: &Void, cell: usize, best: &mut Candidate) {
        if cell == best.cell && best.cost != u32::MAX {
            return;
        }
        if level.nearest[cell] > void.limit && cell != self.farthest {
            return;
        }
        let apart = (level.depth[cell] - void.far) / (0.5 * (void.limit - void.far));
        // Without depth this is NaN, and a constant.
        let depth_cost = ((apart * apart).min(1.0) * DEPTH_COST) as u32;
        let (x, y) = level.position(cell);
        let (u, v) = level.position(void.cell);
        let (dx, dy) = (x as f32 - u as f32, y as f32 - v as f32);
        let distance_cost = (((dx * dx + dy * dy) / (self.reach * self.reach)).min(1.0) * DISTANCE_COST) as u32;
        let cost = depth_cost + distance_cost + difference(level, void.cell, cell);
        if cost < best.cost {
            *best = Candidate { cell, cost };
        }
    }
}

/// Sum of squared differences between the patches of two cells over what the first one's sees.
fn difference(level: &Level, at: usize, source: usize) -> u32 {
    let corner = BEFORE * (level.width + 1);
    let (a, b) = (at - corner, source - corner);
    let mut sum = i32x4::splat(0);
    for row in 0..SIDE {
        let (a, b) = (a + row * level.width, b + row * level.width);
        let a_row: &[u8] = bytemuck::cast_slice(&level.colour[a..a + SIDE]);
        let b_row: &[u8] = bytemuck::cast_slice(&level.colour[b..b + SIDE]);
        let seen: &[u8] = bytemuck::cast_slice(&level.seen[a..a + SIDE]);
        for ((a, b), seen) in a_row.as_chunks().0.iter().zip(b_row.as_chunks().0).zip(seen.as_chunks().0) {
            let (a, b, seen) = (u8x16::new(*a), u8x16::new(*b), u8x16::new(*seen));
            let apart = (a.saturating_sub(b) | b.saturating_sub(a)) & seen;
            let (low, high) = (i16x8::from_u8x16_low(apart), i16x8::from_u8x16_high(apart));
            sum += low.dot(low) + high.dot(high);
        }
    }
    sum.to_array().iter().sum::<i32>() as u32
}
