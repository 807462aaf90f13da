//! Keypoints and descriptors through their public function: known warps in, known places out.

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod fingerprint;
mod speckle;

use depthstitch::features::{DetectOptions, Features, Keypoint, MatchOptions, detect, match_features};
use depthstitch::geometry::Match;
use depthstitch::observer::Observer;
use depthstitch::{Image, Stage};
use fingerprint::fingerprint;
use nalgebra::Matrix3;
use scene::{Photos, Random, median};
use speckle::{SIZE, Speckle, found, matched, plain, speckle, through, turn};

/// Median error and mean offset of the matches that lie within 3 px of where `truth` puts the target's point, and their share.
fn judge(matches: &[Match], truth: impl Fn([f64; 2]) -> [f64; 2]) -> (f64, [f64; 2], f64) {
    let offsets: Vec<[f64; 2]> = matches
        .iter()
        .map(|m| (truth(m.target), m.reference))
        .map(|(t, r)| [r[0] - t[0], r[1] - t[1]])
        .filter(|[x, y]| x * x + y * y < 9.0)
        .collect();
    let n = offsets.len() as f64;
    let mean = [0, 1].map(|k| offsets.iter().map(|o| o[k]).sum::<f64>() / n);
    let error = median(offsets.iter().map(|[x, y]| (x * x + y * y).sqrt()).collect());
    (error, mean, n / matches.len() as f64)
}

#[test]
fn places_are_right_to_a_fraction_of_a_pixel_under_known_warps() {
    let speckle = speckle();
    let target = found(&plain(&speckle), &DetectOptions::default());
    assert!(target.keypoints.len() > 300, "{}", target.keypoints.len());
    let tilt = Matrix3::new(1.02, 0.05, -4.0, -0.08, 0.95, 6.0, 2e-4, -1e-4, 1.0);
    for (name, (h, inverse), least) in [
        (
            "shift",
            (
                Matrix3::new(1.0, 0.0, 3.37, 0.0, 1.0, -2.61, 0.0, 0.0, 1.0),
                Matrix3::new(1.0, 0.0, -3.37, 0.0, 1.0, 2.61, 0.0, 0.0, 1.0),
            ),
            0.6,
        ),
        ("turn", turn(0.7, 1.0), 0.4),
        ("half turn", turn(3.0, 1.0), 0.4),
        ("grow", turn(-0.2, 1.5), 0.2),
        ("shrink", turn(0.1, 0.6), 0.15),
        ("tilt", (tilt, tilt.try_inverse().unwrap()), 0.5),
    ] {
        let reference =
            found(&speckle.draw(SIZE.0, SIZE.1, |x, y| through(&inverse, [x, y])), &DetectOptions::default());
        let matches = matched(&target, &reference);
        let (error, mean, right) = judge(&matches, |p| through(&h, p));
        assert!(error <= 0.25, "{name}: {error}");
        assert!(mean.iter().all(|v| v.abs() < 0.03), "{name}: {mean:?}");
        assert!(right > 0.97, "{name}: {right}");
        let share = matches.len() as f64 / target.keypoints.len() as f64;
        assert!(share > least, "{name}: {share}");
    }
}

/// One blob of a known place and size.
fn blob(width: usize, height: usize, [x, y]: [f64; 2], sigma: f64) -> Image {
    Speckle(vec![[x, y, sigma, 120.0]]).draw(width, height, |u, v| [u, v])
}

#[test]
fn a_blob_is_found_where_it_is_at_the_scale_it_has() {
    for upsample in [true, false] {
        for sigma in [2.2, 3.0, 4.1, 5.7] {
            for place in [[40.0, 40.0], [40.3, 37.8], [41.5, 40.5]] {
                let image = blob(80, 80, place, sigma);
                let options = DetectOptions { upsample, adaptive: false, ..Default::default() };
                let features = found(&image, &options);

                let best = features.keypoints.iter().max_by(|a, b| a.response.total_cmp(&b.response)).unwrap();
                let off = [f64::from(best.x) - place[0], f64::from(best.y) - place[1]];
                // The pixels' area and the camera's assumed blur are part of the scale, the differences' spacing as well.
                let scale = f64::from(best.scale) / sigma;
                assert!(off.iter().all(|v| v.abs() < 0.1), "upsample {upsample}, σ {sigma} at {place:?}: {off:?}");
                assert!((0.8..1.2).contains(&scale), "upsample {upsample}, σ {sigma}: {scale}");
            }
        }
    }
}

