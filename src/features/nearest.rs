//! The two nearest descriptors, exactly, for both photos in one pass.

use wide::{CmpLt, i16x8, i32x4};

use super::LENGTH;
use crate::image::{defaults, reserve};
use crate::observer::{Observer, report};
use crate::{Result, Stage};

/// Descriptors of a group, one to a lane.
const LANES: usize = 4;
/// Groups that stay in the processor's nearest cache while all others pass by: 16 KB.
const BLOCK: usize = 16;
/// Blocks between two reports.
const BLOCKS: usize = 16;
/// More than any squared distance.
pub(super) const FAR: i32 = 1 << 26;

/// The nearest and second nearest descriptors of the other photo.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// Squared distances.
    pub distance: [i32; 2],
    pub index: u32,
}

impl Default for Nearest {
    fn default() -> Self {
        Self { distance: [FAR; 2], index: u32::MAX }
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
pub(super) fn squared_distance(a: &[u8; LENGTH], b: &[u8; LENGTH]) -> i32 {
    let difference = |(&a, &b): (&u8, &u8)| i32::from(a) - i32::from(b);
    a.iter().zip(b).map(difference).map(|d| d * d).sum()
}

/// Four descriptors, values 2i and 2i + 1 of each in vector i; what is missing is far from everything.
struct Group {
    values: [i16x8; LENGTH / 2],
    /// Squared norms.
    norms: i32x4,
}

fn groups(descriptors: &[[u8; LENGTH]]) -> Result<Vec<Group>> {
    let mut out = Vec::new();
    reserve(&mut out, descriptors.len().div_ceil(LANES))?;
    for four in descriptors.chunks(LANES) {
        let (mut values, mut norms) = ([[0i16; 2 * LANES]; LENGTH / 2], [FAR; LANES]);
        for (lane, descriptor) in four.iter().take(LANES).enumerate() {
            norms[lane] = squared_distance(descriptor, &[0; LENGTH]);
            let values = values.as_flattened_mut().iter_mut().skip(2 * lane);
            for (i, value) in values.enumerate().filter(|(i, _)| i % (2 * LANES) < 2) {
                *value = descriptor[i / LANES + i % 2].into();
            }
        }
        out.push(Group { values: bytemuck::cast(values), norms: i32x4::new(norms) });
    }
    Ok(out)
}

/// For each target descriptor the nearest two of the reference, and the other way round.
pub(super) fn nearest(
    target: &[[u8; LENGTH]],
    reference: &[[u8; LENGTH]],
    observer: &mut dyn Observer,
) -> Result<[Vec<Nearest>; 2]> {
    let mut of_target: Vec<Nearest> = defaults(target.len().next_multiple_of(LANES))?;
    let mut of_reference: Vec<Nearest> = defaults(reference.len().next_multiple_of(LANES))?;
    let (targets, references) = (groups(target)?, groups(reference)?);
    for (block, groups) in references.chunks(BLOCK).enumerate() {
        if block % BLOCKS == 0 {
            report(observer, Stage::Match, (block * BLOCK) as f32 / references.len() as f32)?;
        }
        for (t, group) in targets.iter().enumerate() {
            let Some(rows) = of_target[LANES * t..].first_chunk_mut::<LANES>() else { break };
            compare_all(group, groups, LANES * t, LANES * BLOCK * block, rows, &mut of_reference);
        }
    }
    of_target.truncate(target.len());
    of_reference.truncate(reference.len());
    Ok([of_target, of_reference])
}

/// A group against a block of groups; `t` and `r` are the indices of the first.
#[inline(never)] // the first matching takes 475 ms instead of 1358, see `crate::rows`
fn compare_all(
    target: &Group,
    references: &[Group],
    t: usize,
    r: usize,
    rows: &mut [Nearest; LANES],
    of_reference: &mut [Nearest],
) {
    let (columns, _) = of_reference[r..].as_chunks_mut::<LANES>();
    for ((k, reference), columns) in (r..).step_by(LANES).zip(references).zip(columns) {
        compare(target, reference, t, k, rows, columns);
    }
}

/// All four against all four; `t` and `r` are the indices of the first.
#[inline(always)]
fn compare(
    target: &Group,
    reference: &Group,
    t: usize,
    r: usize,
    rows: &mut [Nearest; LANES],
    columns: &mut [Nearest; LANES],
) {
    let mut products = [i32x4::splat(0); LANES];
    for (values, others) in target.values.iter().zip(&reference.values) {
        // Two values at a time, as one number.
        let pairs: [i32; LANES] = bytemuck::cast(*values);
        for (product, pair) in products.iter_mut().zip(pairs) {
            let both: i16x8 = bytemuck::cast(i32x4::splat(pair));
            *product += others.dot(both);
        }
    }
    let mut limit = i32x4::new(columns.map(|c| c.distance[1]));
    let norms = target.norms.to_array();
    for (row, (product, norm)) in products.into_iter().zip(norms).enumerate() {
        let distance = reference.norms + i32x4::splat(norm) - (product + product);
        let nearer = distance.cmp_lt(i32x4::splat(rows[row].distance[1])) | distance.cmp_lt(limit);
        if nearer.any() {
            for (lane, distance) in distance.to_array().into_iter().enumerate() {
                rows[row].update(distance, (r + lane) as u32);
                columns[lane].update(distance, (t + row) as u32);
            }
            limit = i32x4::new(columns.map(|c| c.distance[1]));
        }
    }
}
