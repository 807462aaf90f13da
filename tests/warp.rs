//! The warp through its public function: exact geometry in, known pixels out.

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

use depthstitch::View;
use depthstitch::depth::Holes;
use depthstitch::geometry::Model;
use depthstitch::inverse_depth::DepthKind;
use depthstitch::warp::{RELIABLE, WarpMode, WarpOptions, Warped, warp};
use depthstitch::{Error, Image, InverseDepth};
use nalgebra::{Matrix3, Vector3};

/// Every pixel has a colour of its own.
fn picture(width: usize, height: usize) -> Image {
    let mut image = Image::transparent(width, height).unwrap();
    for (i, pixel) in image.data_mut().chunks_exact_mut(4).enumerate() {
        let (x, y) = (i % width, i / width);
        pixel.copy_from_slice(&[(7 * x % 256) as u8, (5 * y % 256) as u8, ((x * 3 + y * 11) % 256) as u8, 255]);
    }
    image
}

fn shift(x: f64, y: f64) -> Model {
    Model::homography(Matrix3::new(1.0, 0.0, x, 0.0, 1.0, y, 0.0, 0.0, 1.0))
}

fn flat(image: &Image) -> View<'_> {
    View { image: image.view(), depth: None }
}

fn run(target: &Image, reference: &Image, forward: &Model, reverse: &Model, options: &WarpOptions) -> Warped {
    warp(flat(target), flat(reference), forward, reverse, options, &mut ()).unwrap()
}

const ALL_MODES: [WarpMode; 5] =
    [WarpMode::Forward, WarpMode::Backward, WarpMode::BackwardVoid, WarpMode::Optimal, WarpMode::Soft];

#[test]
fn the_identity_draws_every_pixel_once_and_unchanged() {
    let image = picture(37, 23);
    for mode in ALL_MODES {
        let options = WarpOptions { mode, ..Default::default() };
        let warped = run(&image, &image, &shift(0.0, 0.0), &shift(0.0, 0.0), &options);
        assert_eq!(warped.offset, (0, 0));
        assert_eq!(warped.image, image, "{mode:?}");
        assert_eq!(warped.footprint.count(), 37 * 23);
        assert!(!warped.clipped);
    }
}

#[test]
fn a_coarse_grid_gives_the_same_identity() {
    let image = picture(40, 30);
    for grid in [(1, 1), (7, 5), (13, 1), (1000, 1000)] {
        let options = WarpOptions { grid, ..Default::default() };
        let warped = run(&image, &image, &shift(0.0, 0.0), &shift(0.0, 0.0), &options);
        let worst = warped.image.data().iter().zip(image.data()).map(|(a, b)| a.abs_diff(*b)).max();
        assert_eq!(worst, Some(0), "{grid:?}");
    }
}

#[test]
fn a_whole_shift_moves_pixels_and_extends_the_canvas() {
    let image = picture(30, 20);
    let warped = run(&image, &image, &shift(-8.0, 5.0), &shift(8.0, -5.0), &WarpOptions::default());
    assert_eq!(warped.offset, (8, 0));
    assert_eq!(warped.image.size(), (38, 25));
    for y in 0..25 {
        for x in 0..38 {
            let got = warped.image.view().pixel(x, y);
            if x < 30 && y >= 5 {
                assert_eq!(got, image.view().pixel(x, y - 5));
            } else {
                assert_eq!(got, [0; 4], "({x}, {y})");
            }
        }
    }
}

#[test]
fn half_a_pixel_averages_neighbours() {
    let mut image = Image::transparent(4, 2).unwrap();
    image
        .data_mut()
        .chunks_exact_mut(4)
        .enumerate()
        .for_each(|(i, p)| p.copy_from_slice(&[(i % 4 * 60) as u8, 0, 0, 255]));
    let warped = run(&image, &image, &shift(0.5, 0.0), &shift(-0.5, 0.0), &WarpOptions::default());
    let row: Vec<u8> = (0..4).map(|x| warped.image.view().pixel(x, 0)[0]).collect();
    assert_eq!(row, [0, 30, 90, 150]);
    assert_eq!(warped.image.view().pixel(0, 0)[3], 0, "half a pixel of the border is unknown");
}