#[test]
fn large_photos_are_searched_at_a_limited_size_and_places_scaled_back() {
    let speckle = speckle();
    let options = DetectOptions::default();
    let small = found(&plain(&speckle), &options);
    // Three times as large: x = (X + ½)/3 − ½.
    let large = speckle.draw(3 * SIZE.0, 3 * SIZE.1, |x, y| [(x + 0.5) / 3.0 - 0.5, (y + 0.5) / 3.0 - 0.5]);
    let limited = found(&large, &DetectOptions { max_size: SIZE.0, ..options });
    assert_eq!(limited.size, (3 * SIZE.0, 3 * SIZE.1));
    let (error, mean, right) = judge(&matched(&small, &limited), |[x, y]| [3.0 * x + 1.0, 3.0 * y + 1.0]);
    assert!(error < 0.3 && mean.iter().all(|v| v.abs() < 0.03) && right > 0.97, "{error} {mean:?} {right}");
    let scales = |f: &Features| median(f.keypoints.iter().map(|k| f64::from(k.scale)).collect());
    assert!((scales(&limited) / scales(&small) - 3.0).abs() < 0.3);
}

/// Where each feature stands when they are ordered by place.
fn by_place(features: &Features) -> Vec<usize> {
    let key = |k: &Keypoint| [k.y, k.x, k.scale, k.angle];
    let mut order: Vec<usize> = (0..features.keypoints.len()).collect();
    order.sort_by(|&a, &b| key(&features.keypoints[a]).partial_cmp(&key(&features.keypoints[b])).unwrap());
    assert!(order.windows(2).all(|w| key(&features.keypoints[w[0]]) < key(&features.keypoints[w[1]])));
    order
}

#[test]
fn features_are_strongest_first_unique_and_the_same_every_time() {
    let image = plain(&speckle());
    for root in [true, false] {
        let options = DetectOptions { root, ..Default::default() };
        let features = found(&image, &options);
        assert_eq!(features, found(&image, &options));
        assert_eq!(features.keypoints.len(), features.descriptors.len());
        assert!(features.keypoints.is_sorted_by(|a, b| a.response >= b.response));
        assert_eq!(by_place(&features).len(), features.keypoints.len());
        assert!(features.keypoints.iter().all(|k| (0.0..2.0 * std::f32::consts::PI).contains(&k.angle)));
        for descriptor in &features.descriptors {
            let square: i32 = descriptor.iter().map(|&v| i32::from(v) * i32::from(v)).sum();
            assert!((f64::from(square).sqrt() - 512.0).abs() < 12.0, "{square}");
        }
    }
}

/// The bytes of everything found and matched; natively and in wasm it has to be this.
#[test]
fn features_are_the_same_bytes_on_every_machine() {
    let gallery = scene::gallery();
    let pair = gallery.render(160, 120);
    let photos = Photos::of(&pair, &scene::MatchOptions { count: 10, sigma: 0.0, outliers: 0.0, seed: 1 });
    let [target, reference] = [&photos.target, &photos.reference].map(|photo| found(photo, &DetectOptions::default()));
    let pairs = match_features(&target, &reference, &MatchOptions::default(), &mut ()).unwrap();
    let mut values: Vec<u32> = Vec::new();
    let orders = [&target, &reference].map(by_place);
    for (features, order) in [&target, &reference].into_iter().zip(&orders) {
        for &i in order {
            let k = &features.keypoints[i];
            values.extend([k.x, k.y, k.scale, k.angle, k.response].map(f32::to_bits));
        }
        values.extend(order.iter().flat_map(|&i| features.descriptors[i]).map(u32::from));
    }
    let [of_target, of_reference] =
        orders.map(|order| move |index: u32| order.iter().position(|&i| i == index as usize).unwrap() as u32);
    values.extend(pairs.iter().flat_map(|p| [of_target(p.target), of_reference(p.reference)]));
    let hash = fingerprint(values.into_iter().map(u64::from));
    assert_eq!(
        (target.keypoints.len(), reference.keypoints.len(), pairs.len(), hash),
        (352, 275, 31, 10_902_427_099_918_759_946)
    );
}

#[test]
fn where_there_is_little_contrast_the_threshold_is_lowered() {
    let faint = |image: &Image| {
        let mut faint = image.clone();
        faint.pixels_mut().iter_mut().flat_map(|pixel| &mut pixel[..3]).for_each(|v| *v = 100 + *v / 10);
        faint
    };
    let speckle = speckle();
    let (h, inverse) = turn(0.1, 1.0);
    let target = faint(&plain(&speckle));
    let reference = faint(&speckle.draw(SIZE.0, SIZE.1, |x, y| through(&inverse, [x, y])));
    let run = |adaptive| {
        let options = DetectOptions { adaptive, ..Default::default() };
        let (target, reference) = (found(&target, &options), found(&reference, &options));
        matched(&target, &reference)
            .iter()
            .filter(|m| {
                let [x, y] = through(&h, m.target);
                (x - m.reference[0]).hypot(y - m.reference[1]) < 1.5
            })
            .count()
    };
    let (fixed, adaptive) = (run(false), run(true));
    assert!(adaptive > 100 && adaptive > 2 * fixed, "{fixed} {adaptive}");
}

