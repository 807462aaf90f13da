//! Photos by several lenses, or zoomed: the ratios of their focal lengths, by how large they show what they share.
//!
//! What is nearer to one camera looks larger as well: these are first estimates for bundle adjustment, which can contradict them.

use super::least_squares::Equations;
use super::scene::Scene;
use super::self_calibration::{Focal, common_focal};
use super::{Lens, PairLink};

/// Photos by one lens show the same things in sizes up to this different, as the logarithm of the ratio.
const MIXED: f64 = 0.2;
/// What no pair says anything of keeps its share, and what is known does in any case: weights beside those of pairs.
const UNDETERMINED: f64 = 0.1;
const KNOWN: f64 = 1e6;

/// A focal length of its own for each photo where it is not known, instead of the common one; `None` if the photos show things in about
/// the same size.
pub(super) fn calibrate_each(lenses: &[Lens], links: &[PairLink], common: &Focal) -> Option<Focal> {
    let mut focal = common.clone();
    let known: Vec<bool> = lenses.iter().map(|lens| lens.focal.is_some()).collect();
    let changes = changes(lenses, links, &focal.shares, &known)?;
    let most = changes.iter().fold(f64::NEG_INFINITY, |most, change| most.max(*change));
    let least = changes.iter().fold(f64::INFINITY, |least, change| least.min(*change));
    if most - least < MIXED {
        return None;
    }
    for (photo, change) in changes.iter().enumerate().filter(|(photo, _)| !known[*photo]) {
        focal.shares[photo] *= libm::exp(*change);
        focal.estimates[photo] = Some(focal.shares[photo]);
    }
    if !known.contains(&true) {
        focal.value = common_focal(lenses, links, &focal.shares);
    }
    Some(focal)
}

/// Whether bundle adjustment left the ratios nearer to their first estimates than to those of one lens. Where cameras moved ahead, a
/// focal length of their own is one more way to explain the same matches, and says nothing of the lens.
pub(super) fn keeps_ratios(scene: &Scene) -> bool {
    let placed = (0..scene.cameras.len()).filter(|&photo| scene.cameras[photo].is_some());
    let changes = placed.map(|photo| match scene.estimates[photo] {
        Some(estimate) => [scene.shares[photo], scene.shares[photo] / estimate].map(libm::log),
        None => [0.0; 2],
    });
    let changes: Vec<[f64; 2]> = changes.collect();
    // A common factor is the common focal length's.
    let [from_one, from_estimates] = [0, 1].map(|k| variance(changes.iter().map(|change| change[k])));
    from_estimates < from_one
}

/// By how much the logarithm of each photo's share should be larger for photos to show things as large as they do.
fn changes(lenses: &[Lens], links: &[PairLink], shares: &[f64], known: &[bool]) -> Option<Vec<f64>> {
    let mut equations = Equations::zeros(lenses.len());
    for (photo, known) in known.iter().enumerate() {
        equations.add(photo, photo, if *known { KNOWN } else { UNDETERMINED });
    }
    for link in links {
        let Some(ratio) = magnification(link, lenses) else { continue };
        let ([a, b], weight) = (link.photos, (link.matches.len() as f64).sqrt());
        let off = weight * (libm::log(shares[b] / shares[a]) - ratio);
        equations.gradient[a] -= off;
        equations.gradient[b] += off;
        equations.add(a, a, weight);
        equations.add(b, b, weight);
        equations.add(a, b, -weight);
    }
    Some(equations.solve()?.iter().copied().collect())
}

/// The logarithm of how many times larger the second photo of a pair shows what both do, in diagonals; `None` of a single place.
fn magnification(link: &PairLink, lenses: &[Lens]) -> Option<f64> {
    let matches = link.centred_matches(lenses);
    let count = matches.len() as f64;
    let variance = |k: usize| {
        let mean = [0, 1].map(|axis| matches.iter().map(|ends| ends[k][axis]).sum::<f64>() / count);
        matches.iter().map(|ends| (ends[k][0] - mean[0]).powi(2) + (ends[k][1] - mean[1]).powi(2)).sum::<f64>()
    };
    let ratio = 0.5 * libm::log(variance(1) / variance(0));
    ratio.is_finite().then_some(ratio)
}

/// That of numbers of which there is at least one.
fn variance(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    values.map(|value| (value - mean) * (value - mean)).sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::super::scene::Camera;
    use super::*;

    #[test]
    fn ratios_that_turned_round_say_nothing_of_the_lens() {
        let lenses = [Lens { size: (800, 600), focal: None }; 4];
        let keeps = |estimates: [Option<f64>; 4], shares: [f64; 4]| {
            let focal = Focal { shares: shares.to_vec(), estimates: estimates.to_vec(), value: 0.9, prior: [0.0, 1.0] };
            let mut scene = Scene::new(&lenses, &focal);
            scene.cameras = vec![Some(Camera::turned(nalgebra::Matrix3::identity())); 4];
            keeps_ratios(&scene)
        };
        let zoomed = [0.8, 1.2, 0.8, 1.2].map(Some);
        assert!(keeps(zoomed, [0.85, 1.15, 0.8, 1.3]));
        // Also if the common focal length was wrong.
        assert!(keeps(zoomed, [1.7, 2.3, 1.6, 2.6]));
        assert!(!keeps(zoomed, [1.01, 0.99, 1.0, 1.02]));
        assert!(!keeps([0.89, 0.95, 1.02, 1.14].map(Some), [1.14, 1.02, 0.97, 0.93]));
        // One among photos whose focal lengths are known.
        assert!(keeps([None, Some(1.5), None, None], [1.0, 1.45, 1.0, 1.0]));
    }
}
