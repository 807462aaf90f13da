//! Matching the keypoints of two photos by their descriptors.

use super::descriptor::SCALE;
use super::nearest::{Descriptors, Nearest, nearest};
use super::{Features, MatchOptions, Pair};
use crate::geometry::Match;
use crate::image::zeroed;
use crate::observer::{Observer, report};
use crate::{Error, Result, Stage};

/// Pairs of keypoints whose descriptors are nearest to each other, and clearly nearer than the second nearest of the
/// reference (Lowe 2004, section 7.1). No two share a place in either photo. Sorted by the place in the target (y, x, scale,
/// angle), whatever order the features have.
///
/// # Errors
/// `invalid-argument` for options out of range, `size-mismatch` for features that lack descriptors, `out-of-memory`, `aborted`.
pub fn match_features(
    target: &Features,
    reference: &Features,
    options: &MatchOptions,
    observer: &mut dyn Observer,
) -> Result<Vec<Pair>> {
    check(target, reference, options)?;
    report(observer, Stage::Match, 0.0)?;
    let both = [target.ordered_by_place()?, reference.ordered_by_place()?];
    let [target, reference] = [Descriptors::of(&both[0].0.descriptors)?, Descriptors::of(&both[1].0.descriptors)?];
    let [mut of_target, of_reference] = nearest([&target, &reference], observer)?;
    for (index, nearest) in (0..).zip(&mut of_target) {
        if matches(index, nearest, &of_reference, options) {
            let (first, found) = (nearest.distance[0], nearest.index);
            let rival = (f64::from(first) / (options.ratio * options.ratio)) as i32;
            let others = of_reference[found as usize].others;
            if nearest.others <= rival && reference.any_within(rival, (&target, index), found)
                || options.mutual && others < first && target.any_within(first - 1, (&reference, found), index)
            {
                *nearest = Nearest::default();
            }
        }
    }
    report(observer, Stage::Match, 1.0)?;
    pairs(&both, [&of_target, &of_reference], options)
}

/// Whether a descriptor of the target and its nearest one are a pair, by ratio, distance and mutual test.
fn matches(index: u32, nearest: &Nearest, of_reference: &[Nearest], options: &MatchOptions) -> bool {
    let Some(back) = of_reference.get(nearest.index as usize) else { return false };
    let (limit, most) = (options.ratio * options.ratio, options.max_distance * f64::from(SCALE));
    let [first, second] = nearest.distance.map(f64::from);
    first <= most * most && first < limit * second && (!options.mutual || back.index == index)
}

pub(super) fn check(target: &Features, reference: &Features, options: &MatchOptions) -> Result<()> {
    if !(options.ratio > 0.0 && options.ratio <= 1.0) {
        return Err(
            Error::InvalidArgument { name: "ratio", expected: "above 0 and at most 1", value: options.ratio }.into()
        );
    }
    if !(options.max_distance > 0.0 && options.max_distance <= 2.0) {
        let (expected, value) = ("above 0 and at most 2", options.max_distance);
        return Err(Error::InvalidArgument { name: "maxDistance", expected, value }.into());
    }
    for (name, features) in [("target", target), ("reference", reference)] {
        let (expected, actual) = (features.keypoints.len() as u64, features.descriptors.len() as u64);
        if expected != actual {
            return Err(Error::SizeMismatch { name, expected, actual }.into());
        }
    }
    Ok(())
}

/// The pairs that pass ratio, distance and mutual test.
///
/// Given are the features of target and reference, ordered by place, with the indices before that, which the pairs get, and
/// their nearest neighbours. Of pairs that share a place, as a place may have several orientations, the nearest is kept.
pub(super) fn pairs(
    [(target, in_target), (reference, in_reference)]: &[(Features, Vec<u32>); 2],
    [of_target, of_reference]: [&[Nearest]; 2],
    options: &MatchOptions,
) -> Result<Vec<Pair>> {
    let mut pairs = Vec::new();
    for (index, nearest) in (0..).zip(of_target) {
        if matches(index, nearest, of_reference, options) {
            pairs.push(Pair { target: index, reference: nearest.index });
        }
    }
    let distance = |pair: &Pair| (of_target[pair.target as usize].distance[0], pair.target);
    for reference_side in [false, true] {
        let features = if reference_side { reference } else { target };
        let first = first_of_place(features)?;
        let place = |pair: &Pair| first[if reference_side { pair.reference } else { pair.target } as usize] as usize;
        let mut best: Vec<(i32, u32)> = zeroed(first.len())?;
        best.fill((i32::MAX, 0));
        for pair in &pairs {
            let best = &mut best[place(pair)];
            *best = distance(pair).min(*best);
        }
        pairs.retain(|pair| best[place(pair)] == distance(pair));
    }
    for Pair { target, reference } in &mut pairs {
        (*target, *reference) = (in_target[*target as usize], in_reference[*reference as usize]);
    }
    Ok(pairs)
}

/// For each keypoint, ordered by place, the index of the first one at the same place.
fn first_of_place(features: &Features) -> Result<Vec<u32>> {
    let mut first: Vec<u32> = zeroed(features.keypoints.len())?;
    for (i, two) in features.keypoints.windows(2).enumerate() {
        let same = (two[0].x, two[0].y) == (two[1].x, two[1].y);
        first[i + 1] = if same { first[i] } else { i as u32 + 1 };
    }
    Ok(first)
}

/// The positions of the pairs, one match each, in pixels of the photos. Pairs whose indices are out of range are left out.
pub fn matches_of(target: &Features, reference: &Features, pairs: &[Pair]) -> Vec<Match> {
    let place = |features: &Features, index: u32| {
        features.keypoints.get(index as usize).map(|k| [f64::from(k.x), f64::from(k.y)])
    };
    pairs
        .iter()
        .filter_map(|pair| {
            let (target, reference) = (place(target, pair.target)?, place(reference, pair.reference)?);
            Some(Match { target, reference })
        })
        .collect()
}
