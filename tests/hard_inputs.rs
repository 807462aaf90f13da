//! Inputs that cannot or can hardly be stitched: each comes out as the right error or with the right warning, none as a panic.
#![allow(clippy::unwrap_used)]

use depthstitch::geometry::{EstimateOptions, Match, Model, ModelKind};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::pipeline::{Options, Stitched, stitch};
use depthstitch::{Image, InverseDepth};
use scene::{MatchOptions, Photos, Random, Scene};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (120, 80);
const MATCHES: MatchOptions = MatchOptions { count: 200, sigma: 0.3, outliers: 0.1, seed: 1 };

/// What has to come out.
#[derive(Debug, Clone, Copy)]
enum Expected {
    /// An error with one of these codes.
    Refused(&'static [&'static str]),
    /// A mosaic, a model of this kind, and this warning among the others.
    Warned(ModelKind, &'static str),
    /// A mosaic, a model of this kind, and no warning.
    Fine(ModelKind),
    /// Refused for its geometry, or a mosaic with a warning: chance decides. But no mosaic without one.
    RefusedOrWarned,
}
use Expected::{Fine, Refused, RefusedOrWarned, Warned};
use ModelKind::{Depth, Homography};

struct Row {
    name: &'static str,
    photos: Photos,
    options: Options,
    expected: Expected,
}

/// The published method, with our threshold and choice of models: what there is to fit shows best without more.
fn published() -> Options {
    Options { estimate: EstimateOptions::default(), ..Options::paper() }
}

fn row(name: &'static str, photos: Photos, expected: Expected) -> Row {
    Row { name, photos, options: published(), expected }
}

fn check(rows: Vec<Row>) {
    let wrong: Vec<String> = rows.iter().filter_map(problem).collect();
    rows.iter().for_each(survived);
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

fn problem(row: &Row) -> Option<String> {
    let Photos { matches, .. } = &row.photos;
    let result = stitch(Some(matches), row.photos.target(), row.photos.reference(), &row.options, &mut ());
    if let Ok(found) = &result {
        let canvas = found.mosaic.image.width() * found.mosaic.image.height();
        assert_eq!(found.mosaic.image.data().len(), 4 * canvas, "{}", row.name);
        assert_eq!(found.geometry.inliers.len(), matches.len(), "{}", row.name);
        assert!(found.geometry.forward.is_finite() && found.geometry.reverse.is_finite(), "{}", row.name);
    }
    let right = match (&result, row.expected) {
        (Err(error), Refused(codes)) => codes.contains(&error.code()),
        (Ok(found), Warned(kind, code)) => free(found) == kind && codes(found).contains(&code),
        (Ok(found), Fine(kind)) => free(found) == kind && codes(found).is_empty(),
        (Err(error), RefusedOrWarned) => ["no-consensus", "degenerate-geometry"].contains(&error.code()),
        (Ok(found), RefusedOrWarned) => !codes(found).is_empty(),
        _ => false,
    };
    let got = match &result {
        Ok(found) => format!("{:?}, warnings {:?}", found.geometry.kind, codes(found)),
        Err(error) => format!("{}: {error}", error.code()),
    };
    println!("{}: {got}", row.name);
    (!right).then(|| format!("{}: expected {:?}, got {got}", row.name, row.expected))
}

/// Our own way, with and without the matches, may do better than what is expected of the published one, but never panics
/// and never returns a model that is none.
fn survived(row: &Row) {
    let Photos { matches, .. } = &row.photos;
    for matches in [Some(&matches[..]), None] {
        let (target, reference) = (row.photos.target(), row.photos.reference());
        match stitch(matches, target, reference, &Options::default(), &mut ()) {
            Ok(found) => {
                let Model { h, e } = found.geometry.forward;
                assert!(h.iter().chain(e.iter()).all(|v| v.is_finite()), "{}", row.name);
                assert!(found.quality.coverage > 0.0, "{}", row.name);
            }
            Err(error) => println!("{}: {}", row.name, error.code()),
        }
    }
}

/// The kind of model, calibrated or not.
fn free(found: &Stitched) -> ModelKind {
    match found.geometry.kind {
        ModelKind::Calibrated => Depth,
        kind => kind,
    }
}

fn codes(found: &Stitched) -> Vec<&'static str> {
    found.warnings.iter().map(|warning| warning.code()).collect()
}

