//! The whole way where matches are found, guided, tracked, or known in part.
#![allow(clippy::unwrap_used)]

use depthstitch::View;
use depthstitch::features::track;
use depthstitch::geometry::{Frame, Threshold, estimate};
use depthstitch::pipeline::{FeatureOptions, Options, WithoutDepth, align, stitch};
use depthstitch::report::Warning;
use scene::{MatchOptions, Pair, Photos, Scene};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (240, 160);
const EXACT: MatchOptions = MatchOptions { count: 300, sigma: 0.0, outliers: 0.0, seed: 1 };
/// As a good detector finds them.
const NOISY: MatchOptions = MatchOptions { count: 300, sigma: 0.3, outliers: 0.1, seed: 1 };

fn render(scene: &Scene) -> Pair<'_> {
    scene.render(SIZE.0, SIZE.1)
}

#[test]
fn matches_are_found_when_none_are_given() {
    let scene = scene::gallery();
    let photos = Photos::of(&scene.render(360, 240), &NOISY);
    let found = stitch(None, photos.target(), photos.reference(), &Options::default(), &mut ()).unwrap();
    let matches = found.matches.unwrap();
    assert_eq!(found.geometry.inliers.len(), matches.len());
    let inliers = found.geometry.inliers.iter().filter(|inlier| **inlier).count();
    assert!(inliers > 60 && 10 * inliers > 7 * matches.len(), "{inliers} of {}", matches.len());
    let given =
        stitch(Some(&photos.matches), photos.target(), photos.reference(), &Options::default(), &mut ()).unwrap();
    assert!(given.matches.is_none());
    assert!(found.quality.ssim_mask > given.quality.ssim_mask - 0.03);
}

/// Guided matching is an attempt to do better: where its fit fails, the first one counts.
#[test]
fn a_guided_fit_that_fails_leaves_the_first_one() {
    let scene = scene::gallery();
    let photos = Photos::of(&render(&scene), &NOISY);
    let views = [photos.target(), photos.reference()].map(|view| View { depth: None, ..view });
    let mut compared = 0;
    for seed in 1..=24 {
        let mut options = Options { refine: None, fill: None, ..Options::default() };
        // Few samples: whether they hit a good one is luck.
        (options.estimate.seed, options.estimate.max_trials) = (seed, 3);
        options.features.matching.ratio = 0.95;
        let first =
            Options { features: FeatureOptions { guided: false, ..options.features.clone() }, ..options.clone() };
        if align(None, views[0], views[1], &first, &mut ()).is_ok() {
            compared += 1;
            let guided = align(None, views[0], views[1], &options, &mut ());
            assert!(guided.is_ok(), "seed {seed}: {:?}", guided.err());
        }
    }
    println!("{compared} first fits");
    assert!(compared > 0);
}

/// The homography that takes the place of parallax is the one that is found where no parallax is looked for: not one of matches along epipolar lines that
/// may be wrong.
#[test]
fn a_homography_instead_of_parallax_is_that_without_parallax() {
    let scene = scene::gallery();
    // At this size and larger a homography looks more natural.
    let photos = Photos::of(&scene.render(540, 360), &NOISY);
    let views = [photos.target(), photos.reference()].map(|view| View { depth: None, ..view });
    let of = |options: &Options| align(None, views[0], views[1], options, &mut ()).unwrap();
    let found = of(&Options::default());
    let plain = of(&Options { without_depth: WithoutDepth::Homography, ..Options::default() });
    assert!(found.geometry.warnings.contains(&Warning::ParallaxIgnored));
    assert!(found.matches == plain.matches && found.geometry.forward == plain.geometry.forward);
    assert_eq!(found.geometry.inliers, plain.geometry.inliers);
}

/// Moves a rectangle of a photo down by a pixel, as something that moved between the photos.
fn move_down(image: &mut depthstitch::Image, [left, top, right, bottom]: [usize; 4]) {
    let width = image.width();
    let pixels = image.pixels_mut();
    for y in (top..bottom).rev() {
        pixels.copy_within((y - 1) * width + left..(y - 1) * width + right, y * width + left);
    }
}

/// Of the tracked points those are counted that were fitted, not those that the fit rejected.
#[test]
fn tracked_points_count_when_they_were_fitted() {
    let scene = scene::gallery();
    let mut photos = Photos::of(&render(&scene), &EXACT);
    move_down(&mut photos.reference, [100, 60, 180, 120]);
    let (target, reference) = (photos.target(), photos.reference());
    let mut options = Options::default();
    options.estimate.threshold = Threshold::Pixels(0.5);
    let found = align(Some(&photos.matches), target, reference, &options, &mut ()).unwrap();
    let frames = [target, reference].map(|view| Frame { size: SIZE, depth: view.depth });
    let first = estimate(&photos.matches, frames[0], frames[1], &options.estimate, &mut ()).unwrap();
    let mut all = photos.matches.clone();
    let map = photos.reference_depth.as_ref().unwrap();
    track(target.image, reference.image, map, &first.reverse, &mut all, &mut ()).unwrap();
    let both = estimate(&all, frames[0], frames[1], &options.estimate, &mut ()).unwrap();
    let [tracked, fitted] = [&vec![true; all.len()], &both.inliers]
        .map(|flags| flags[photos.matches.len()..].iter().filter(|flag| **flag).count());
    assert!(0 < fitted && fitted < tracked, "{fitted} of {tracked} are fitted");
    assert_eq!(found.geometry.tracked, fitted);
}
