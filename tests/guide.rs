//! Depth on the canvas: the warped target's, and the reference's in the same gauge.

#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

use depthstitch::geometry::Model;
use depthstitch::inverse_depth::DepthKind;
use depthstitch::mosaic::FillGuide;
use depthstitch::warp::{WarpMode, WarpOptions, Warped, warp};
use depthstitch::{InverseDepth, Mask};
use scene::{MatchOptions, Pair, Photos, gallery};

const SIZE: (usize, usize) = (240, 160);

fn photos(pair: &Pair<'_>) -> Photos {
    Photos::of(pair, &MatchOptions { count: 4, sigma: 0.0, outliers: 0.0, seed: 1 })
}

fn warped(photos: &Photos, forward: &Model, reverse: &Model, mode: WarpMode) -> Warped {
    let options = WarpOptions { mode, ..Default::default() };
    warp(photos.target(), photos.reference(), forward, reverse, &options, &mut ()).unwrap()
}

/// Median over the pixels of the reference of |value / truth − 1|, where there is a value.
fn error(depth: &InverseDepth, offset: (usize, usize), truth: &[f32]) -> f32 {
    let mut errors: Vec<f32> = (0..SIZE.0 * SIZE.1)
        .filter_map(|i| {
            let value = depth.data()[(i / SIZE.0 + offset.1) * depth.width() + i % SIZE.0 + offset.0];
            (!value.is_nan()).then(|| (value / truth[i] - 1.0).abs())
        })
        .collect();
    assert!(errors.len() > SIZE.0 * SIZE.1 / 3, "{} pixels", errors.len());
    errors.sort_by(f32::total_cmp);
    errors[errors.len() / 2]
}

#[test]
fn the_warped_depth_is_that_of_the_reference() {
    let scene = gallery();
    let pair = scene.survey(SIZE.0, SIZE.1);
    let photos = photos(&pair);
    let truth = pair.reference.inverse_depth();
    for mode in [WarpMode::Forward, WarpMode::Backward, WarpMode::BackwardVoid, WarpMode::Optimal] {
        let warped = warped(&photos, &pair.forward, &pair.reverse, mode);
        let depth = warped.depth.unwrap();
        assert_eq!(depth.size(), warped.image.size());
        for (d, pixel) in depth.data().iter().zip(warped.image.data().chunks_exact(4)) {
            assert_eq!(d.is_nan(), pixel[3] == 0);
        }
        let error = error(&depth, warped.offset, &truth);
        assert!(error < 0.005, "{mode:?}: {error}");
    }
    let flat = Model::homography(pair.forward.h);
    assert_eq!(warped(&photos, &flat, &Model::homography(pair.reverse.h), WarpMode::Optimal).depth, None);
}

#[test]
fn the_references_depth_is_brought_into_the_same_gauge() {
    let scene = gallery();
    let pair = scene.survey(SIZE.0, SIZE.1);
    let mut photos = photos(&pair);
    let mut warped = warped(&photos, &pair.forward, &pair.reverse, WarpMode::Optimal);
    let before = warped.depth.clone().unwrap();
    let truth = pair.reference.inverse_depth();
    // Another scale and shift, and a tenth of the map is wrong.
    let other: Vec<f32> =
        truth.iter().enumerate().map(|(i, d)| if i % 10 == 3 { 90.0 } else { 40.0 * d - 1.5 }).collect();
    photos.reference_depth = InverseDepth::new("depth", &other, SIZE, DepthKind::Inverse, None, SIZE).ok();
    let shows = |label: u8| Mask::new(vec![label; before.data().len()], before.width(), before.height()).unwrap();
    let guide_to = |shown: u8, warped: &mut Warped| {
        FillGuide::new(warped, &shows(shown), &pair.forward, photos.reference()).unwrap().unwrap()
    };
    // Where the mosaic shows the reference it is the reference's, even if the target shows something nearer there.
    let whole = guide_to(2, &mut warped.clone()).depth;
    let inside = |i: usize| (i / SIZE.0 + warped.offset.1) * before.width() + i % SIZE.0 + warped.offset.0;
    let right = |i: &usize| (whole.data()[inside(*i)] / truth[*i] - 1.0).abs() < 0.05;
    assert!((0..truth.len()).filter(|i| i % 10 != 3).filter(right).count() * 100 > truth.len() * 89);

    let guide = guide_to(1, &mut warped);
    let mut rows = 0;
    for y in 0..SIZE.1 {
        let at = (y + warped.offset.1) * before.width() + warped.offset.0 + SIZE.0 - 2;
        if before.data()[at].is_nan() && (y * SIZE.0 + SIZE.0 - 2) % 10 != 3 {
            let truth = truth[y * SIZE.0 + SIZE.0 - 2];
            assert!((guide.depth.data()[at] / truth - 1.0).abs() < 0.05, "{} for {truth}", guide.depth.data()[at]);
            rows += 1;
        }
    }
    assert!(rows > SIZE.1 / 2, "{rows} rows");
    for (after, before) in guide.depth.data().iter().zip(before.data()).filter(|(_, before)| !before.is_nan()) {
        assert_eq!(after, before);
    }
    assert_eq!(guide.epipole[2], pair.forward.e[2]);
    let off = guide.epipole[0] - pair.forward.e[0] - warped.offset.0 as f64 * pair.forward.e[2];
    assert!(off.abs() < 1e-9);
}
