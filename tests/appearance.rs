//! What a person sees of a mosaic, on mosaics whose faults are known.
#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

use depthstitch::features::LineSegment;
use depthstitch::geometry::{Match, Model, homography};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::metrics::{LineBreaks, appearance, bending, broken_lines, seam_shape, visible_steps, voids};
use depthstitch::mosaic::Mosaic;
use depthstitch::warp::Warped;
use depthstitch::{Error, Image, InverseDepth, Mask, Rect, View};
use nalgebra::{Matrix3, Vector3};
use scene::Random;

/// A canvas with the reference, 300×400 pixels (its diagonal is 500), 100 pixels from the left.
const CANVAS: (usize, usize) = (400, 400);
const FRAME: Rect = Rect { x: 100, y: 0, width: 300, height: 400 };

fn mask(of: impl Fn(usize, usize) -> u8) -> Mask {
    let (width, height) = CANVAS;
    Mask::new((0..width * height).map(|i| of(i % width, i / width)).collect(), width, height).unwrap()
}

fn picture(of: impl Fn(usize, usize) -> [u8; 4]) -> Image {
    let (width, height) = CANVAS;
    Image::new((0..width * height).flat_map(|i| of(i % width, i / width)).collect(), width, height).unwrap()
}

/// A target whose footprint is the columns up to 250, valid where `shown`.
fn warped(shown: impl Fn(usize, usize) -> bool) -> Warped {
    let drawn = |x: usize| x < 250;
    Warped {
        image: picture(|x, y| [90, 90, 90, if drawn(x) && shown(x, y) { 255 } else { 0 }]),
        footprint: mask(|x, _| u8::from(drawn(x))),
        confidence: None,
        depth: None,
        offset: (FRAME.x, FRAME.y),
        clipped: false,
    }
}

#[test]
fn voids_are_shares_of_the_footprint_within_the_reference() {
    let whole = voids(&warped(|_, _| true), FRAME).unwrap();
    assert_eq!((whole.border, whole.overlap), (0.0, 0.0));
    // The band is the outermost 10 pixels and the one at distance 10: 2 % of the diagonal.
    let band = 11;
    let inner = (150 - band) * (400 - 2 * band);
    let torn = voids(&warped(|x, y| x < 100 || (x >= 100 + band && (band..400 - band).contains(&y))), FRAME).unwrap();
    assert_eq!(torn.border, 1.0);
    assert!((torn.overlap - (1.0 - inner as f64 / (150.0 * 400.0))).abs() < 1e-12);
    // A hole deep inside is none of the border's; one outside the reference is nobody's.
    let hole = voids(&warped(|x, y| !(150..170).contains(&x) || !(100..130).contains(&y)), FRAME).unwrap();
    assert_eq!(hole.border, 0.0);
    assert!((hole.overlap - 600.0 / (150.0 * 400.0)).abs() < 1e-12);
    let outside = voids(&warped(|x, _| x >= 100), FRAME).unwrap();
    assert_eq!((outside.border, outside.overlap), (0.0, 0.0));
}

#[test]
fn the_seam_is_where_labels_meet() {
    let warped = warped(|_, _| true);
    let overlap = (150.0f64 * 400.0).sqrt();
    // Straight down: a pixel of every row, four of them near the border above and below each.
    let free = seam_shape(&warped, &mask(|x, _| if x < 180 { 1 } else { 2 }), FRAME).unwrap();
    assert_eq!(free.on_border, Some(8.0 / 400.0));
    assert!((free.length - 400.0 / overlap).abs() < 1e-12, "{free:?}");
    // On the reference's left border for the upper half.
    let stuck = mask(|x, y| if x < if y < 200 { 100 } else { 180 } { 1 } else { 2 });
    let stuck = seam_shape(&warped, &stuck, FRAME).unwrap();
    // All of the upper half, and the step aside is as long as it is wide.
    let expected = (200.0 + 4.0 + 4.0) / 479.0;
    assert!((stuck.on_border.unwrap() - expected).abs() < 0.01, "{stuck:?}");
    // An island adds its outline.
    let island = |x: usize, y: usize| (200..220).contains(&x) && (100..120).contains(&y);
    let with = seam_shape(&warped, &mask(|x, y| if x < 180 || island(x, y) { 1 } else { 2 }), FRAME).unwrap();
    assert!((with.length - (400.0 + 79.0) / overlap).abs() < 1.5 / overlap, "{with:?}");
    // Where nothing meets there is no seam: void between the two.
    let none = seam_shape(&warped, &mask(|x, _| [1, 0, 2][x / 140]), FRAME).unwrap();
    assert_eq!((none.on_border, none.length), (None, 0.0));
}

