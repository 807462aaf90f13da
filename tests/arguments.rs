//! Options out of range and buffers whose length does not fit: each is refused with its code.
#![allow(clippy::unwrap_used)]

use depthstitch::depth::derive_depth;
use depthstitch::geometry::{Model, Threshold};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::mosaic::{BlendOptions, Composition, FillGuide, FillOptions, Layer, SeamGuide, blend};
use depthstitch::observer::Observer;
use depthstitch::pipeline::many::{ManyOptions, Photo, stitch_many};
use depthstitch::pipeline::{Options, stitch};
use depthstitch::warp::Warped;
use depthstitch::{Error, Image, ImageView, InverseDepth, Mask, Result, Stage, View};
use nalgebra::Matrix3;
use scene::{MatchOptions, Photos};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

#[test]
fn options_out_of_range() {
    let matches = MatchOptions { count: 200, sigma: 0.3, outliers: 0.1, seed: 1 };
    let photos = Photos::of(&scene::gallery().render(120, 80), &matches);
    type Change = fn(&mut Options);
    let changes: [(&'static str, Change, &'static str); 24] = [
        ("threshold 0", |o| o.estimate.threshold = Threshold::Pixels(0.0), "invalid-argument"),
        ("threshold NaN", |o| o.estimate.threshold = Threshold::Pixels(f64::NAN), "invalid-argument"),
        ("threshold infinite", |o| o.estimate.threshold = Threshold::Pixels(f64::INFINITY), "invalid-argument"),
        ("normalised threshold negative", |o| o.estimate.threshold = Threshold::Normalised(-0.1), "invalid-argument"),
        ("confidence 0", |o| o.estimate.confidence = 0.0, "invalid-argument"),
        ("confidence 1", |o| o.estimate.confidence = 1.0, "invalid-argument"),
        ("confidence NaN", |o| o.estimate.confidence = f64::NAN, "invalid-argument"),
        ("no trials", |o| o.estimate.max_trials = 0, "invalid-argument"),
        ("void distance 0", |o| o.warp.void_distance = 0.0, "invalid-argument"),
        ("void distance NaN", |o| o.warp.void_distance = f64::NAN, "invalid-argument"),
        ("stretch limit negative", |o| o.warp.stretch_limit = -2.0, "invalid-argument"),
        ("stretch limit infinite", |o| o.warp.stretch_limit = f64::INFINITY, "invalid-argument"),
        ("colour distance 0", |o| o.warp.colour_distance = 0.0, "invalid-argument"),
        ("colour distance NaN", |o| o.warp.colour_distance = f64::NAN, "invalid-argument"),
        ("colour distance infinite", |o| o.warp.colour_distance = f64::INFINITY, ""),
        ("canvas limit negative", |o| o.warp.canvas_limit = -0.1, "invalid-argument"),
        ("canvas limit NaN", |o| o.warp.canvas_limit = f64::NAN, "invalid-argument"),
        ("canvas limit infinite", |o| o.warp.canvas_limit = f64::INFINITY, "invalid-argument"),
        ("fill radius 0", |o| o.fill.as_mut().unwrap().radius = 0, "invalid-argument"),
        ("fill radius 65", |o| o.fill.as_mut().unwrap().radius = 65, "invalid-argument"),
        ("fill radius huge", |o| o.fill.as_mut().unwrap().radius = u32::MAX, "invalid-argument"),
        ("no memory", |o| o.warp.max_bytes = 0, "too-large"),
        ("little memory", |o| o.warp.max_bytes = 100_000, "too-large"),
        ("a grid of one column", |o| o.warp.grid = (1, 0), ""),
    ];
    for (name, change, code) in changes {
        let mut options = Options::default();
        change(&mut options);
        let result = stitch(Some(&photos.matches), photos.target(), photos.reference(), &options, &mut ());
        assert_eq!(result.err().map_or("", |error| error.code()), code, "{name}");
    }
}

/// Counts messages of progress.
struct Count(usize);

impl Observer for Count {
    fn progress(&mut self, _: Stage, _: f32) -> bool {
        self.0 += 1;
        true
    }
}

#[test]
fn options_of_the_last_stages_are_refused_before_the_first_one() {
    let matches = MatchOptions { count: 200, sigma: 0.3, outliers: 0.1, seed: 1 };
    let photos = Photos::of(&scene::gallery().render(120, 80), &matches);
    let blend = |change: fn(&mut BlendOptions)| {
        let mut options = Options::default();
        change(&mut options.blend);
        options
    };
    let fill = Options { fill: Some(FillOptions { radius: 0, ..FillOptions::default() }), ..Options::default() };
    for options in [blend(|o| o.feather = 2000), blend(|o| o.bands = 11), fill] {
        let mut count = Count(0);
        let found = stitch(None, photos.target(), photos.reference(), &options, &mut count);
        assert_eq!(found.unwrap_err().code(), "invalid-argument");
        let all = [photos.target.view(), photos.reference.view()].map(Photo::new);
        let found = stitch_many(&all, &ManyOptions { stages: options, ..ManyOptions::default() }, &mut count);
        assert_eq!(found.unwrap_err().code(), "invalid-argument");
        assert_eq!(count.0, 0);
    }
}

