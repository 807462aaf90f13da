//! Matches, free and guided, through their public functions.

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod speckle;

use std::collections::HashSet;

use depthstitch::InverseDepth;
use depthstitch::features::{
    DetectOptions, Features, Keypoint, MatchGuide, MatchOptions, Pair, match_features, match_guided, matches_of,
};
use depthstitch::geometry::{Match, Model};
use depthstitch::inverse_depth::DepthKind;
use nalgebra::{Matrix3, Vector3};
use scene::Photos;
use speckle::{SIZE, found, matched, plain, speckle, through, turn};

/// Everything against everything, as the definition has it.
fn brute_force(target: &Features, reference: &Features, options: &MatchOptions) -> Vec<Pair> {
    let distance = |a: &[u8; 128], b: &[u8; 128]| -> i64 {
        a.iter().zip(b).map(|(&a, &b)| (i64::from(a) - i64::from(b)) * (i64::from(a) - i64::from(b))).sum()
    };
    let nearest = |a: &[u8; 128], others: &[[u8; 128]]| {
        let mut all: Vec<(i64, usize)> = others.iter().enumerate().map(|(i, b)| (distance(a, b), i)).collect();
        all.sort();
        all
    };
    let mut pairs = Vec::new();
    for (t, descriptor) in target.descriptors.iter().enumerate() {
        let near = nearest(descriptor, &reference.descriptors);
        let (first, index) = near[0];
        let second = near.get(1).map_or(f64::INFINITY, |&(d, _)| d as f64);
        let back = nearest(&reference.descriptors[index], &target.descriptors)[0].1 == t;
        let close = (first as f64).sqrt() <= options.max_distance * 512.0;
        if close && (first as f64) < options.ratio * options.ratio * second && (back || !options.mutual) {
            pairs.push((first, Pair { target: t as u32, reference: index as u32 }));
        }
    }
    // Of those that share a place the nearest.
    let place = |k: &Keypoint| [k.x.to_bits(), k.y.to_bits()];
    for side in [
        |p: &Pair, t: &Features, _: &Features| t.keypoints[p.target as usize],
        |p: &Pair, _: &Features, r: &Features| r.keypoints[p.reference as usize],
    ] {
        let all = pairs.clone();
        pairs.retain(|(d, p)| {
            all.iter().all(|(e, q)| {
                let same = place(&side(p, target, reference)) == place(&side(q, target, reference));
                !same || (d, p.target) <= (e, q.target)
            })
        });
    }
    let mut pairs: Vec<Pair> = pairs.into_iter().map(|(_, pair)| pair).collect();
    pairs.sort_by(|a, b| {
        let key = |pair: &Pair| {
            let k = &target.keypoints[pair.target as usize];
            [k.y, k.x, k.scale, k.angle]
        };
        key(a).partial_cmp(&key(b)).unwrap()
    });
    pairs
}

/// The search looks for the nearest in some coefficients first: whatever it finds is right, and hardly any is missed.
#[test]
fn matches_are_those_of_the_definition() {
    let speckle = speckle();
    let (_, inverse) = turn(0.3, 1.1);
    let mut target = found(&plain(&speckle), &DetectOptions::default());
    let mut reference =
        found(&speckle.draw(SIZE.0, SIZE.1, |x, y| through(&inverse, [x, y])), &DetectOptions::default());
    for (n, m) in [(usize::MAX, usize::MAX), (97, 130), (3, 5), (1, 1), (1, 70)] {
        for features in [(&mut target, n), (&mut reference, m)] {
            features.0.keypoints.truncate(features.1);
            features.0.descriptors.truncate(features.1);
        }
        for options in [
            MatchOptions::default(),
            MatchOptions { ratio: 0.95, mutual: false, ..Default::default() },
            MatchOptions { ratio: 1.0, max_distance: 2.0, ..Default::default() },
        ] {
            let pairs = match_features(&target, &reference, &options, &mut ()).unwrap();
            let all = brute_force(&target, &reference, &options);
            assert!(pairs.iter().all(|pair| all.contains(pair)), "{n} {m} {options:?}");
            assert!(
                pairs.len() as f64 >= 0.98 * all.len() as f64,
                "{n} {m} {options:?}: {} {}",
                pairs.len(),
                all.len()
            );
        }
    }
}

