//! Refined inverse depth against the truth of rendered scenes: nearer to it where both photos show the same, no
//! farther from it elsewhere.
#![allow(clippy::unwrap_used, clippy::expect_used)]

mod fingerprint;

use depthstitch::View;
use depthstitch::depth::{RefineOptions, Refined, refine};
use depthstitch::error::Stage;
use depthstitch::geometry::Model;
use depthstitch::inverse_depth::DepthKind;
use depthstitch::observer::Observer;
use depthstitch::{Error, Image, InverseDepth};
use fingerprint::fingerprint;
use scene::{Pair, Photos, Scene, distance};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (240, 160);
const EXACT: scene::MatchOptions = scene::MatchOptions { count: 10, sigma: 0.0, outliers: 0.0, seed: 1 };

fn map(values: &[f32]) -> InverseDepth {
    InverseDepth::new("depth", values, SIZE, DepthKind::Inverse, None, SIZE).unwrap()
}

/// Pixels of motion per inverse depth.
fn slope(model: &Model, x: f64, y: f64, d: f64) -> f64 {
    let step = 1e-6 * d;
    let (a, b) = (model.project(x, y, d).unwrap(), model.project(x, y, d + step).unwrap());
    distance(a, b) / step
}

/// The true map, off by up to `pixels` of motion: smooth bumps with a tilt, as networks have them.
fn biased(truth: &InverseDepth, model: &Model, pixels: f64) -> InverseDepth {
    let off = |(i, &d): (usize, &f32)| {
        let (x, y) = ((i % SIZE.0) as f64, (i / SIZE.0) as f64);
        let wave = 0.6 + 0.4 * libm::sin(x / 40.0) * libm::cos(y / 30.0 + 1.0);
        (f64::from(d) + pixels * wave / slope(model, x, y, f64::from(d))) as f32
    };
    map(&truth.data().iter().enumerate().map(off).collect::<Vec<_>>())
}

/// Errors of a map in pixels of the other photo: of pixels that the other photo shows, and of those beyond its frame.
fn errors(depth: &InverseDepth, truth: &InverseDepth, model: &Model, visible: &[bool]) -> [Vec<f64>; 2] {
    let mut errors = [Vec::new(), Vec::new()];
    for (i, (&d, &true_d)) in depth.data().iter().zip(truth.data()).enumerate() {
        let (x, y) = ((i % SIZE.0) as f64, (i / SIZE.0) as f64);
        let place = model.project(x, y, f64::from(true_d)).unwrap();
        let error = distance(model.project(x, y, f64::from(d)).unwrap(), place);
        let framed = (0.0..SIZE.0 as f64).contains(&place[0]) && (0.0..SIZE.1 as f64).contains(&place[1]);
        if visible[i] {
            errors[0].push(error);
        } else if !framed {
            errors[1].push(error);
        }
    }
    errors.iter_mut().for_each(|errors| errors.sort_by(f64::total_cmp));
    errors
}

fn percentile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

struct Case {
    photos: Photos,
    forward: Model,
    reverse: Model,
    visible: [Vec<bool>; 2],
}

impl Case {
    fn of(scene: &Scene) -> Self {
        let pair: Pair<'_> = scene.render(SIZE.0, SIZE.1);
        Self {
            photos: Photos::of(&pair, &EXACT),
            forward: pair.forward,
            reverse: pair.reverse,
            visible: [pair.visible_in_reference(), pair.visible_in_target()],
        }
    }

    fn truth(&self) -> [&InverseDepth; 2] {
        [self.photos.target_depth.as_ref().unwrap(), self.photos.reference_depth.as_ref().unwrap()]
    }

    fn priors(&self, pixels: f64) -> [InverseDepth; 2] {
        let [target, reference] = self.truth();
        [biased(target, &self.forward, pixels), biased(reference, &self.reverse, pixels)]
    }

    fn refined(&self, [target, reference]: &[InverseDepth; 2], deviation: f64) -> Refined {
        refine(
            View { image: self.photos.target.view(), depth: Some(target) },
            View { image: self.photos.reference.view(), depth: Some(reference) },
            &self.forward,
            &self.reverse,
            [deviation; 2],
            &RefineOptions::default(),
            &mut (),
        )
        .unwrap()
    }

    /// Errors of both maps, inside and outside.
    fn errors(&self, target: &InverseDepth, reference: &InverseDepth) -> [[Vec<f64>; 2]; 2] {
        let [true_target, true_reference] = self.truth();
        [
            errors(target, true_target, &self.forward, &self.visible[0]),
            errors(reference, true_reference, &self.reverse, &self.visible[1]),
        ]
    }

