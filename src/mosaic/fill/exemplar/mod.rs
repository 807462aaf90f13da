//! Exemplar-based inpainting with patches of the background.
//!
//! Coarse to fine, search and vote take turns: the source patch most like each target patch is searched for, then the
//! sources vote on the voids' colours (Y. Wexler, E. Shechtman, M. Irani, *Space-Time Completion of Video*, PAMI 2007). The
//! search is PatchMatch
//! (C. Barnes et al., *PatchMatch: A Randomized Correspondence Algorithm for Structural Image Editing*, 2009). What
//! inverse depth shows to be nearer than the background of a void is neither compared with nor copied.

mod background;
mod level;
mod membrane;
mod search;
mod vote;

use super::super::FillGuide;
use super::cluster::Cluster;
use crate::distance::{STRAIGHT, distance};
use crate::image::reserve;
use crate::observer::{Observer, report};
use crate::rect::Rect;
use crate::sampler::Sampler;
use crate::{Image, Mask, Result, Stage};
use level::{Level, Void};
use search::NearestNeighbours;
use vote::{vote, vote_on};

const SEED: u32 = 1;
/// Half the width in pixels of the widest void at the coarsest level, at most: two patches have room in it.
const NARROW: u32 = 16;
/// How far from a void its sources may lie: so many times half its width, and so many pixels.
const REACH: (u32, u32) = (3, 32);
/// Voids between two reports of progress.
const REPORT_EVERY: usize = 8192;

/// How a level is worked on.
struct Effort {
    /// Rounds of search and vote.
    rounds: usize,
    /// Random places are tried within so many cells.
    radius: usize,
    /// Every how many columns and rows there is a patch.
    stride: usize,
}

/// By level, the finest one first, and for all others.
const EFFORTS: [Effort; 3] = [
    Effort { rounds: 2, radius: 4, stride: 2 },
    Effort { rounds: 3, radius: 8, stride: 2 },
    Effort { rounds: 6, radius: 16, stride: 1 },
];

/// A pixel of the picture and its colour.
pub(super) type Filled = (usize, [u8; 4]);

/// Adds the colours of a cluster's voids, of which `inside` is true, to `filled`. `false`, and nothing added, when there is no patch to copy from.
pub(super) fn fill(
    image: &Image,
    voids: &Mask,
    inside: &dyn Fn(usize, usize) -> bool,
    cluster: &Cluster,
    guide: Option<&FillGuide>,
    filled: &mut Vec<Filled>,
    observer: &mut dyn Observer,
) -> Result<bool> {
    let reach = REACH.0 * cluster.half_width + REACH.1;
    let window = cluster.bounds.grown(reach as usize, image.size());
    let mut finest = base(image, voids, inside, guide, window)?;
    background::set_limits(&mut finest, guide.map_or([0.0; 3], |guide| guide.epipole_from(window)))?;
    let mut levels = Vec::new();
    levels.push(finest);
    while cluster.half_width >> (levels.len() - 1) > NARROW {
        levels.push(levels[levels.len() - 1].halved()?);
    }
    let whole = levels.len() as f32;
    let mut random = Sampler::new(SEED);
    let mut coarser: Option<(Level, NearestNeighbours)> = None;
    while let Some(mut level) = levels.pop() {
        let effort = &EFFORTS[levels.len().min(EFFORTS.len() - 1)];
        level.prepare(if coarser.is_none() { 1 } else { effort.stride })?;
        let reach = (reach >> levels.len()) as f32;
        let found = match &coarser {
            Some((coarse, field)) => field.refined(coarse, &mut level, reach)?,
            None => NearestNeighbours::random(&level, reach, &mut random)?,
        };
        let Some(mut field) = found else {
            coarser = None;
            continue;
        };
        let done = whole - 1.0 - levels.len() as f32;
        match &coarser {
            Some(_) => vote(&mut level, &field.sources),
            None => peel(&mut level, &mut field, &mut random, &mut || report(observer, Stage::Fill, done / whole))?,
        }
        search_and_vote(&mut level, &mut field, effort, &mut random, &mut |part| {
            report(observer, Stage::Fill, (done + part) / whole)
        })?;
        coarser = Some((level, field));
    }
    let Some((mut level, _)) = coarser else { return Ok(false) };
    membrane::match_border(&mut level, cluster.half_width as usize)?;
    reserve(filled, level.voids.len())?;
    filled.extend(level.voids.iter().map(|void| {
        let (x, y) = level.position(void.cell);
        let [r, g, b, _] = level.colour[void.cell];
        ((window.y + y) * image.width() + window.x + x, [r, g, b, 255])
    }));
    Ok(true)
}