/// The same features in another order.
fn shuffled(features: &Features, seed: u64) -> Features {
    let mut random = scene::Random::new(seed);
    let mut order: Vec<(u64, usize)> =
        (0..features.keypoints.len()).map(|i| ((1e15 * random.uniform()) as u64, i)).collect();
    order.sort_unstable();
    Features {
        keypoints: order.iter().map(|&(_, i)| features.keypoints[i]).collect(),
        descriptors: order.iter().map(|&(_, i)| features.descriptors[i]).collect(),
        size: features.size,
    }
}

#[test]
fn the_order_of_the_features_makes_no_difference() {
    let speckle = speckle();
    let (h, inverse) = turn(0.3, 1.1);
    let target = found(&plain(&speckle), &DetectOptions::default());
    let reference = found(&speckle.draw(SIZE.0, SIZE.1, |x, y| through(&inverse, [x, y])), &DetectOptions::default());
    // Some places have several orientations, which is where an order could matter.
    let places = |f: &Features| f.keypoints.iter().map(|k| [k.x, k.y].map(f32::to_bits)).collect::<HashSet<_>>().len();
    assert!(places(&target) < target.keypoints.len());
    let forward = Model::homography(h);
    let guide = MatchGuide { forward: &forward, depth: None, range: [0.0, 0.0], band: 1.0, reach: 4.0 };
    for options in [MatchOptions::default(), MatchOptions { ratio: 0.95, mutual: false, ..Default::default() }] {
        let matches = |target: &Features, reference: &Features| {
            let free = match_features(target, reference, &options, &mut ()).unwrap();
            let guided = match_guided(target, reference, &guide, &options, &mut ()).unwrap();
            [free, guided].map(|pairs| matches_of(target, reference, &pairs))
        };
        let expected = matches(&target, &reference);
        assert!(expected.iter().all(|matches| matches.len() > 100));
        for seed in 1..4 {
            assert_eq!(matches(&shuffled(&target, seed), &shuffled(&reference, seed + 9)), expected);
        }
    }
}

#[test]
fn nothing_matches_nothing() {
    let some = found(&plain(&speckle()), &DetectOptions::default());
    let none = Features { keypoints: Vec::new(), descriptors: Vec::new(), size: (5, 5) };
    for (a, b) in [(&some, &none), (&none, &some), (&none, &none)] {
        assert_eq!(match_features(a, b, &MatchOptions::default(), &mut ()).unwrap(), []);
    }
    assert_eq!(
        matches_of(&some, &none, &[Pair { target: 0, reference: 0 }, Pair { target: 1 << 30, reference: 0 }]),
        []
    );
}

fn guided(photos: &Photos, forward: &Model, depth: Option<&InverseDepth>, range: [f64; 2]) -> [usize; 4] {
    let options = DetectOptions::default();
    let (target, reference) = (found(&photos.target, &options), found(&photos.reference, &options));
    let truth = photos.target_depth.as_ref().unwrap();
    let count = |pairs: &[Pair], forward: &Model| {
        let matches = matches_of(&target, &reference, pairs);
        let right = matches.iter().filter(|m| {
            let [x, y] = m.target;
            let place = forward.project(x, y, truth.sample(x, y));
            place.is_some_and(|[u, v]| (u - m.reference[0]).hypot(v - m.reference[1]) < 2.0)
        });
        [right.count(), matches.len()]
    };
    let guide = MatchGuide { forward, depth, range, band: 2.0, reach: 6.0 };
    let free = match_features(&target, &reference, &MatchOptions::default(), &mut ()).unwrap();
    let looser = MatchOptions { ratio: 0.8, max_distance: 0.5, ..Default::default() };
    let along = match_guided(&target, &reference, &guide, &looser, &mut ()).unwrap();
    let ([a, b], [c, d]) = (count(&free, forward), count(&along, forward));
    [a, b, c, d]
}

