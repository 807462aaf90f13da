//! The nearest descriptors of two photos: the nearest few in some coefficients of a transform, for both photos in one pass, and of
//! these the nearest in all.

use wide::{CmpLt, i16x8, i32x4, u8x16};

use super::DESCRIPTOR_LENGTH;
use super::walsh::{COUNT, coefficients};
use crate::image::{defaults, reserve};
use crate::observer::{Observer, report};
use crate::{Result, Stage};

/// Descriptors of a group, one to a lane.
const LANES: usize = 4;
/// Groups that stay in the processor's nearest cache while all others pass by: 13 KB.
const BLOCK: usize = 64;
/// Blocks between two reports.
const BLOCKS: usize = 4;
/// How many descriptors are compared in full.
const CANDIDATES: usize = 4;
/// More than any squared distance of coefficients, and the sum of it and one of them is no overflow.
const FAR_APART: i32 = 1 << 30;
/// More than any squared distance.
pub(super) const FAR: i32 = 1 << 26;

/// The nearest and second nearest descriptors of the other photo.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// Squared distances.
    pub distance: [i32; 2],
    pub index: u32,
    /// No squared distance of those that were not compared in full is less.
    pub others: i32,
}

impl Default for Nearest {
    fn default() -> Self {
        Self { distance: [FAR; 2], index: u32::MAX, others: FAR }
    }
}

impl Nearest {
    /// Takes another descriptor into account. Of equally near ones the first seen stays.
    #[inline]
    pub fn update(&mut self, distance: i32, index: u32) {
        if distance < self.distance[0] {
            self.distance = [distance, self.distance[0]];
            self.index = index;
        } else if distance < self.distance[1] {
            self.distance[1] = distance;
        }
    }
}

/// The squared distance of two descriptors.
pub(super) fn squared_distance(a: &[u8; DESCRIPTOR_LENGTH], b: &[u8; DESCRIPTOR_LENGTH]) -> i32 {
    let mut sum = i32x4::splat(0);
    for (a, b) in a.as_chunks::<16>().0.iter().zip(b.as_chunks::<16>().0) {
        let (a, b) = (u8x16::new(*a), u8x16::new(*b));
        // Of two bytes one difference is zero.
        let apart = (a.saturating_sub(b)) | (b.saturating_sub(a));
        let halves: [u8x16; 2] = [u8x16::unpack_low(apart, u8x16::ZERO), u8x16::unpack_high(apart, u8x16::ZERO)];
        for half in halves {
            let half: i16x8 = bytemuck::cast(half);
            sum += half.dot(half);
        }
    }
    sum.reduce_add()
}

/// The nearest descriptors by their coefficients, in ascending order of the distance.
#[derive(Debug, Clone, Copy)]
struct Candidates {
    distance: [i32; CANDIDATES],
    index: [u32; CANDIDATES],
}

impl Default for Candidates {
    fn default() -> Self {
        Self { distance: [FAR_APART; CANDIDATES], index: [u32::MAX; CANDIDATES] }
    }
}

impl Candidates {
    /// Takes another descriptor into account.
    #[inline]
    fn update(&mut self, distance: i32, index: u32) {
        if distance >= self.distance[CANDIDATES - 1] {
            return;
        }
        let (mut distance, mut index) = (distance, index);
        for (known, known_index) in self.distance.iter_mut().zip(&mut self.index) {
            if distance < *known {
                std::mem::swap(&mut distance, known);
                std::mem::swap(&mut index, known_index);
            }
        }
    }

    /// The nearest two of them.
    fn nearest(&self, own: &[u8; DESCRIPTOR_LENGTH], others: &[[u8; DESCRIPTOR_LENGTH]]) -> Nearest {
        // The coefficients' distances are lower bounds, times the length.
        let least = self.distance[CANDIDATES - 1] / DESCRIPTOR_LENGTH as i32;
        let mut nearest = Nearest { others: least, ..Nearest::default() };
        for &index in &self.index {
            if let Some(other) = others.get(index as usize) {
                nearest.update(squared_distance(own, other), index);
            }
        }
        nearest
    }
}