/// Searches for better source patches and lets them vote on the colours, in turn. Calls `tick` now and then with the share done.
fn search_and_vote(
    level: &mut Level,
    field: &mut NearestNeighbours,
    effort: &Effort,
    random: &mut Sampler,
    tick: &mut dyn FnMut(f32) -> Result<()>,
) -> Result<()> {
    for round in 0..effort.rounds {
        let backwards = round % 2 != 0;
        for i in 0..level.centres.len() {
            if i % REPORT_EVERY == 0 {
                tick(round as f32 / effort.rounds as f32)?;
            }
            let number = level.centres[if backwards { level.centres.len() - 1 - i } else { i }] as usize;
            field.improve(level, number, backwards, effort.radius, random);
        }
        vote(level, &field.sources);
    }
    Ok(())
}

/// Searches of each ring of the onion-peel initialisation.
const PEEL_SEARCHES: usize = 8;

/// Onion-peel initialisation: fills the voids of the coarsest level from the background inwards, seeing only what is known or has been filled before. Calls
/// `tick` now and then.
fn peel(
    level: &mut Level,
    field: &mut NearestNeighbours,
    random: &mut Sampler,
    tick: &mut dyn FnMut() -> Result<()>,
) -> Result<()> {
    for void in &level.voids {
        level.seen[void.cell] = 0;
    }
    let at_background = |cell: usize| {
        // No void lies at the border of the level.
        level.index[cell] != 0
            && [cell - level.width, cell, cell + level.width].iter().any(|&row| level.seen[row - 1..=row + 1] != [0; 3])
    };
    let depth = distance(level.depth.len(), level.width, &at_background)?;
    let ring_of = |void: &Void| u32::from(depth[void.cell]) / STRAIGHT;
    let radius = level.width.max(level.height);
    let mut next = Some(0);
    while let Some(ring) = next {
        tick()?;
        for search in 0..PEEL_SEARCHES {
            let backwards = search % 2 != 0;
            for i in 0..level.voids.len() {
                let number = if backwards { level.voids.len() - 1 - i } else { i };
                if ring_of(&level.voids[number]) == ring {
                    field.improve(level, number, backwards, radius, random);
                }
            }
        }
        for number in 0..level.voids.len() {
            if ring_of(&level.voids[number]) == ring {
                level.seen[level.voids[number].cell] = u32::MAX;
                vote_on(level, &field.sources, number);
            }
        }
        // Voids without any background around come last, all at once.
        next = level.voids.iter().map(ring_of).filter(|&other| other > ring).min();
    }
    Ok(())
}

/// The window at the picture's own resolution.
fn base(
    image: &Image,
    voids: &Mask,
    inside: &dyn Fn(usize, usize) -> bool,
    guide: Option<&FillGuide>,
    window: Rect,
) -> Result<Level> {
    let mut level = Level::new(window.width, window.height)?;
    for y in 0..window.height {
        for x in 0..window.width {
            let cell = level.cell(x, y);
            let (x, y) = (window.x + x, window.y + y);
            let at = y * image.width() + x;
            let pixel = &image.data()[4 * at..4 * at + 4];
            if voids.data()[at] != 0 {
                if inside(x, y) {
                    level.push(Void { cell, far: f32::NEG_INFINITY, limit: f32::MAX })?;
                }
            } else if pixel[3] != 0 {
                level.colour[cell] = [pixel[0], pixel[1], pixel[2], 0];
                let depth = guide.map_or(f32::NAN, |guide| guide.depth.data()[at]);
                level.depth[cell] = if depth.is_finite() { depth } else { f32::NEG_INFINITY };
            }
        }
    }
    Ok(level)
}