fn photos(scene: &Scene) -> Photos {
    Photos::of(&scene.render(SIZE.0, SIZE.1), &MATCHES)
}

fn gallery() -> Photos {
    photos(&scene::gallery())
}

fn with(photos: &Photos, matches: Vec<Match>) -> Photos {
    Photos { matches, ..photos.clone() }
}

/// Matches from the index, as many as wanted.
fn made(count: usize, place: impl FnMut(usize) -> [f64; 4]) -> Vec<Match> {
    (0..count).map(place).map(|[a, b, c, d]| Match { target: [a, b], reference: [c, d] }).collect()
}

fn anywhere(count: usize, seed: u64) -> Vec<Match> {
    let mut random = Random::new(seed);
    made(count, |_| [SIZE.0, SIZE.1, SIZE.0, SIZE.1].map(|side| random.uniform() * (side as f64 - 1.0)))
}

/// A depth map of the gallery's target with some values replaced.
fn depth(photos: &Photos, value: impl Fn(usize, usize, f32) -> f32) -> Option<InverseDepth> {
    let data = photos.target_depth.as_ref().unwrap().data();
    let raw: Vec<f32> = data.iter().enumerate().map(|(i, d)| value(i % SIZE.0, i / SIZE.0, *d)).collect();
    InverseDepth::new("depth", &raw, SIZE, DepthKind::Inverse, None, SIZE).ok()
}

#[test]
fn scenes_without_what_a_depth_model_needs() {
    let gallery = gallery();
    let other = photos(&scene::plane());
    let mixed = Photos { reference: other.reference, reference_depth: other.reference_depth, ..gallery.clone() };
    let faint = scene::textureless();
    let five = MatchOptions { count: 5, sigma: 0.0, outliers: 0.0, seed: 1 };
    let few = |scene: &Scene| Photos::of(&scene.render(SIZE.0, SIZE.1), &five);
    check(vec![
        row("everything as it should be", gallery.clone(), Fine(Depth)),
        row("two scenes, 200 matches at random", with(&mixed, anywhere(200, 1)), Refused(&["no-consensus"])),
        row("two scenes, 12 matches at random", with(&mixed, anywhere(12, 2)), Refused(&["no-consensus"])),
        row("two scenes, 1000 matches at random", with(&mixed, anywhere(1000, 3)), Refused(&["no-consensus"])),
        row("a flat scene", photos(&scene::plane()), Warned(Homography, "parallax-unobservable")),
        row("a camera that only turns", photos(&scene::rotation()), Warned(Homography, "parallax-unobservable")),
        row("no texture, no matches", with(&photos(&faint), vec![]), Refused(&["too-few-matches"])),
        row("no texture, 5 matches", few(&faint), Warned(Homography, "few-inliers")),
        row("a flat scene, 5 matches", few(&scene::plane()), Warned(Homography, "few-inliers")),
        row("no texture, 40 matches at random", with(&photos(&faint), anywhere(40, 4)), RefusedOrWarned),
    ]);
}

