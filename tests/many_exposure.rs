//! Exposure of many photos: each is rendered, then taken as with another camera.
#![allow(clippy::unwrap_used)]

use depthstitch::mosaic::{BlendOptions, Composition, Layer};
use depthstitch::pipeline::many::{ManyOptions, Photo, StitchedMany, stitch_many};
use depthstitch::warp::Warped;
use depthstitch::{Image, ImageView, Mask};
use scene::{SIZE, Views, gallery_from, linear, take};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

fn stitched(views: &Views, reference: usize) -> StitchedMany {
    let image = |data| ImageView::new("photo", data, SIZE.0, SIZE.1).unwrap();
    let photos: Vec<Photo<'_>> = views.0.iter().map(|view| Photo::new(image(&view.rgba))).collect();
    let options = ManyOptions { reference: Some(reference), ..ManyOptions::default() };
    stitch_many(&photos, &options, &mut ()).unwrap()
}

#[test]
fn known_gains_are_found_although_lenses_darken_corners() {
    let mut views = gallery_from(&[[-0.9, 0.0, -0.1], [-0.45, 0.1, -0.05], [0.0, 0.0, 0.0], [0.45, 0.1, 0.05]]);
    let taken = [0.6, 1.0, 0.8, 0.5];
    views.0.iter_mut().zip(taken).for_each(|(view, gain)| take(&mut view.rgba, SIZE, gain, 0.25));
    let done = stitched(&views, 1);
    for (photo, (report, gain)) in done.photos.iter().zip(taken).enumerate() {
        println!("{photo}: {:?} for {gain}", report.gains);
        for (found, reference) in report.gains.iter().zip(done.photos[1].gains) {
            assert!((found * gain / reference - 1.0).abs() < 0.06, "photo {photo}: {found} for {gain}");
        }
    }
}

/// The picture is not dark because the photo in whose view it is shown is, nor burnt out because that is bright: the first is lifted as a whole, for
/// the second all photos are taken darker. Where photos differ as usual, the reference stays as it is.
#[test]
fn the_picture_is_as_bright_as_the_photos_are() {
    let places = [[-0.45, 0.0, -0.05], [0.0, 0.0, 0.0], [0.45, 0.1, 0.05], [0.8, 0.0, 0.0]];
    let brightness = |reference: f64| {
        let mut views = gallery_from(&places);
        let taken = [0.9, reference, 0.9, 0.9];
        views.0.iter_mut().zip(taken).for_each(|(view, gain)| take(&mut view.rgba, SIZE, gain, 0.0));
        let done = stitched(&views, 1);
        let own = done.photos[1].gains;
        for (photo, taken) in done.photos.iter().zip(taken) {
            for (gain, own) in photo.gains.iter().zip(own) {
                // Of what is burnt out in the reference nobody knows how bright it was.
                let expected = own * reference / taken;
                assert!((gain / expected - 1.0).abs() < 0.2, "{gain} instead of {expected}");
            }
        }
        let seen = done.image.pixels().iter().zip(done.labels.data()).filter(|(_, label)| **label == 2);
        let light: Vec<f64> = seen.map(|(pixel, _)| linear(pixel[1])).collect();
        (own, light.iter().sum::<f64>() / light.len() as f64)
    };
    let (usual, [dark, bright]) = (brightness(0.8), [brightness(0.25), brightness(1.8)]);
    println!("{usual:?} {dark:?} {bright:?}");
    assert!(usual.0 == [1.0; 3] && dark.0 == [1.0; 3] && bright.0.iter().all(|gain| (0.5..0.8).contains(gain)));
    assert!((0.5 * usual.1..1.2 * usual.1).contains(&dark.1), "{}", dark.1);
    assert!((0.9 * usual.1..1.6 * usual.1).contains(&bright.1), "{}", bright.1);
}

/// What is brightened to match the others keeps what its own highlights show.
#[test]
fn highlights_of_a_dark_photo_are_kept() {
    let mut views = gallery_from(&[[-0.45, 0.0, -0.05], [0.0, 0.0, 0.0], [0.45, 0.1, 0.05]]);
    // Over-exposed but for the last, which shows what is white in the others.
    for (view, gain) in views.0.iter_mut().zip([2.4, 2.4, 0.8]) {
        take(&mut view.rgba, SIZE, gain, 0.0);
    }
    let done = stitched(&views, 0);
    println!("gains {:?}", done.photos[2].gains);
    let (mut white, mut own) = (0, 0);
    for (pixel, _) in done.image.pixels().iter().zip(done.labels.data()).filter(|(_, label)| **label == 3) {
        white += usize::from(pixel[1] == 255);
        own += 1;
    }
    println!("white {white} of {own}");
    assert!(own > 1000 && white * 100 < own, "{white} of {own} pixels are white");
}

/// A photo beside the others, or one whose overlap is burnt out: nothing there says how much brighter it is, but its other pairs do.
#[test]
fn gains_that_are_known_apply_without_an_overlap() {
    let side = 64;
    let even = |level: u8| Image::new([level, level, level, 255].repeat(side * side), side, side).unwrap();
    let warped = Warped {
        image: even(50),
        footprint: Mask::new(vec![255; side * side], side, side).unwrap(),
        confidence: None,
        depth: None,
        offset: (0, 0),
        clipped: false,
    };
    for (gains, expected) in [(None, 50), (Some([2.0; 3]), 71)] {
        let mut set = Composition::of(even(100).view(), None, 1).unwrap();
        let at = [side as i64, 0];
        let added = set
            .add(&warped, at, Layer { label: 2, gains, matches: &[] }, &BlendOptions::default(), &mut ())
            .unwrap()
            .unwrap();
        assert_eq!((added.overlap, added.gains), (0, gains.unwrap_or([1.0; 3])));
        let pixel = set.image.pixels()[side / 2 * set.image.width() + 3 * side / 2];
        assert!(pixel[0].abs_diff(expected) <= 1, "{pixel:?} with {gains:?}");
    }
}