/// A mosaic of noise of this amplitude on gray, the right half brighter by `step` in the rows up to `rows`.
fn stepped(noise: f64, step: f64, rows: usize) -> Image {
    let mut random = Random::new(8);
    let noise: Vec<f64> = (0..CANVAS.0 * CANVAS.1).map(|_| noise * (random.uniform() - 0.5)).collect();
    picture(|x, y| {
        let value = 120.0 + noise[y * CANVAS.0 + x] + if x >= 180 && y < rows { step } else { 0.0 };
        let value = value.round() as u8;
        [value, value, value, 255]
    })
}

#[test]
fn steps_are_seen_that_stand_out() {
    let seam = mask(|x, _| if x < 180 { 1 } else { 2 });
    let share = |image: &Image| visible_steps(image.view(), &seam).unwrap().seam.unwrap();
    assert_eq!(share(&stepped(0.0, 0.0, 400)), 0.0);
    // 12 levels of gray are some 12 in 2.55·L*.
    assert_eq!(share(&stepped(0.0, 12.0, 400)), 1.0);
    assert_eq!(share(&stepped(0.0, 12.0, 100)), 0.25);
    // Less than what is seen, and a step that texture hides.
    assert_eq!(share(&stepped(0.0, 2.0, 400)), 0.0);
    let (plain, hidden) = (share(&stepped(10.0, 12.0, 400)), share(&stepped(120.0, 12.0, 400)));
    assert!(plain > 0.9 && hidden < 0.2, "{plain} {hidden}");
}

#[test]
fn edges_of_the_scene_are_steps_elsewhere() {
    let edge = picture(|x, _| if x < 304 { [90, 90, 90, 255] } else { [120, 120, 120, 255] });
    let found = visible_steps(edge.view(), &mask(|x, _| if x < 180 { 1 } else { 2 })).unwrap();
    // Of every 16th row and column 24 places each, but those of rows that are too near the seam to be away from it.
    assert_eq!(found.seam, Some(0.0));
    assert_eq!(found.elsewhere, Some(25.0 / (25 * (24 + 24 - 6)) as f64));
}

#[test]
fn steps_are_judged_where_enough_is_valid() {
    let seam = mask(|x, _| if x < 180 { 1 } else { 2 });
    let image = stepped(0.0, 12.0, 400);
    let few = picture(|x, y| {
        if y < 20 {
            [120, 120, 120, 255]
        } else {
            let i = 4 * (y * 400 + x);
            [image.data()[i], image.data()[i], image.data()[i], 0]
        }
    });
    assert_eq!(visible_steps(few.view(), &seam).unwrap().seam, None);
    assert_eq!(visible_steps(image.view(), &mask(|_, _| 1)).unwrap().seam, None);
    // Along the border of the canvas there is nothing to compare with.
    assert_eq!(visible_steps(image.view(), &mask(|x, _| if x < 3 { 1 } else { 2 })).unwrap().seam, None);
}

fn segment(start: [f64; 2], end: [f64; 2]) -> LineSegment {
    LineSegment { start, end, width: 2.0, significance: 100.0 }
}

const SIZE: (usize, usize) = (400, 300);

/// A shift of `shift` pixels to the right, and of another pixel down per unit of depth.
fn model(shift: f64) -> Model {
    Model { h: Matrix3::new(1.0, 0.0, shift, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), e: Vector3::new(0.0, 1.0, 0.0) }
}

fn depth(of: impl Fn(f64, f64) -> f64) -> InverseDepth {
    let values: Vec<f32> = (0..SIZE.0 * SIZE.1).map(|i| of((i % SIZE.0) as f64, (i / SIZE.0) as f64) as f32).collect();
    InverseDepth::new("depth", &values, SIZE, DepthKind::Inverse, None, SIZE).unwrap()
}