#[test]
fn guided_matching_finds_more_inliers() {
    let gallery = scene::gallery();
    let pair = gallery.render(320, 240);
    let photos = Photos::of(&pair, &scene::MatchOptions { count: 10, sigma: 0.0, outliers: 0.0, seed: 1 });
    let depth = photos.target_depth.as_ref().unwrap();
    let known = depth.data().iter().filter(|d| d.is_finite());
    let range = [known.clone().fold(f32::INFINITY, |a, &b| a.min(b)), known.fold(0.0, |a: f32, &b| a.max(b))];
    let range = range.map(f64::from);
    let with_depth = guided(&photos, &pair.forward, Some(depth), range);
    let along_lines = guided(&photos, &pair.forward, None, range);
    for [free_right, free, right, all] in [with_depth, along_lines] {
        assert!(right * 10 > free_right * 12, "{free_right}/{free} {right}/{all}");
        assert!(
            right as f64 / all as f64 > free_right as f64 / free as f64 - 0.04,
            "{free_right}/{free} {right}/{all}"
        );
    }
    // Holes are searched along the line.
    let holes = InverseDepth::new("d", &vec![f32::NAN; 320 * 240], (320, 240), DepthKind::Inverse, None, (320, 240));
    assert_eq!(guided(&photos, &pair.forward, holes.as_ref().ok(), range), along_lines);
}

#[test]
fn a_homography_restricts_the_search_to_a_disc() {
    let speckle = speckle();
    let (h, inverse) = turn(0.2, 1.0);
    let target = found(&plain(&speckle), &DetectOptions::default());
    let reference = found(&speckle.draw(SIZE.0, SIZE.1, |x, y| through(&inverse, [x, y])), &DetectOptions::default());
    let forward = Model::homography(h);
    let guide = MatchGuide { forward: &forward, depth: None, range: [0.0, 0.0], band: 1.0, reach: 4.0 };
    let options = MatchOptions { ratio: 0.9, ..Default::default() };
    let pairs = match_guided(&target, &reference, &guide, &options, &mut ()).unwrap();
    let matches = matches_of(&target, &reference, &pairs);
    let off = |m: &Match| {
        let [x, y] = through(&h, m.target);
        (x - m.reference[0]).hypot(y - m.reference[1])
    };
    assert!(matches.iter().all(|m| off(m) <= 4.0 + 1e-9));
    assert!(matches.len() > matched(&target, &reference).len());
    // Behind the camera nothing is looked for.
    let behind = Model { h: -h, e: Vector3::zeros() };
    assert_eq!(
        match_guided(&target, &reference, &MatchGuide { forward: &behind, ..guide }, &options, &mut ()).unwrap(),
        []
    );
}

#[test]
fn bad_options_are_named() {
    let some = found(&plain(&speckle()), &DetectOptions::default());
    let matching = |options: &MatchOptions| match_features(&some, &some, options, &mut ()).map_err(|e| e.to_string());
    for bad in [0.0, 1.01, f64::NAN, -1.0] {
        assert!(matching(&MatchOptions { ratio: bad, ..Default::default() }).unwrap_err().contains("ratio"));
    }
    for bad in [0.0, 2.01, f64::NAN, -1.0] {
        let message = matching(&MatchOptions { max_distance: bad, ..Default::default() }).unwrap_err();
        assert!(message.contains("maxDistance"), "{message}");
    }
    let mut torn = some.clone();
    torn.descriptors.pop();
    assert_eq!(match_features(&some, &torn, &MatchOptions::default(), &mut ()).unwrap_err().code(), "size-mismatch");

    let model = Model::homography(Matrix3::identity());
    let guide = MatchGuide { forward: &model, depth: None, range: [0.0, 1.0], band: 1.0, reach: 1.0 };
    let huge = Features { size: (usize::MAX, usize::MAX), ..some.clone() };
    let error = match_guided(&some, &huge, &guide, &MatchOptions::default(), &mut ()).unwrap_err();
    assert_eq!(error.code(), "out-of-memory");
    let guided = |guide: &MatchGuide<'_>| match_guided(&some, &some, guide, &MatchOptions::default(), &mut ());
    assert!(guided(&guide).is_ok());
    for bad in [
        MatchGuide { band: 0.0, ..guide },
        MatchGuide { reach: f64::NAN, ..guide },
        MatchGuide { range: [0.0, f64::INFINITY], ..guide },
    ] {
        assert_eq!(guided(&bad).unwrap_err().code(), "invalid-argument");
    }
    let small = InverseDepth::constant(1.0, 3, 3).unwrap();
    assert_eq!(guided(&MatchGuide { depth: Some(&small), ..guide }).unwrap_err().code(), "size-mismatch");
}
