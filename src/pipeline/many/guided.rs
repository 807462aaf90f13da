//! More matches, once the cameras are known: features are compared again where the geometry and the depth of what was matched say that
//! they may be.

use super::depth::{PhotoDepth, prior};
use super::graph::{FEWEST, PhotoPair};
use crate::features::{
    Features, Luma, MatchGuide, MatchOptions, Pair, align_patch, match_again, matches_of, visible_luma,
};
use crate::geometry::{Model, ModelKind, MultiView, ObservedPair, PairLink};
use crate::observer::{Observer, Portion, Subject};
use crate::rect::diagonal;
use crate::{ImageView, Result};

/// A pair with more matches needs no others.
const ENOUGH: usize = 300;
/// How far from its epipolar line a feature may be, as a share of the diagonal: 3 pixels of 1300.
const BAND: f64 = 0.0023;
/// How far along it, besides twice the error of the depth, as a share of the diagonal.
const REACH: f64 = 0.01;
/// The ratio test: such a band holds few other features to confuse one with.
const RATIO: f64 = 0.85;

/// The links of all `pairs` of placed photos: those there are, and what is found besides for pairs that have few matches.
pub(super) fn more_matches(
    photos: &[ImageView<'_>],
    features: &[Features],
    pairs: &[PhotoPair],
    links: &[PairLink],
    geometry: &MultiView,
    options: &MatchOptions,
    observer: &mut dyn Observer,
) -> Result<Vec<PairLink>> {
    let mut depths: Vec<Option<PhotoDepth>> = vec![None; photos.len()];
    let mut found = Vec::new();
    let count = pairs.len() as f32;
    for (i, pair) in pairs.iter().enumerate() {
        observer.subject(Subject::Pair(pair.photos));
        let mut portion = Portion::new(observer, i as f32 / count, (i + 1) as f32 / count);
        let [a, b] = pair.photos;
        let link = links.iter().find(|link| link.photos == pair.photos);
        if link.is_none_or(|link| link.matches.len() < ENOUGH) {
            if depths[a].is_none() {
                let interpolating = &mut Portion::new(&mut portion, 0.0, 0.5);
                depths[a] = prior(&geometry.samples(a, b), photos[a], interpolating)?;
            }
            if let (Some(model), Some(depth)) = (geometry.model([a, b]), &depths[a]) {
                let both = [&features[a], &features[b]];
                let known = link.map_or(&[][..], |link| &link.features);
                let matching = &mut Portion::new(&mut portion, 0.5, 1.0);
                let link = match_pair_again(pair.photos, both, known, model, depth, options, matching)?;
                if link.matches.len() >= FEWEST {
                    found.push(link);
                    continue;
                }
            }
        }
        found.extend(link.cloned());
    }
    Ok(found)
}

/// Adjusts the cameras to the links, first as they are, then with the places of what is matched found to a fraction of a pixel: the
/// surroundings of a feature are aligned with those in other photos.
pub(super) fn refine(
    photos: &[ImageView<'_>],
    links: &[PairLink],
    geometry: &mut MultiView,
    observer: &mut dyn Observer,
) -> Result<()> {
    geometry.refine(links);
    let mut scenes: Vec<Option<(Luma, Option<PhotoDepth>)>> = Vec::new();
    let count = photos.len() as f32;
    for (photo, image) in photos.iter().enumerate() {
        observer.subject(Subject::Photo(photo));
        let mut portion = Portion::new(observer, photo as f32 / count, (photo + 1) as f32 / count);
        let link = links.iter().find(|link| link.photos.contains(&photo));
        scenes.push(match link {
            Some(link) => {
                let other = link.photos[usize::from(link.photos[0] == photo)];
                let depth = prior(&geometry.samples(photo, other), *image, &mut portion)?;
                Some((visible_luma(*image)?, depth))
            }
            None => None,
        });
    }
    let known = geometry.clone();
    geometry.refine_observations(&mut |&ObservedPair { photos: [a, b], places: [from, to], depth }| {
        let (Some((first, map)), Some((second, _))) = (&scenes[a], &scenes[b]) else { return None };
        let model = known.model([a, b])?;
        let [x, y] = model.project(from[0], from[1], depth)?;
        // What is around is as far away as the map says, next to this.
        let at = |[x, y]: [f64; 2]| map.as_ref().map_or(0.0, |depth| depth.map.sample(x, y));
        let shift = depth - at(from);
        let place = |point: [f64; 2]| {
            let [u, v] = model.project(point[0], point[1], at(point) + shift)?;
            Some([u - x + to[0], v - y + to[1]])
        };
        align_patch([first, second], from, &place)
    });
    Ok(())
}

/// Compares two photos once more. Features that were `known` to match stay unless one is found to match another.
fn match_pair_again(
    photos: [usize; 2],
    both: [&Features; 2],
    known: &[[u32; 2]],
    model: Model,
    depth: &PhotoDepth,
    options: &MatchOptions,
    observer: &mut dyn Observer,
) -> Result<PairLink> {
    let unit = diagonal(both[1].size);
    let guide = MatchGuide {
        forward: &model,
        depth: Some(&depth.map),
        range: [0.0; 2],
        band: BAND * unit,
        reach: REACH * unit + 2.0 * depth.prediction_error,
    };
    let options = MatchOptions { ratio: options.ratio.max(RATIO), ..options.clone() };
    let known = known.iter().map(|&[target, reference]| Pair { target, reference });
    let pairs = match_again(both[0], both[1], known, &guide, &options, observer)?;
    let features = pairs.iter().map(|pair| [pair.target, pair.reference]).collect();
    let matches = matches_of(both[0], both[1], &pairs);
    Ok(PairLink { photos, features, matches, model, kind: ModelKind::TwoView })
}