#[test]
fn lines_break_where_depth_bends_them() {
    // Six lines of 60 pixels along x; the target lies 200 pixels to the left of the reference.
    let lines =
        |x: f64| (0..6).map(move |i| segment([x, 40.0 * f64::from(i) + 30.0], [x + 60.0, 40.0 * f64::from(i) + 30.0]));
    let segments: Vec<LineSegment> = lines(20.0).chain(lines(170.0)).chain(lines(300.0)).collect();
    let shift = model(-200.0);
    let count = |bend: &dyn Fn(f64) -> f64| broken_lines(&segments, SIZE, &shift, Some(&depth(|x, _| bend(x))), SIZE);
    let breaks = |lines, broken| LineBreaks { lines, broken };

    // Depth that is linear along a line leaves it straight.
    let straight = count(&|x| 0.1 * x);
    assert_eq!((straight.outside, straight.across, straight.inside), (breaks(6, 0), breaks(6, 0), breaks(6, 0)));
    assert_eq!(straight.inside.share(), Some(0.0));
    // By 3 degrees in the middle of the lines inside, by 1 in that of the others.
    let bent = |x: f64, at: f64, degrees: f64| (x - at).max(0.0) * libm::tan(degrees.to_radians());
    let broken = count(&|x| bent(x, 330.0, 3.0) + bent(x, 200.0, 1.0) + bent(x, 50.0, 1.0));
    assert_eq!((broken.outside, broken.across, broken.inside), (breaks(6, 0), breaks(6, 0), breaks(6, 6)));
    let broken = count(&|x| bent(x, 50.0, 3.0));
    assert_eq!((broken.outside.broken, broken.across.broken, broken.inside.broken), (6, 0, 0));
    // A homography breaks nothing, and needs no depth.
    let tilted = Model::homography(Matrix3::new(1.1, 0.1, -200.0, -0.05, 0.9, 4.0, 4e-4, -2e-4, 1.0));
    let kept = broken_lines(&segments, SIZE, &tilted, None, SIZE);
    assert_eq!(kept.inside.broken + kept.across.broken + kept.outside.broken, 0);
    // Short ones do not count, and few say nothing.
    let short = [segment([10.0, 10.0], [35.0, 10.0])];
    assert_eq!(broken_lines(&short, SIZE, &tilted, None, SIZE).outside, breaks(0, 0));
    assert_eq!(breaks(4, 4).share(), None);
}

#[test]
fn an_occluding_edge_belongs_to_its_better_side() {
    // A wall of constant depth above the lines, rough ground below.
    let segments: Vec<LineSegment> =
        (0..6).map(|i| segment([60.0 * f64::from(i) + 5.0, 100.0], [60.0 * f64::from(i) + 55.0, 100.0])).collect();
    let map = depth(|x, y| if y < 99.0 { 3.0 } else { 20.0 * libm::sin(x * 0.1) });
    let found = broken_lines(&segments, SIZE, &model(0.0), Some(&map), SIZE);
    assert_eq!(found.inside, LineBreaks { lines: 6, broken: 0 });
    let rough = broken_lines(&segments, SIZE, &model(0.0), Some(&depth(|x, _| 20.0 * libm::sin(x * 0.1))), SIZE);
    assert!(rough.inside.broken >= 5, "{rough:?}");
}

#[test]
fn bending_is_the_distance_from_a_homography() {
    let tilted = Matrix3::new(1.1, 0.1, -200.0, -0.05, 0.9, 4.0, 4e-4, -2e-4, 1.0);
    let flat = bending(SIZE, &Model::homography(tilted), None, SIZE).unwrap().unwrap();
    assert!(flat < 1e-6, "{flat}");
    // A ripple of 10 pixels and a period far below the photo's size: RMS 10/√2 of a diagonal of 500.
    let rippled = bending(SIZE, &model(-200.0), Some(&depth(|x, _| 10.0 * libm::sin(x))), SIZE).unwrap().unwrap();
    assert!((rippled - 100.0 * 10.0 / 2.0f64.sqrt() / 500.0).abs() < 0.05, "{rippled}");
    assert_eq!(bending(SIZE, &model(0.0), Some(&depth(|_, _| 0.0)), SIZE), Ok(None));
}

#[test]
fn the_best_homography_of_many_matches() {
    let truth = Model::homography(Matrix3::new(0.9, 0.2, 30.0, -0.1, 1.2, -9.0, 3e-4, 2e-4, 1.0));
    let mut random = Random::new(2);
    let mut noisy = |noise: f64| -> Vec<Match> {
        (0..400)
            .map(|_| {
                let [x, y] = [400.0 * random.uniform(), 300.0 * random.uniform()];
                let [u, v] = truth.project(x, y, 0.0).unwrap();
                Match { target: [x, y], reference: [u + noise * random.normal(), v + noise * random.normal()] }
            })
            .collect()
    };
    let off = |found: &Model| {
        let corners = [[0.0, 0.0], [399.0, 0.0], [0.0, 299.0], [399.0, 299.0]];
        corners
            .iter()
            .map(|&[x, y]| {
                let (a, b) = (found.project(x, y, 0.0).unwrap(), truth.project(x, y, 0.0).unwrap());
                (a[0] - b[0]).abs().max((a[1] - b[1]).abs())
            })
            .fold(0.0, f64::max)
    };
    assert!(off(&homography(&noisy(0.0)).unwrap()) < 1e-6);
    let found = homography(&noisy(1.0)).unwrap();
    assert!(off(&found) < 1.0, "{}", off(&found));
    let line: Vec<Match> =
        (0..9).map(|i| Match { target: [f64::from(i), 0.0], reference: [f64::from(i), 0.0] }).collect();
    assert_eq!(homography(&line), None);
    assert_eq!(homography(&[]), None);
}