#[test]
fn matches_that_determine_nothing() {
    let base = gallery();
    let exact =
        Photos::of(&scene::gallery().survey(SIZE.0, SIZE.1), &MatchOptions { sigma: 0.0, outliers: 0.0, ..MATCHES });
    let first = |count: usize| exact.matches.iter().take(count).copied().collect::<Vec<_>>();
    let line = |i: usize| [10.0 + i as f64, 20.0 + 0.5 * i as f64, 15.0 + i as f64, 18.0 + 0.5 * i as f64];
    let row = |name, matches, expected| row(name, with(&base, matches), expected);
    check(vec![
        row("no match", vec![], Refused(&["too-few-matches"])),
        row("3 matches", first(3), Refused(&["too-few-matches"])),
        // Too few for a depth model, and no homography explains all of them.
        row("5 matches", first(5), Refused(&["no-consensus"])),
        row("6 matches", first(6), Warned(Depth, "few-inliers")),
        row("one match, 200 times", made(200, |_| [30.0, 30.0, 20.0, 30.0]), Refused(&["too-few-matches"])),
        row(
            "all in one target pixel",
            made(50, |i| [30.0 + 0.001 * i as f64, 30.0, 20.0 + i as f64, 2.0 * (i % 30) as f64]),
            Refused(&["degenerate-geometry"]),
        ),
        row(
            "all in one reference pixel",
            made(50, |i| [20.0 + i as f64, 2.0 * (i % 30) as f64, 30.0, 30.0 + 0.001 * i as f64]),
            Refused(&["degenerate-geometry"]),
        ),
        row("all on one line", made(60, line), Refused(&["degenerate-geometry"])),
        row("all on one row", made(60, |i| [i as f64, 40.0, i as f64, 40.0]), Refused(&["degenerate-geometry"])),
        // The last match fixes a map that nothing confirms: it must not pass for a good one.
        row(
            "all on one line but one",
            made(61, |i| if i == 60 { [60.0, 60.0, 65.0, 58.0] } else { line(i) }),
            RefusedOrWarned,
        ),
        row(
            "all out of frame",
            made(50, |i| [-10.0 - i as f64, 5.0, 300.0, (i * i) as f64]),
            Refused(&["too-few-matches"]),
        ),
        row(
            "one end out of frame",
            made(50, |i| [i as f64, (i * 7 % 60) as f64, 1e9, -1e9]),
            Refused(&["too-few-matches"]),
        ),
        row("all NaN", made(50, |_| [f64::NAN; 4]), Refused(&["too-few-matches"])),
        row(
            "all infinite",
            made(50, |i| [if i % 2 == 0 { f64::INFINITY } else { f64::NEG_INFINITY }; 4]),
            Refused(&["too-few-matches"]),
        ),
    ]);
}

#[test]
fn wrong_numbers_among_good_matches_are_dropped() {
    let good = gallery();
    let clean = stitch(Some(&good.matches), good.target(), good.reference(), &Options::default(), &mut ()).unwrap();
    let wrong = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -1.0, 1e6];
    let mut matches = Vec::new();
    for (i, m) in good.matches.iter().enumerate() {
        let mut broken = *m;
        let side = if i % 2 == 0 { &mut broken.target } else { &mut broken.reference };
        side[i / 2 % 2] = wrong[i % wrong.len()];
        matches.extend([broken, *m]);
    }
    let found = stitch(Some(&matches), good.target(), good.reference(), &Options::default(), &mut ()).unwrap();
    assert_eq!(found.geometry.forward, clean.geometry.forward);
    assert_eq!(found.mosaic, clean.mosaic);
    let (broken, kept): (Vec<_>, Vec<_>) = found.geometry.inliers.as_chunks().0.iter().map(|[a, b]| (*a, *b)).unzip();
    assert!(broken.iter().all(|inlier| !inlier));
    assert_eq!(kept, clean.geometry.inliers);
}