#[test]
fn a_mirrored_target_is_the_back_of_a_fold_and_not_drawn() {
    let image = picture(20, 20);
    let mirror = Model::homography(Matrix3::new(-1.0, 0.0, 19.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
    for mode in [WarpMode::Backward, WarpMode::Optimal] {
        let warped = run(&image, &image, &mirror, &mirror, &WarpOptions { mode, ..Default::default() });
        assert_eq!(warped.footprint.count(), 0);
    }
}

#[test]
fn rotated_cells_meet_without_gap() {
    // 30° about the centre: every canvas pixel well inside the rotated square must be drawn.
    let image = picture(64, 64);
    let (s, c) = (0.5, 0.75_f64.sqrt());
    let rotate = |s: f64| {
        let m = 31.5;
        Model::homography(Matrix3::new(c, -s, m - c * m + s * m, s, c, m - s * m - c * m, 0.0, 0.0, 1.0))
    };
    let (forward, reverse) = (rotate(s), rotate(-s));
    let warped = run(&image, &image, &forward, &reverse, &WarpOptions::default());
    let (ox, oy) = warped.offset;
    for y in 0..warped.image.height() {
        for x in 0..warped.image.width() {
            let [sx, sy] = reverse.project(x as f64 - ox as f64, y as f64 - oy as f64, 0.0).unwrap();
            let inside = |v: f64, margin: f64| v > margin && v < 63.0 - margin;
            let drawn = warped.footprint.data()[y * warped.image.width() + x] != 0;
            if inside(sx, 0.01) && inside(sy, 0.01) {
                assert!(drawn, "({x}, {y})");
            } else if !(inside(sx, -0.01) && inside(sy, -0.01)) {
                assert!(!drawn, "({x}, {y})");
            }
        }
    }
}

/// A near square (columns 10 to 19, rows 10 to 19) in front of a far background, seen from 6 px of parallax to the side.
struct Parallax {
    target: Image,
    reference: Image,
    target_depth: InverseDepth,
    reference_depth: InverseDepth,
    forward: Model,
    reverse: Model,
}

fn parallax() -> Parallax {
    let (w, h) = (40, 30);
    let scene = |left: usize| {
        let mut image = picture(w, h);
        let mut depth = vec![0.0; w * h];
        for y in 10..20 {
            for x in left..left + 10 {
                depth[y * w + x] = 1.0;
                image.data_mut()[4 * (y * w + x)..][..4].copy_from_slice(&[
                    250,
                    (20 * (x - left)) as u8,
                    (20 * (y - 10)) as u8,
                    255,
                ]);
            }
        }
        (image, InverseDepth::new("depth", &depth, (w, h), DepthKind::Inverse, None, (w, h)).unwrap())
    };
    let (target, target_depth) = scene(10);
    let (reference, reference_depth) = scene(16);
    let eye = Matrix3::identity();
    Parallax {
        target,
        reference,
        target_depth,
        reference_depth,
        forward: Model { h: eye, e: Vector3::new(6.0, 0.0, 0.0) },
        reverse: Model { h: eye, e: Vector3::new(-6.0, 0.0, 0.0) },
    }
}

impl Parallax {
    fn warp(&self, options: &WarpOptions) -> Warped {
        let target = View { image: self.target.view(), depth: Some(&self.target_depth) };
        let reference = View { image: self.reference.view(), depth: Some(&self.reference_depth) };
        warp(target, reference, &self.forward, &self.reverse, options, &mut ()).unwrap()
    }
}

#[test]
fn void_recovery_empties_what_the_target_did_not_see_and_selection_keeps_the_near_thing() {
    let scene = parallax();
    let warped = scene.warp(&WarpOptions { mode: WarpMode::Optimal, ..Default::default() });
    assert_eq!(warped.confidence, None);
    for y in 11..19 {
        for x in 17..25 {
            assert_eq!(warped.image.view().pixel(x, y), scene.reference.view().pixel(x, y), "near ({x}, {y})");
        }
        // Columns 10 to 15 of the background were hidden behind the square in the target.
        for x in 11..15 {
            assert_eq!(warped.image.view().pixel(x, y)[3], 0, "void ({x}, {y})");
        }
    }
    assert_eq!(warped.image.view().pixel(5, 5), scene.reference.view().pixel(5, 5));
}

/// What void recovery leaves is the same, and reliable; what it would remove is shown, and is not.
#[test]
fn soft_voids_are_shown_with_low_confidence() {
    let scene = parallax();
    let hard = scene.warp(&WarpOptions { mode: WarpMode::Optimal, ..Default::default() });
    let soft = scene.warp(&WarpOptions { mode: WarpMode::Soft, ..Default::default() });
    let confidence = soft.confidence.as_ref().unwrap();
    assert_eq!((soft.image.width(), soft.offset), (hard.image.width(), hard.offset));
    let (mut voids, left) = (0, soft.offset.0);
    for (i, (soft, hard)) in soft.image.pixels().iter().zip(hard.image.pixels()).enumerate() {
        let x = i % confidence.width();
        if !(left..left + 40).contains(&x) {
            continue;
        }
        if hard[3] != 0 {
            assert_eq!(soft, hard, "at {i}");
            assert!(confidence.data()[i] >= RELIABLE, "at {i}");
        } else {
            assert!(confidence.data()[i] < RELIABLE, "at {i}");
            voids += usize::from(soft[3] != 0);
        }
    }
    assert!(voids >= 8 * 4, "{voids}");
}

#[test]
fn without_void_recovery_the_cells_stretch_over_the_void() {
    let warped = parallax().warp(&WarpOptions { mode: WarpMode::Backward, ..Default::default() });
    assert!((11..19).all(|y| (11..15).all(|x| warped.image.view().pixel(x, y)[3] == 255)));
}

#[test]
fn forward_mapping_leaves_the_void_empty() {
    let warped = parallax().warp(&WarpOptions { mode: WarpMode::Forward, ..Default::default() });
    assert!((10..20).all(|y| (10..16).all(|x| warped.image.view().pixel(x, y)[3] == 0)));
}

#[test]
fn a_hole_is_bridged_or_dropped_as_asked() {
    let mut scene = parallax();
    let mut raw = scene.target_depth.data().to_vec();
    raw[3 * 40 + 5] = f32::NAN;
    scene.target_depth = InverseDepth::new("depth", &raw, (40, 30), DepthKind::Inverse, None, (40, 30)).unwrap();
    let nearest = scene.warp(&WarpOptions::default());
    assert_eq!(nearest.image.view().pixel(5, 3), scene.reference.view().pixel(5, 3));
    let dropped = scene.warp(&WarpOptions { holes: Holes::Drop, ..Default::default() });
    assert_eq!(dropped.image.view().pixel(5, 3)[3], 0);
}

#[test]
fn the_canvas_limit_cuts_and_says_so() {
    let image = picture(20, 20);
    let options = WarpOptions { canvas_limit: 0.5, ..Default::default() };
    let warped = run(&image, &image, &shift(25.0, 0.0), &shift(-25.0, 0.0), &options);
    assert!(warped.clipped);
    assert!(warped.image.width() <= 31);
}

#[test]
fn refusals_name_the_number() {
    let image = picture(20, 20);
    let one = shift(0.0, 0.0);
    let go = |forward: &Model, options: &WarpOptions| {
        warp(flat(&image), flat(&image), forward, &one, options, &mut ()).map(|_| ())
    };
    let code = |forward: &Model, options: WarpOptions| go(forward, &options).unwrap_err().code();
    let default = WarpOptions::default;
    let error = Error::TooLarge { width: 20, height: 20, bytes: 4400, limit: 1000 };
    assert_eq!(go(&one, &WarpOptions { max_bytes: 1000, ..default() }), Err(error.into()));
    assert_eq!(code(&shift(500.0, 0.0), default()), "no-overlap");
    assert_eq!(code(&shift(f64::NAN, 0.0), default()), "invalid-argument");
    assert_eq!(code(&one, WarpOptions { void_distance: 0.0, ..default() }), "invalid-argument");
    assert_eq!(code(&one, WarpOptions { stretch_limit: f64::NAN, ..default() }), "invalid-argument");
    assert_eq!(code(&one, WarpOptions { canvas_limit: -1.0, ..default() }), "invalid-argument");
    let parallax = Model { h: Matrix3::identity(), e: Vector3::new(1.0, 0.0, 0.0) };
    assert_eq!(code(&parallax, default()), "invalid-argument");
}

#[test]
fn a_photo_of_one_pixel_draws_nothing_and_does_not_panic() {
    let image = picture(1, 1);
    let warped = run(&image, &image, &shift(0.0, 0.0), &shift(0.0, 0.0), &WarpOptions::default());
    assert_eq!(warped.footprint.count(), 0);
}

#[test]
fn pixels_that_project_far_outside_the_target_do_not_count() {
    // Half of the reference projects 2²⁶ rows down: 64·2²⁶ pixels, where an index of 32 bits would be back at the start.
    let (w, h) = (64, 48);
    let gray = |top: u8, bottom: u8| {
        let mut image = Image::transparent(w, h).unwrap();
        let (above, below) = image.data_mut().split_at_mut(4 * w * h / 2);
        above.as_chunks_mut().0.fill([top, top, top, 255]);
        below.as_chunks_mut().0.fill([bottom, bottom, bottom, 255]);
        image
    };
    let raw: Vec<f32> = (0..w * h).map(|i| if i < w * h / 2 { 0.0 } else { 1.0 }).collect();
    let depth = InverseDepth::new("depth", &raw, (w, h), DepthKind::Inverse, None, (w, h)).unwrap();
    let (target, forward) = (gray(100, 100), shift(1.0, 0.0));
    let reverse = Model { h: Matrix3::identity(), e: Vector3::new(0.0, (1 << 26) as f64, 0.0) };
    let options = WarpOptions { mode: WarpMode::Optimal, ..Default::default() };
    // One pixel beside, of another gray: a void, unless the photos differ all over.
    for bottom in [100, 255] {
        let image = gray(120, bottom);
        let reference = View { image: image.view(), depth: Some(&depth) };
        let warped = warp(flat(&target), reference, &forward, &reverse, &options, &mut ()).unwrap();
        let shown = (0..w).filter(|&x| warped.image.view().pixel(x, 10)[3] != 0).count();
        assert_eq!(shown, 0, "below {bottom}");
    }
}

/// A detached dot far from everything, and a hair that sticks out, are no part of the outline; corners are.
#[test]
fn the_outline_outside_is_clean() {
    let image = picture(200, 200);
    // Depth moves things to the left: the left half by 60 pixels, a hair of it by 90, a dot by 150.
    let at = |x: usize, y: usize| match (x, y) {
        (20..24, 20..24) => 150.0,
        (0..60, 100..102) => 90.0,
        _ => 60.0,
    };
    let raw: Vec<f32> = (0..200 * 200).map(|i| at(i % 200, i / 200)).collect();
    let depth = InverseDepth::new("depth", &raw, (200, 200), DepthKind::Inverse, None, (200, 200)).unwrap();
    let view = View { image: image.view(), depth: Some(&depth) };
    let model = |x: f64| Model { h: Matrix3::identity(), e: Vector3::new(x, 0.0, 0.0) };
    let of = |mode| {
        let options = WarpOptions { mode, ..Default::default() };
        warp(view, view, &model(-1.0), &model(1.0), &options, &mut ()).unwrap()
    };
    let shown = |warped: &Warped, x: isize, y: usize| {
        warped.offset.0.checked_add_signed(x).is_some_and(|x| warped.image.view().pixel(x, y)[3] != 0)
    };
    let (hard, soft) = (of(WarpMode::Optimal), of(WarpMode::Soft));
    assert!(shown(&hard, -128, 22) && !shown(&soft, -128, 22), "the dot");
    assert!(shown(&hard, -80, 100) && !shown(&soft, -80, 100), "the hair");
    assert!(shown(&soft, -60, 0) && shown(&soft, -60, 199), "the corners");
}

/// What is too small to be shown at the photo's border leaves no void that sticks out; a void between two things stays.
#[test]
fn no_void_sticks_out() {
    const SIDE: usize = 400;
    let image = picture(SIDE, SIDE);
    // Depth moves things to the left: a column by 160 pixels, a piece of something nearer at the border by 260.
    let at = |x: usize, y: usize| match (x, y) {
        (0..5, 200..212) => 260.0,
        (40..60, _) => 160.0,
        _ => 60.0,
    };
    let raw: Vec<f32> = (0..SIDE * SIDE).map(|i| at(i % SIDE, i / SIDE)).collect();
    let depth = InverseDepth::new("depth", &raw, (SIDE, SIDE), DepthKind::Inverse, None, (SIDE, SIDE)).unwrap();
    let view = View { image: image.view(), depth: Some(&depth) };
    let model = |x: f64| Model { h: Matrix3::identity(), e: Vector3::new(x, 0.0, 0.0) };
    let options = WarpOptions { mode: WarpMode::Soft, ..Default::default() };
    let warped = warp(view, view, &model(-1.0), &model(1.0), &options, &mut ()).unwrap();
    let void = |x: isize, y: usize| {
        warped.offset.0.checked_add_signed(x).is_some_and(|x| {
            let at = y * warped.image.width() + x;
            warped.footprint.data()[at] != 0 && warped.image.view().pixel(x, y)[3] == 0
        })
    };
    assert!(void(-80, 206), "between the column and what is behind it");
    assert!(!void(-200, 206), "between the column and the piece");
    assert_eq!(warped.offset, (120, 0), "nor is there room for the piece");
    assert_eq!(warped.image.size(), (SIDE + 120, SIDE));
}