/// The candidates of a group.
#[derive(Clone)]
struct Four {
    all: [Candidates; LANES],
    /// The distances from which on a descriptor is none of them.
    limits: i32x4,
}

impl Default for Four {
    fn default() -> Self {
        Self { all: [Candidates::default(); LANES], limits: i32x4::splat(FAR_APART) }
    }
}

/// Four descriptors, coefficients 2i and 2i + 1 of each in vector i; what is missing is far from everything.
struct Group {
    values: [i16x8; COUNT / 2],
    /// Squared norms.
    norms: i32x4,
}

impl Group {
    fn of(descriptors: &[[u8; DESCRIPTOR_LENGTH]]) -> Self {
        let (mut values, mut norms) = ([[0i16; 2 * LANES]; COUNT / 2], [FAR_APART; LANES]);
        for (lane, descriptor) in descriptors.iter().take(LANES).enumerate() {
            let coefficients = coefficients(descriptor);
            norms[lane] = coefficients.iter().map(|&v| i32::from(v) * i32::from(v)).sum();
            for (pair, two) in values.iter_mut().zip(coefficients.as_chunks::<2>().0) {
                pair[2 * lane..2 * lane + 2].copy_from_slice(two);
            }
        }
        Self { values: bytemuck::cast(values), norms: i32x4::new(norms) }
    }

    /// One of them four times over.
    fn only(&self, lane: usize) -> Self {
        let only = |lanes: [i32; LANES]| i32x4::splat(lanes[lane % LANES]);
        let values = self.values.map(|values| bytemuck::cast(only(bytemuck::cast(values))));
        Self { values, norms: only(self.norms.to_array()) }
    }

    /// The squared distances of all four of another group from those in the same lanes of this.
    #[inline(always)]
    fn distances_by_lane(&self, others: &Self) -> i32x4 {
        let pairs = self.values.iter().zip(&others.values);
        let product = pairs.fold(i32x4::splat(0), |sum, (values, others)| sum + values.dot(*others));
        self.norms + others.norms - (product + product)
    }

    /// The squared distances of all four of another group from each of this.
    #[inline(always)]
    fn distances(&self, others: &Self) -> [i32x4; LANES] {
        let mut products = [i32x4::splat(0); LANES];
        for (values, others) in self.values.iter().zip(&others.values) {
            // Two values at a time, as one number.
            let pairs: [i32; LANES] = bytemuck::cast(*values);
            for (product, pair) in products.iter_mut().zip(pairs) {
                let both: i16x8 = bytemuck::cast(i32x4::splat(pair));
                *product += others.dot(both);
            }
        }
        let [a, b, c, d] = self.norms.to_array().map(|norm| others.norms + i32x4::splat(norm));
        let [p, q, r, s] = products.map(|product| product + product);
        [a - p, b - q, c - r, d - s]
    }
}

/// The descriptors of a photo.
pub(super) struct Descriptors<'a> {
    all: &'a [[u8; DESCRIPTOR_LENGTH]],
    groups: Vec<Group>,
}

impl<'a> Descriptors<'a> {
    pub fn of(all: &'a [[u8; DESCRIPTOR_LENGTH]]) -> Result<Self> {
        let mut groups = Vec::new();
        reserve(&mut groups, all.len().div_ceil(LANES))?;
        groups.extend(all.chunks(LANES).map(Group::of));
        Ok(Self { all, groups })
    }