    fn check(&self, prior: &[InverseDepth; 2], refined: &Refined) {
        let before = self.errors(&prior[0], &prior[1]);
        let after = self.errors(&refined.target, &refined.reference);
        for (side, (before, after)) in before.iter().zip(&after).enumerate() {
            let median = |v: &[f64]| percentile(v, 0.5);
            println!(
                "inside {:.2} -> {:.2}, outside {:.2} -> {:.2}, p90 {:.2} -> {:.2}",
                median(&before[0]),
                median(&after[0]),
                median(&before[1]),
                median(&after[1]),
                percentile(&before[1], 0.9),
                percentile(&after[1], 0.9)
            );
            assert!(median(&before[0]) > 2.0 && median(&after[0]) < 0.3);
            assert!(median(&after[1]) <= median(&before[1]));
            assert!(percentile(&after[1], 0.9) <= percentile(&before[1], 0.9) + 0.3);
            // Nothing is reliable beyond the other photo, and most of what both show is.
            let (mut right, mut wrong) = (0, 0);
            for (&reliable, &visible) in refined.reliable[side].data().iter().zip(&self.visible[side]) {
                right += usize::from(reliable != 0 && visible);
                wrong += usize::from(reliable != 0 && !visible);
            }
            assert!(10 * right > 7 * after[0].len() && 20 * wrong < right, "{right} rightly, {wrong} wrongly");
        }
    }
}

#[test]
fn smooth_error_is_found_inside_and_does_not_grow_outside() {
    let case = Case::of(&scene::gallery());
    let priors = case.priors(5.0);
    case.check(&priors, &case.refined(&priors, 2.0));
}

#[test]
fn gray_values_tell_the_last_fraction_of_a_pixel() {
    let case = Case::of(&scene::gallery());
    let refined = case.refined(&case.priors(5.0), 2.0);
    for errors in case.errors(&refined.target, &refined.reference) {
        assert!(percentile(&errors[0], 0.5) < 0.18, "{}", percentile(&errors[0], 0.5));
    }
}

#[test]
fn exposure_does_not_matter() {
    let mut case = Case::of(&scene::gallery());
    for (i, byte) in case.photos.reference.data_mut().iter_mut().enumerate().filter(|(i, _)| i % 4 != 3) {
        *byte = (f32::from(*byte) * 0.7 + 20.0 + (i % 4) as f32) as u8;
    }
    let priors = case.priors(5.0);
    case.check(&priors, &case.refined(&priors, 2.0));
}

#[test]
fn exact_maps_stay_exact() {
    let case = Case::of(&scene::gallery());
    let truth = case.truth().map(Clone::clone);
    let refined = case.refined(&truth, 0.5);
    for errors in case.errors(&refined.target, &refined.reference) {
        assert!(percentile(&errors[0], 0.5) < 0.05, "{}", percentile(&errors[0], 0.5));
        assert!(percentile(&errors[0], 0.9) < 0.5, "{}", percentile(&errors[0], 0.9));
        assert!(percentile(&errors[1], 0.9) < 0.5, "{}", percentile(&errors[1], 0.9));
    }
}

#[test]
fn where_nothing_can_be_seen_the_prior_stays() {
    let case = Case::of(&scene::textureless());
    let truth = case.truth().map(Clone::clone);
    let refined = case.refined(&truth, 1.0);
    for errors in case.errors(&refined.target, &refined.reference) {
        assert!(percentile(&errors[0], 0.5) < 0.3, "{}", percentile(&errors[0], 0.5));
    }
}

#[test]
fn holes_are_filled() {
    let case = Case::of(&scene::gallery());
    let [mut target, reference] = case.priors(2.0);
    let holed: Vec<f32> = target
        .data()
        .iter()
        .enumerate()
        .map(|(i, &d)| if (i % SIZE.0 / 8).is_multiple_of(4) { f32::NAN } else { d })
        .collect();
    target = map(&holed);
    let refined = case.refined(&[target, reference], 2.0);
    assert!(refined.target.data().iter().chain(refined.reference.data()).all(|d| d.is_finite()));
    let [inside, _] = &case.errors(&refined.target, &refined.reference)[0];
    assert!(percentile(inside, 0.5) < 0.3, "{}", percentile(inside, 0.5));
}