#[test]
fn too_many_keypoints_are_thinned_out_evenly() {
    // The right half has ten times the contrast.
    let speckle = speckle();
    let mut image = plain(&speckle);
    for (i, v) in image.data_mut().iter_mut().enumerate() {
        if (i / 4) % SIZE.0 < SIZE.0 / 2 {
            *v = 110 + *v / 8;
        }
    }
    let most = 120;
    let features =
        found(&image, &DetectOptions { max_keypoints: most, contrast_threshold: 0.005, ..Default::default() });
    let mut places: Vec<[u32; 2]> = features.keypoints.iter().map(|k| [k.x.to_bits(), k.y.to_bits()]).collect();
    places.sort_unstable();
    places.dedup();
    assert!(places.len() <= most && places.len() > most * 3 / 4, "{}", places.len());
    let left = features.keypoints.iter().filter(|k| k.x < SIZE.0 as f32 / 2.0).count();
    assert!(left * 3 > features.keypoints.len(), "{left} of {}", features.keypoints.len());
    assert!(found(&image, &DetectOptions { max_keypoints: 0, ..Default::default() }).keypoints.is_empty());
}

#[test]
fn hard_photos_give_few_features_and_no_panic() {
    for (width, height) in [(1, 1), (1, 500), (500, 1), (7, 9), (8, 8), (9, 8), (15, 15), (16, 16), (17, 40), (33, 8)] {
        for options in [
            DetectOptions::default(),
            DetectOptions { upsample: false, ..Default::default() },
            DetectOptions { max_size: 3, ..Default::default() },
            DetectOptions { max_size: 20, root: false, ..Default::default() },
        ] {
            for kind in 0..3 {
                let mut random = Random::new(kind);
                let mut image = Image::transparent(width, height).unwrap();
                image
                    .data_mut()
                    .iter_mut()
                    .for_each(|v| *v = if kind == 0 { 255 } else { (256.0 * random.uniform()) as u8 });
                let features = found(&image, &options);
                assert_eq!(features.size, (width, height));
                assert!(kind > 0 || features.keypoints.is_empty());
                for k in &features.keypoints {
                    let inside = |v: f32, size: usize| v > -0.5 && v < size as f32 - 0.5;
                    assert!(inside(k.x, width) && inside(k.y, height) && k.scale > 0.0 && k.response > 0.0, "{k:?}");
                }
            }
        }
    }
}

#[test]
fn bad_options_are_named() {
    let image = Image::transparent(40, 40).unwrap();
    let code = |options: &DetectOptions| detect(image.view(), options, &mut ()).map_err(|e| e.to_string());
    for bad in [-0.01, -1.0, f64::NAN, f64::INFINITY, 1.5] {
        let message = code(&DetectOptions { contrast_threshold: bad, ..Default::default() }).unwrap_err();
        assert!(message.contains("contrastThreshold"), "{message}");
    }
    for bad in [0.0, 0.5, f64::NAN, f64::INFINITY] {
        let message = code(&DetectOptions { edge_threshold: bad, ..Default::default() }).unwrap_err();
        assert!(message.contains("edgeThreshold"), "{message}");
    }
    for allowed in [
        DetectOptions { contrast_threshold: 0.0, ..Default::default() },
        DetectOptions { contrast_threshold: 0.0, adaptive: false, ..Default::default() },
        DetectOptions { edge_threshold: 1e7, ..Default::default() },
        DetectOptions { edge_threshold: f64::MAX, ..Default::default() },
    ] {
        assert!(code(&allowed).is_ok(), "{allowed:?}");
    }
    let error = detect(image.view(), &DetectOptions { max_bytes: 1000, ..Default::default() }, &mut ()).unwrap_err();
    assert_eq!(error.code(), "too-large");
}

/// Stops at the n-th report; remembers the fractions.
struct Stop(usize, Vec<(Stage, f32)>);

impl Observer for Stop {
    fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
        self.1.push((stage, fraction));
        self.1.len() != self.0
    }
}

#[test]
fn progress_grows_and_the_caller_can_stop() {
    let image = plain(&speckle());
    let mut all = Stop(usize::MAX, Vec::new());
    let features = detect(image.view(), &DetectOptions::default(), &mut all).unwrap();
    assert!(all.1.len() > 10 && all.1.iter().all(|r| r.0 == Stage::Detect));
    assert!(all.1.windows(2).all(|w| w[0].1 <= w[1].1) && all.1[all.1.len() - 1].1 == 1.0, "{:?}", all.1);
    for n in [1, 2, 5, all.1.len()] {
        let error = detect(image.view(), &DetectOptions::default(), &mut Stop(n, Vec::new())).unwrap_err();
        assert_eq!(error.code(), "aborted");
    }
    let mut all = Stop(usize::MAX, Vec::new());
    match_features(&features, &features, &MatchOptions::default(), &mut all).unwrap();
    assert!(all.1.iter().all(|r| r.0 == Stage::Match) && all.1.windows(2).all(|w| w[0].1 <= w[1].1));
    let error = match_features(&features, &features, &MatchOptions::default(), &mut Stop(2, Vec::new())).unwrap_err();
    assert_eq!(error.code(), "aborted");
}
