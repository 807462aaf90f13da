//! Rectangles to crop the mosaic to.

#![allow(clippy::unwrap_used)]

#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

use depthstitch::mosaic::crop::{bounds, inner};
use depthstitch::{Image, Rect};
use scene::Random;

fn picture(width: usize, height: usize, valid: impl Fn(usize, usize) -> bool) -> Image {
    let pixel = |x: usize, y: usize| [x as u8, y as u8, (x * y) as u8, if valid(x, y) { 255 } else { 0 }];
    let data = (0..width * height).flat_map(|i| pixel(i % width, i / width)).collect();
    Image::new(data, width, height).unwrap()
}

fn rect(x: usize, y: usize, width: usize, height: usize) -> Option<Rect> {
    Some(Rect { x, y, width, height })
}

fn is_valid(image: &Image, x: usize, y: usize) -> bool {
    image.view().pixel(x, y)[3] != 0
}

/// All rectangles, tried one by one.
fn largest(image: &Image) -> Option<Rect> {
    let mut best: Option<Rect> = None;
    for (y, x) in (0..image.height()).flat_map(|y| (0..image.width()).map(move |x| (y, x))) {
        let mut widest = image.width() - x;
        for row in y..image.height() {
            widest = (x..x + widest).position(|x| !is_valid(image, x, row)).unwrap_or(widest);
            let area = widest * (row + 1 - y);
            if area > best.map_or(0, |best| best.width * best.height) {
                best = rect(x, y, widest, row + 1 - y);
            }
        }
    }
    best
}

#[test]
fn the_inner_rectangle_is_the_largest_of_all() {
    let mut random = Random::new(3);
    for round in 0..300 {
        let (width, height) = (1 + round % 13, 1 + round * 7 % 11);
        let share = [0.5, 0.8, 0.95, 1.0, 0.02][round % 5];
        let valid: Vec<bool> = (0..width * height).map(|_| random.uniform() < share).collect();
        let image = picture(width, height, |x, y| valid[y * width + x]);
        let (found, expected) = (inner(&image).unwrap(), largest(&image));
        let area = |rect: Option<Rect>| rect.map(|rect| rect.width * rect.height);
        assert_eq!(area(found), area(expected), "{valid:?}");
        let Some(found) = found else { continue };
        for (y, x) in (found.y..found.y + found.height).flat_map(|y| (0..found.width).map(move |x| (y, x + found.x))) {
            assert!(is_valid(&image, x, y));
        }
    }
}

#[test]
fn the_bounds_hold_all_valid_pixels_and_no_empty_side() {
    let mut random = Random::new(4);
    for round in 0..200 {
        let (width, height) = (1 + round % 17, 1 + round * 5 % 9);
        let valid: Vec<bool> = (0..width * height).map(|_| random.uniform() < 0.05).collect();
        let image = picture(width, height, |x, y| valid[y * width + x]);
        let columns = || (0..width).filter(|&x| (0..height).any(|y| is_valid(&image, x, y)));
        let rows = || (0..height).filter(|&y| (0..width).any(|x| is_valid(&image, x, y)));
        let expected = columns().next().map(|x| {
            let y = rows().next().unwrap();
            Rect { x, y, width: columns().next_back().unwrap() + 1 - x, height: rows().next_back().unwrap() + 1 - y }
        });
        assert_eq!(bounds(&image), expected);
    }
}

#[test]
fn known_shapes() {
    let whole = picture(9, 7, |_, _| true);
    assert_eq!((inner(&whole).unwrap(), bounds(&whole)), (rect(0, 0, 9, 7), rect(0, 0, 9, 7)));
    let nothing = picture(9, 7, |_, _| false);
    assert_eq!((inner(&nothing).unwrap(), bounds(&nothing)), (None, None));
    // Two photos side by side, the left one lower.
    let steps = picture(20, 10, |x, y| if x < 12 { y >= 3 } else { y < 8 });
    assert_eq!((inner(&steps).unwrap(), bounds(&steps)), (rect(0, 3, 20, 5), rect(0, 0, 20, 10)));
    // Of two as large ones the upper, of two in a row the left one.
    let twins = picture(9, 9, |x, y| !(3..=5).contains(&x) && !(3..=5).contains(&y));
    assert_eq!(inner(&twins).unwrap(), rect(0, 0, 3, 3));
}