#[test]
fn without_parallax_the_priors_come_back() {
    let mut case = Case::of(&scene::rotation());
    let truth = case.truth().map(Clone::clone);
    let refined = case.refined(&truth, 1.0);
    assert_eq!([&refined.target, &refined.reference], case.truth());
    assert_eq!(refined.reliable.map(|mask| mask.count()), [0, 0]);
    // Nor does depth have a say when it moves nothing by a pixel.
    let tiny = 0.5 / slope(&Model { e: nalgebra::Vector3::new(1.0, 0.0, 0.0), ..case.forward }, 9.0, 9.0, 0.1);
    case.forward.e.x = tiny;
    case.reverse.e.x = -tiny;
    let refined = case.refined(&truth, 1.0);
    assert_eq!([&refined.target, &refined.reference], case.truth());
    // Without depth maps there is nothing to refine.
    let flat = Model::homography(case.forward.h);
    let view = |image: &'static Image| View { image: image.view(), depth: None };
    let image: &'static Image = Box::leak(Box::new(case.photos.target));
    let refined = refine(view(image), view(image), &flat, &flat, [1.0; 2], &RefineOptions::default(), &mut ()).unwrap();
    assert!(refined.target.data().iter().all(|&d| d == 0.0));
}

#[test]
fn any_size_will_do() {
    for (w, h) in [(1, 1), (1, 40), (40, 1), (3, 2), (17, 70), (130, 33)] {
        let data: Vec<u8> = (0..4 * w * h).map(|i| ((i % 251) * (i % 251) * 31 % 251) as u8).collect();
        let image = Image::new(data, w, h).unwrap();
        let values: Vec<f32> = (0..w * h).map(|i| 0.1 + (i % 7) as f32 * 0.1).collect();
        let depth = InverseDepth::new("depth", &values, (w, h), DepthKind::Inverse, None, (w, h)).unwrap();
        let view = View { image: image.view(), depth: Some(&depth) };
        for e in [[30.0, 2.0, 0.1], [1e6, -1e6, 1e3], [1e-30, 0.0, 0.0]] {
            let model = Model { h: nalgebra::Matrix3::identity(), e: nalgebra::Vector3::from(e) };
            let options = RefineOptions { range: Some(100.0) };
            let refined = refine(view, view, &model, &model, [0.0; 2], &options, &mut ()).unwrap();
            assert!(refined.target.data().iter().all(|d| d.is_finite()), "{w}×{h}, {e:?}");
        }
    }
}

#[test]
fn bad_input_is_refused() {
    let case = Case::of(&scene::gallery());
    let [target, reference] = case.priors(1.0);
    let call = |range: Option<f64>, forward: &Model, depth: Option<&InverseDepth>, observer: &mut dyn Observer| {
        refine(
            View { image: case.photos.target.view(), depth },
            View { image: case.photos.reference.view(), depth: Some(&reference) },
            forward,
            &case.reverse,
            [1.0; 2],
            &RefineOptions { range },
            observer,
        )
        .map(|_| ())
        .map_err(|error| error.code())
    };
    for range in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(call(Some(range), &case.forward, Some(&target), &mut ()), Err("invalid-argument"), "{range}");
    }
    assert_eq!(call(None, &case.forward, None, &mut ()), Err("invalid-argument"));
    let broken = Model { h: case.forward.h * f64::NAN, ..case.forward };
    assert_eq!(call(None, &broken, Some(&target), &mut ()), Err("invalid-argument"));
    let other = InverseDepth::constant(0.1, 4, 4).unwrap();
    assert_eq!(call(None, &case.forward, Some(&other), &mut ()), Err("size-mismatch"));

    struct Impatient(f32);
    impl Observer for Impatient {
        fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
            assert!(stage == Stage::Refine && fraction >= self.0 && fraction <= 1.0);
            self.0 = fraction;
            fraction < 0.4
        }
    }
    assert_eq!(call(None, &case.forward, Some(&target), &mut Impatient(0.0)), Err(Error::Aborted.code()));
}

/// The constant is what the native build gave: wasm has to give the same.
#[test]
fn bytes_are_the_same_on_every_platform() {
    let case = Case::of(&scene::gallery());
    let refined = case.refined(&case.priors(5.0), 2.0);
    let bytes = refined.target.data().iter().chain(refined.reference.data()).flat_map(|d| d.to_le_bytes());
    let hash = fingerprint(bytes.map(u64::from));
    assert_eq!(hash, 0xfb70_7454_e5d2_7fab, "{hash:#018x}");
}
