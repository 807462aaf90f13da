//! Line segments of drawn polygons, of which every edge is known.
#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

mod fingerprint;

use depthstitch::features::{LineSegment, LineSegmentOptions, line_segments};
use depthstitch::{Error, Image};
use fingerprint::fingerprint;
use scene::Random;

type Point = [f64; 2];

/// A picture of the gray levels of a function of the place, each pixel the mean over its area.
fn draw(width: usize, height: usize, gray: impl Fn(Point) -> f64) -> Image {
    const SAMPLES: usize = 8;
    let mut image = Image::transparent(width, height).unwrap();
    for (i, pixel) in image.data_mut().chunks_exact_mut(4).enumerate() {
        let offset = |k: usize| (k as f64 + 0.5) / SAMPLES as f64 - 0.5;
        let sample =
            |k: usize| gray([(i % width) as f64 + offset(k % SAMPLES), (i / width) as f64 + offset(k / SAMPLES)]);
        let mean = (0..SAMPLES * SAMPLES).map(sample).sum::<f64>() / (SAMPLES * SAMPLES) as f64;
        let value = mean.round().clamp(0.0, 255.0) as u8;
        pixel.copy_from_slice(&[value, value, value, 255]);
    }
    image
}

/// How far `p` is to the right of the line from `a` to `b` (x right, y down).
fn side([ax, ay]: Point, [bx, by]: Point, [x, y]: Point) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    (dx * (y - ay) - dy * (x - ax)) / dx.hypot(dy)
}

fn edges(polygon: &[Point]) -> impl Iterator<Item = (Point, Point)> {
    (0..polygon.len()).map(|i| (polygon[i], polygon[(i + 1) % polygon.len()]))
}

/// Convex, corners clockwise on the screen: what is inside is to the right of every edge.
fn inside(polygon: &[Point], p: Point) -> bool {
    edges(polygon).all(|(a, b)| side(a, b, p) >= 0.0)
}

fn found(image: &Image) -> Vec<LineSegment> {
    line_segments(image.view(), &LineSegmentOptions::default()).unwrap()
}

fn distance([ax, ay]: Point, [bx, by]: Point) -> f64 {
    (ax - bx).hypot(ay - by)
}

const POLYGONS: [&[Point]; 3] = [
    &[[40.3, 30.7], [200.1, 52.4], [171.6, 160.2], [60.8, 140.5]],
    &[[50.0, 20.0], [180.0, 20.0], [180.0, 150.0], [50.0, 150.0]],
    &[[120.0, 15.5], [205.2, 90.1], [119.4, 165.3], [30.9, 88.2]],
];

#[test]
fn edges_of_polygons_are_found_to_a_fraction_of_a_pixel() {
    for (shape, polygon) in POLYGONS.iter().enumerate() {
        for (within, without) in [(200.0, 60.0), (70.0, 110.0)] {
            let image = draw(240, 180, |p| if inside(polygon, p) { within } else { without });
            let segments = found(&image);
            assert_eq!(segments.len(), polygon.len(), "{shape}: {segments:?}");
            for (a, b) in edges(polygon) {
                // The darker side lies to the right.
                let (from, to) = if within < without { (a, b) } else { (b, a) };
                let near = |s: &&LineSegment| distance(s.start, from) < 5.0 && distance(s.end, to) < 5.0;
                let segment = segments.iter().find(near);
                let segment = segment.unwrap_or_else(|| panic!("{shape}: {from:?} {to:?} in {segments:?}"));
                for end in [segment.start, segment.end] {
                    let off = side(a, b, end);
                    assert!(off.abs() < 0.15, "{shape}: {off} of {a:?} {b:?}");
                }
                assert!(segment.significance > 10.0 && segment.width < 8.0, "{segment:?}");
                assert!((segment.length() - distance(a, b)).abs() < 8.0, "{segment:?}");
            }
        }
    }
}