#[test]
fn buffers_whose_length_does_not_fit() {
    fn code<T>(result: Result<T>) -> &'static str {
        result.err().map_or("", |error| error.code())
    }
    let photo = |len: usize, width: usize, height: usize| {
        let borrowed = code(ImageView::new("target", &vec![0; len], width, height));
        assert_eq!(code(Image::new(vec![0; len], width, height)), borrowed);
        borrowed
    };
    let mask = |len: usize, width: usize, height: usize| code(Mask::new(vec![0; len], width, height));
    let map = |len: usize, size: (usize, usize)| {
        code(InverseDepth::new("targetDepth", &vec![1.0; len], size, DepthKind::Metric, None, (3, 2)))
    };
    assert_eq!(photo(24, 3, 2), "");
    for len in [0, 23, 25, 6, 48] {
        assert_eq!(photo(len, 3, 2), "size-mismatch", "{len}");
    }
    assert_eq!(photo(24, usize::MAX, usize::MAX), "size-mismatch");
    assert_eq!(photo(0, 1 << (usize::BITS / 2), 1 << (usize::BITS / 2)), "size-mismatch");
    for (width, height) in [(0, 2), (3, 0), (0, 0)] {
        assert_eq!(photo(0, width, height), "invalid-argument");
        assert_eq!(map(0, (width, height)), "invalid-argument");
    }
    assert_eq!(mask(6, 3, 2), "");
    for len in [0, 5, 7, 24] {
        assert_eq!(mask(len, 3, 2), "size-mismatch", "{len}");
    }
    for (width, height) in [(0, 2), (3, 0)] {
        assert_eq!(mask(0, width, height), "invalid-argument");
        assert_eq!(code(Mask::empty(width, height)), "invalid-argument");
        assert_eq!(code(Image::transparent(width, height)), "invalid-argument");
    }
    assert_eq!(code(Image::transparent(usize::MAX, 2)), "out-of-memory");
    assert_eq!(map(6, (3, 2)), "");
    assert_eq!(map(1, (1, 1)), "");
    for len in [0, 5, 7, 24] {
        assert_eq!(map(len, (3, 2)), "size-mismatch", "{len}");
    }
    assert_eq!(map(6, (usize::MAX, usize::MAX)), "size-mismatch");

    // A map of one pixel, made as large as an image.
    let known = InverseDepth::constant(1.0, 4, 4).unwrap();
    let shift = Model::homography(Matrix3::new(1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
    let sized = |(width, height): (usize, usize)| {
        let codes = [
            code(InverseDepth::new("targetDepth", &[1.0], (1, 1), DepthKind::Inverse, None, (width, height))),
            code(InverseDepth::constant(1.0, width, height)),
            code(derive_depth(&known, &shift, (width, height), &mut ())),
        ];
        assert_eq!(codes, [codes[0]; 3], "{width}×{height}");
        codes[0]
    };
    assert_eq!(sized((3, 2)), "");
    for empty in [(0, 2), (3, 0), (0, 0)] {
        assert_eq!(sized(empty), "invalid-argument");
    }
    // The product of the second wraps around to what might be allocated.
    for huge in [(usize::MAX, 1), (1 << (usize::BITS / 2), (1 << (usize::BITS / 2)) + 1)] {
        assert_eq!(sized(huge), "out-of-memory");
    }
}

/// A canvas of 8×6 on which the target is drawn everywhere.
fn warped() -> Warped {
    Warped {
        image: Image::new(vec![255; 4 * 8 * 6], 8, 6).unwrap(),
        footprint: Mask::new(vec![255; 8 * 6], 8, 6).unwrap(),
        confidence: None,
        depth: None,
        offset: (0, 0),
        clipped: false,
    }
}

#[test]
fn warped_photos_whose_masks_or_depth_do_not_fit() {
    let reference = Image::new(vec![255; 4 * 8 * 6], 8, 6).unwrap();
    let turned = Mask::new(vec![255; 8 * 6], 6, 8).unwrap();
    let seam = warped().footprint;
    let flat = Model::homography(Matrix3::identity());
    let view = View { image: reference.view(), depth: None };
    let options = BlendOptions::default();
    let layer = Layer { label: 2, gains: None, matches: &[] };
    let mut set = Composition::of(reference.view(), None, 1).unwrap();
    for (torn, mut warped) in [
        ("footprint", Warped { footprint: turned.clone(), ..warped() }),
        ("confidence", Warped { confidence: Some(turned), ..warped() }),
        ("depth", Warped { depth: InverseDepth::constant(1.0, 6, 8).ok(), ..warped() }),
    ] {
        let errors = [
            blend(&warped, reference.view(), &SeamGuide::default(), &options, &mut ()).unwrap_err(),
            set.add(&warped, [0, 0], layer, &options, &mut ()).unwrap_err(),
            Composition::of_warped(warped.clone(), (8, 6), 1).unwrap_err(),
            FillGuide::new(&mut warped, &seam, &flat, view).unwrap_err(),
        ];
        for error in errors {
            let expected = Error::WrongSize { name: torn, expected: (8, 6), actual: (6, 8) };
            assert_eq!(*error, expected);
        }
    }
    let depth = InverseDepth::constant(1.0, 6, 8).unwrap();
    assert_eq!(Composition::of(reference.view(), Some(&depth), 1).unwrap_err().code(), "size-mismatch");
    for options in [
        BlendOptions { feather: 1001, ..BlendOptions::default() },
        BlendOptions { bands: 11, ..BlendOptions::default() },
        BlendOptions { bands: 64, ..BlendOptions::default() },
    ] {
        assert_eq!(set.add(&warped(), [0, 0], layer, &options, &mut ()).unwrap_err().code(), "invalid-argument");
    }
    let none = Layer { label: 0, ..layer };
    assert_eq!(set.add(&warped(), [0, 0], none, &options, &mut ()).unwrap_err().code(), "invalid-argument");
    for far in [i64::MIN, i64::MAX] {
        assert_eq!(set.add(&warped(), [far, far], layer, &options, &mut ()).unwrap_err().code(), "out-of-memory");
    }
    assert!(set == Composition::of(reference.view(), None, 1).unwrap());
}