    /// Whether the distance of one other than `except` from descriptor `index` of `other` is at most `limit`, squared.
    pub fn any_within(&self, limit: i32, (other, index): (&Descriptors<'_>, u32), except: u32) -> bool {
        let Some(own) = other.all.get(index as usize) else { return false };
        let Some(group) = other.groups.get(index as usize / LANES) else { return false };
        let group = group.only(index as usize);
        // Both sides are at most 2³⁰.
        let bound = i32x4::splat(limit.saturating_mul(DESCRIPTOR_LENGTH as i32).saturating_add(1).min(FAR_APART));
        self.groups.iter().zip(self.all.chunks(LANES)).zip((0..).step_by(LANES)).any(|((others, four), first)| {
            let distances = group.distances_by_lane(others);
            distances.cmp_lt(bound).any()
                && four.iter().zip(first..).any(|(other, i)| i != except && squared_distance(own, other) <= limit)
        })
    }
}

/// For each target descriptor the nearest two of the reference, and the other way round.
pub(super) fn nearest(
    [target, reference]: [&Descriptors<'_>; 2],
    observer: &mut dyn Observer,
) -> Result<[Vec<Nearest>; 2]> {
    let mut of_target: Vec<Four> = defaults(target.groups.len())?;
    let mut of_reference: Vec<Four> = defaults(reference.groups.len())?;
    let blocks = reference.groups.chunks(BLOCK).zip(of_reference.chunks_mut(BLOCK));
    for (block, (groups, columns)) in blocks.enumerate() {
        if block % BLOCKS == 0 {
            report(observer, Stage::Match, (block * BLOCK) as f32 / reference.groups.len() as f32)?;
        }
        for ((t, group), rows) in (0..).step_by(LANES).zip(&target.groups).zip(&mut of_target) {
            compare_all(group, groups, [t, (LANES * BLOCK * block) as u32], rows, columns);
        }
    }
    Ok([exact(&of_target, target.all, reference.all)?, exact(&of_reference, reference.all, target.all)?])
}

fn exact(
    candidates: &[Four],
    own: &[[u8; DESCRIPTOR_LENGTH]],
    others: &[[u8; DESCRIPTOR_LENGTH]],
) -> Result<Vec<Nearest>> {
    let mut nearest = Vec::new();
    reserve(&mut nearest, own.len())?;
    let candidates = candidates.iter().flat_map(|four| &four.all);
    nearest.extend(own.iter().zip(candidates).map(|(own, candidates)| candidates.nearest(own, others)));
    Ok(nearest)
}

/// A group against a block of groups; `first` are the indices of their first descriptors.
#[inline(never)] // see `crate::rows`
fn compare_all(target: &Group, references: &[Group], first: [u32; 2], rows: &mut Four, columns: &mut [Four]) {
    let mut limits = rows.limits.to_array().map(i32x4::splat);
    for ((k, reference), columns) in (first[1]..).step_by(LANES).zip(references).zip(columns) {
        let distances = target.distances(reference);
        let nearer = |row: usize| distances[row].cmp_lt(limits[row]) | distances[row].cmp_lt(columns.limits);
        // Few groups have one.
        if (nearer(0) | nearer(1) | nearer(2) | nearer(3)).any() {
            update(distances, [first[0], k], rows, columns);
            limits = rows.limits.to_array().map(i32x4::splat);
        }
    }
}

/// Takes the distances of a group from each of another into account: from those of `rows`, of the first index on, to those of `columns`.
#[inline(never)] // rarely called
fn update(distances: [i32x4; LANES], first: [u32; 2], rows: &mut Four, columns: &mut Four) {
    for ((t, own), distances) in (first[0]..).zip(&mut rows.all).zip(distances) {
        for ((k, other), distance) in (first[1]..).zip(&mut columns.all).zip(distances.to_array()) {
            own.update(distance, k);
            other.update(distance, t);
        }
    }
    let limits = |all: &[Candidates; LANES]| i32x4::new(all.map(|candidates| candidates.distance[CANDIDATES - 1]));
    (rows.limits, columns.limits) = (limits(&rows.all), limits(&columns.all));
}