#[test]
fn edges_are_found_under_noise() {
    let mut random = Random::new(5);
    let polygon = POLYGONS[0];
    let mut image = draw(240, 180, |p| if inside(polygon, p) { 180.0 } else { 80.0 });
    for pixel in image.data_mut().chunks_exact_mut(4) {
        let value = (f64::from(pixel[0]) + 8.0 * random.normal()).round().clamp(0.0, 255.0) as u8;
        pixel[..3].fill(value);
    }
    let segments = found(&image);
    for (a, b) in edges(polygon) {
        let on = |s: &&LineSegment| [s.start, s.end].iter().all(|&end| side(a, b, end).abs() < 0.7);
        let covered: f64 = segments.iter().filter(on).map(LineSegment::length).sum();
        assert!(covered > 0.9 * distance(a, b), "{covered} of {}", distance(a, b));
    }
}

#[test]
fn noise_has_no_line_segments() {
    let mut random = Random::new(3);
    let mut count = 0;
    for _ in 0..4 {
        let mut image = Image::transparent(300, 200).unwrap();
        for pixel in image.data_mut().chunks_exact_mut(4) {
            pixel[..3].fill((255.0 * random.uniform()) as u8);
        }
        count += found(&image).len();
    }
    // One false alarm is expected of every picture at most; smoothing correlates neighbours.
    assert!(count <= 2, "{count}");
    assert_eq!(found(&draw(300, 200, |_| 90.0)), []);
}

#[test]
fn a_disc_is_no_long_line() {
    let image = draw(200, 200, |[x, y]| if (x - 100.0).hypot(y - 100.0) < 60.0 { 220.0 } else { 30.0 });
    let longest = found(&image).iter().map(LineSegment::length).fold(0.0, f64::max);
    // A chord of this length leaves the circle by 4 pixels.
    assert!(longest < 45.0, "{longest}");
}

#[test]
fn a_lower_bar_admits_more() {
    let mut random = Random::new(9);
    let mut image = draw(120, 90, |[x, y]| 20.0 + 0.2 * x + 0.1 * y);
    for pixel in image.data_mut().chunks_exact_mut(4) {
        let value = (f64::from(pixel[0]) + 12.0 * random.normal()).clamp(0.0, 255.0) as u8;
        pixel[..3].fill(value);
    }
    let count = |min_significance: f64| {
        let options = LineSegmentOptions { min_significance, ..Default::default() };
        line_segments(image.view(), &options).unwrap().len()
    };
    assert!(count(-6.0) > count(0.0) + 5, "{} {}", count(-6.0), count(0.0));
}

#[test]
fn small_pictures_have_none_and_do_no_harm() {
    for (width, height) in [(1, 1), (2, 1), (1, 40), (2, 2), (3, 5), (9, 8)] {
        let image = draw(width, height, |[x, _]| if x > 0.5 { 255.0 } else { 0.0 });
        assert!(found(&image).len() <= 1, "{width}×{height}");
    }
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let image = draw(20, 20, |_| 0.0);
    let base = LineSegmentOptions::default;
    let cases = [
        ("scale", LineSegmentOptions { scale: 0.0, ..base() }),
        ("scale", LineSegmentOptions { scale: f64::NAN, ..base() }),
        ("sigmaScale", LineSegmentOptions { sigma_scale: 9.0, ..base() }),
        ("quantizationError", LineSegmentOptions { quantization_error: -1.0, ..base() }),
        ("angleTolerance", LineSegmentOptions { angle_tolerance: 90.0, ..base() }),
        ("minDensity", LineSegmentOptions { min_density: 1.5, ..base() }),
        ("minLength", LineSegmentOptions { min_length: -1.0, ..base() }),
        ("minSignificance", LineSegmentOptions { min_significance: f64::INFINITY, ..base() }),
    ];
    for (expected, options) in cases {
        let error = line_segments(image.view(), &options).unwrap_err();
        assert!(matches!(*error, Error::InvalidArgument { name, .. } if name == expected), "{expected}: {error}");
    }
}

#[test]
fn the_same_bits_everywhere() {
    let mut random = Random::new(11);
    let mut image = draw(160, 120, |p| if inside(POLYGONS[0], p) { 190.0 } else { 70.0 });
    for pixel in image.data_mut().chunks_exact_mut(4) {
        let value = (f64::from(pixel[0]) + 20.0 * random.uniform()) as u8;
        pixel[..3].fill(value);
    }
    let values = |s: LineSegment| [s.start[0], s.start[1], s.end[0], s.end[1], s.width, s.significance];
    let bits = found(&image).into_iter().flat_map(values).map(f64::to_bits);
    assert_eq!(fingerprint(bits), 13_183_182_046_208_350_961);
}