#[test]
fn all_measures_of_one_mosaic() {
    // Stripes that the target shows 100 pixels farther left, with the seam in the middle of the overlap.
    let stripes =
        |x: usize, y: usize| if (x / 37 + y / 53).is_multiple_of(2) { [200, 190, 180, 255] } else { [60, 70, 80, 255] };
    let crop = |left: usize, width: usize| {
        let all = picture(stripes);
        let data = all.data().chunks(4 * 400).flat_map(|row| row[4 * left..4 * (left + width)].to_vec()).collect();
        Image::new(data, width, 400).unwrap()
    };
    let (target, reference) = (crop(0, 250), crop(100, 300));
    let warped = Warped { image: picture(|x, y| if x < 250 { stripes(x, y) } else { [0; 4] }), ..warped(|_, _| true) };
    let mosaic = Mosaic {
        image: picture(stripes),
        voids: mask(|_, _| 0),
        seam: mask(|x, _| if x < 180 { 1 } else { 2 }),
        gains: [1.0; 3],
    };
    let model = Model::homography(Matrix3::new(1.0, 0.0, -100.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
    let view = View { image: target.view(), depth: None };
    let seen = appearance(view, reference.view(), &model, &warped, &mosaic).unwrap();
    assert_eq!((seen.voids.border, seen.voids.overlap), (0.0, 0.0));
    assert_eq!(seen.seam.on_border, Some(8.0 / 400.0));
    assert_eq!(seen.visible_steps.seam, Some(0.0));
    assert!(seen.visible_steps.elsewhere.unwrap() > 0.0);
    assert!(seen.broken_lines.inside.lines > 10, "{seen:?}");
    assert_eq!(seen.broken_lines.inside.broken, 0);
    assert!(seen.bending.unwrap() < 1e-6);

    let small = Mosaic { seam: Mask::new(vec![0; 4], 2, 2).unwrap(), ..mosaic.clone() };
    let error = appearance(view, reference.view(), &model, &warped, &small).unwrap_err();
    assert!(matches!(*error, Error::WrongSize { name: "seam", .. }), "{error}");
    let parallax = Model { e: Vector3::new(1.0, 0.0, 0.0), ..model };
    let error = appearance(view, reference.view(), &parallax, &warped, &mosaic).unwrap_err();
    assert_eq!(error.to_string(), "targetDepth is missing: the model has parallax");
    let endless = Model { e: Vector3::new(0.0, f64::INFINITY, 0.0), ..model };
    let error = appearance(view, reference.view(), &endless, &warped, &mosaic).unwrap_err();
    assert!(matches!(*error, Error::InvalidArgument { name: "model", value: f64::INFINITY, .. }), "{error}");
}

#[test]
fn sizes_that_do_not_fit_are_refused() {
    let whole = warped(|_, _| true);
    let code = |error: Box<Error>| error.code();
    let small = Mask::new(vec![1; 4], 2, 2).unwrap();
    let torn = Warped { footprint: small.clone(), ..whole.clone() };
    let beyond = Rect { x: 101, ..FRAME };
    let far = Rect { y: usize::MAX, ..FRAME };
    for (warped, frame) in [(&torn, FRAME), (&whole, beyond), (&whole, far)] {
        assert_eq!(voids(warped, frame).map_err(code), Err("size-mismatch"));
        assert_eq!(seam_shape(warped, &mask(|_, _| 1), frame).map_err(code), Err("size-mismatch"));
    }
    assert_eq!(seam_shape(&whole, &small, FRAME).map_err(code), Err("size-mismatch"));
    assert_eq!(visible_steps(whole.image.view(), &small).map_err(code), Err("size-mismatch"));
    let flat = depth(|_, _| 0.0);
    assert_eq!(bending((300, 400), &model(0.0), Some(&flat), SIZE).map_err(code), Err("size-mismatch"));
}