#[test]
fn depth_maps_that_say_little_or_nothing() {
    let base = gallery();
    let target =
        |value: &dyn Fn(usize, usize, f32) -> f32| Photos { target_depth: depth(&base, value), ..base.clone() };
    let both = |value: &dyn Fn(usize, usize, f32) -> f32| {
        let reference_depth = base.reference_depth.as_ref().map(|d| {
            let raw: Vec<f32> = d.data().iter().enumerate().map(|(i, v)| value(i % SIZE.0, i / SIZE.0, *v)).collect();
            InverseDepth::new("depth", &raw, SIZE, DepthKind::Inverse, None, SIZE).unwrap()
        });
        Photos { reference_depth, ..target(value) }
    };
    let half = InverseDepth::new(
        "depth",
        base.target_depth.as_ref().unwrap().data(),
        SIZE,
        DepthKind::Inverse,
        None,
        (60, 40),
    );
    check(vec![
        row("target depth constant", target(&|_, _, _| 1.0), Warned(Homography, "depth-inconsistent")),
        row("both depths constant", both(&|_, _, _| 1.0), Warned(Homography, "depth-inconsistent")),
        row("both depths zero", both(&|_, _, _| 0.0), Warned(Homography, "depth-inconsistent")),
        row("target depth all holes", target(&|_, _, _| f32::NAN), Warned(Homography, "depth-unusable")),
        row("both depths all holes", both(&|_, _, _| f32::INFINITY), Warned(Homography, "depth-unusable")),
        row(
            "every second row a hole",
            both(&|_, y, d| if y % 2 == 0 { f32::NAN } else { d }),
            Warned(Homography, "depth-unusable"),
        ),
        row("left half holes", target(&|x, _, d| if x < 60 { f32::NAN } else { d }), Fine(Depth)),
        row("huge depths", both(&|_, _, d| d * 1e35), Fine(Depth)),
        row("tiny depths", both(&|_, _, d| d * 1e-35), Fine(Depth)),
        row(
            "one depth value infinite, one huge",
            target(&|x, y, d| match (x, y) {
                (50, 40) => f32::MAX,
                (70, 40) => f32::MIN,
                _ => d,
            }),
            // One of them lies beyond every canvas.
            Warned(Depth, "canvas-clipped"),
        ),
        row(
            "depth of another size than its photo",
            Photos { target_depth: half.ok(), ..base.clone() },
            Refused(&["size-mismatch"]),
        ),
        row("no target depth", Photos { target_depth: None, ..base.clone() }, Warned(Homography, "no-depth")),
        row("no reference depth", Photos { reference_depth: None, ..base.clone() }, Warned(Homography, "no-depth")),
        row(
            "no depth",
            Photos { target_depth: None, reference_depth: None, ..base.clone() },
            Warned(Homography, "no-depth"),
        ),
    ]);
}

#[test]
fn photos_of_odd_sizes() {
    let base = gallery();
    let cut = |image: &Image, width: usize, height: usize| {
        let rows = image.data().chunks_exact(4 * image.width()).take(height);
        Image::new(rows.flat_map(|row| row[..4 * width].to_vec()).collect(), width, height).unwrap()
    };
    let flat = |target: Image, reference: Image, matches: Vec<Match>| Photos {
        target,
        reference,
        target_depth: None,
        reference_depth: None,
        matches,
    };
    let shift = || {
        made(60, |i| {
            [
                5.0 + (i * 7 % 50) as f64,
                5.0 + (i * 11 % 40) as f64,
                2.0 + (i * 7 % 50) as f64,
                5.0 + (i * 11 % 40) as f64,
            ]
        })
    };
    let dot = cut(&base.target, 1, 1);
    let narrow = cut(&base.target, 1, 80);
    check(vec![
        row(
            "a smaller target",
            flat(cut(&base.target, 70, 50), base.reference.clone(), shift()),
            Warned(Homography, "no-depth"),
        ),
        row(
            "a smaller reference",
            flat(base.target.clone(), cut(&base.reference, 70, 50), shift()),
            Warned(Homography, "no-depth"),
        ),
        row(
            "1×1 and 1×1",
            flat(
                dot.clone(),
                dot.clone(),
                made(9, |i| {
                    [
                        (i % 3) as f64 * 0.3 - 0.3,
                        (i / 3) as f64 * 0.3 - 0.3,
                        (i % 3) as f64 * 0.3 - 0.3,
                        (i / 3) as f64 * 0.3 - 0.3,
                    ]
                }),
            ),
            Refused(&["degenerate-geometry"]),
        ),
        row(
            "1×1 onto a photo",
            flat(dot.clone(), base.reference.clone(), base.matches.clone()),
            Refused(&["too-few-matches", "degenerate-geometry"]),
        ),
        row(
            "a photo onto 1×1",
            flat(base.target.clone(), dot, base.matches.clone()),
            Refused(&["too-few-matches", "degenerate-geometry"]),
        ),
        row(
            "one column",
            flat(narrow.clone(), narrow, made(60, |i| [0.0, i as f64, 0.0, i as f64])),
            Refused(&["degenerate-geometry"]),
        ),
    ]);
}
