//! Exposure compensation of rendered pairs, against the light that was taken away.
#![allow(clippy::unwrap_used)]

mod pictures;

use depthstitch::Image;
use depthstitch::mosaic::{BlendOptions, Exposure, Mosaic, Seam, SeamGuide, blend};
use depthstitch::warp::{WarpMode, WarpOptions, Warped, warp};
use pictures::{picture, pixels, warped};
use scene::{Camera, MatchOptions, Pair, Photos, Scene, level, linear};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (240, 160);

/// How a camera takes pictures: light is multiplied, bent, and falls off towards the corners.
#[derive(Debug, Clone, Copy)]
struct Taking {
    gain: [f64; 3],
    gamma: f64,
    vignetting: f64,
}

/// `photo` as another camera would have taken it.
fn taken(photo: &Image, how: Taking) -> Image {
    let (w, h) = (photo.width() as f64, photo.height() as f64);
    let mut out = photo.clone();
    for (i, pixel) in out.pixels_mut().iter_mut().enumerate() {
        let (x, y) = ((i % photo.width()) as f64 - w / 2.0, (i / photo.width()) as f64 - h / 2.0);
        let falloff = 1.0 - how.vignetting * (x * x + y * y) / (w * w + h * h) * 4.0;
        for (value, gain) in pixel.iter_mut().zip(how.gain) {
            *value = level(gain * falloff * libm::pow(linear(*value), how.gamma));
        }
    }
    out
}

/// A rendered pair, warped by the true geometry.
struct Staged<'a> {
    pair: Pair<'a>,
    photos: Photos,
}

impl<'a> Staged<'a> {
    fn new(scene: &'a Scene) -> Self {
        let pair = scene.render(SIZE.0, SIZE.1);
        let photos = Photos::of(&pair, &MatchOptions { count: 0, sigma: 0.0, outliers: 0.0, seed: 1 });
        Self { pair, photos }
    }

    /// The target, taken as `how` says, in the reference's view.
    fn warped(&self, how: Option<Taking>) -> Warped {
        let mut photos = self.photos.clone();
        if let Some(how) = how {
            photos.target = taken(&photos.target, how);
        }
        let Pair { forward, reverse, .. } = &self.pair;
        // By the depth alone, so that exposure has no say in what is warped where.
        let options = WarpOptions { mode: WarpMode::BackwardVoid, ..WarpOptions::paper() };
        warp(photos.target(), photos.reference(), forward, reverse, &options, &mut ()).unwrap()
    }

    fn blend(&self, warped: &Warped, options: &BlendOptions) -> Mosaic {
        blend(warped, self.photos.reference.view(), &SeamGuide::default(), options, &mut ()).unwrap()
    }

    /// What the reference's camera would see on the whole canvas.
    fn truth(&self, scene: &Scene, warped: &Warped) -> Image {
        let (left, top) = warped.offset;
        let mut camera: Camera = self.pair.reference.camera;
        camera.k[(0, 2)] += left as f64;
        camera.k[(1, 2)] += top as f64;
        let (width, height) = warped.image.size();
        Image::new(scene.view(camera, width, height, true).rgba, width, height).unwrap()
    }
}

/// In dB, over the valid pixels of `image`.
fn psnr(image: &Image, truth: &Image) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (a, b) in pixels(image).iter().zip(pixels(truth)).filter(|(a, _)| a[3] != 0) {
        sum += (0..3).map(|c| (f64::from(a[c]) - f64::from(b[c])).powi(2)).sum::<f64>();
        count += 3.0;
    }
    10.0 * libm::log10(255.0 * 255.0 * count / sum)
}

/// The light of a mosaic where the target shows, as a share of the true one.
fn target_light(mosaic: &Mosaic, truth: &Image) -> [f64; 3] {
    let (mut shown, mut expected) = ([0.0; 3], [0.0; 3]);
    for ((a, b), &side) in pixels(&mosaic.image).iter().zip(pixels(truth)).zip(mosaic.seam.data()) {
        // What is clipped there was not as bright in the target.
        if side == 1 && b[3] != 0 && b[..3].iter().all(|v| (6..250).contains(v)) {
            for c in 0..3 {
                shown[c] += linear(a[c]);
                expected[c] += linear(b[c]);
            }
        }
    }
    [0, 1, 2].map(|c| shown[c] / expected[c])
}

#[test]
fn a_known_gain_is_found() {
    let scene = scene::gallery();
    let staged = Staged::new(&scene);
    let plain = staged.warped(None);
    let truth = staged.truth(&scene, &plain);
    for exposure in [Exposure::Gain, Exposure::Field] {
        let options = BlendOptions { exposure, ..BlendOptions::default() };
        let expected = target_light(&staged.blend(&plain, &options), &truth);
        for gain in [[1.0, 1.0, 1.0], [0.8, 0.7, 0.6], [1.3, 1.2, 1.15], [0.5, 0.9, 1.2], [0.1, 0.11, 0.1]] {
            let warped = staged.warped(Some(Taking { gain, gamma: 1.0, vignetting: 0.0 }));
            let mosaic = staged.blend(&warped, &options);
            let (found, light) = (mosaic.gains, target_light(&mosaic, &truth));
            println!("gain {gain:?} {exposure:?}: {found:?}, light of the target {light:.3?} of {expected:.3?}");
            for c in 0..3 {
                assert!((found[c] * gain[c] - 1.0).abs() < 0.01, "{gain:?} {exposure:?}: {found:?}");
                assert!((light[c] / expected[c] - 1.0).abs() < 0.1, "{gain:?} {exposure:?}: {light:?}");
            }
        }
    }
}

/// The ratio of the sums of light where both are valid and neither is clipped.
fn true_gains(plain: &Warped, warped: &Warped, reference: &Image) -> [f64; 3] {
    let usable = |pixel: &[u8; 4]| pixel[3] != 0 && pixel[..3].iter().all(|v| (6..250).contains(v));
    let (mut before, mut after) = ([0.0; 3], [0.0; 3]);
    for (i, (a, b)) in pixels(&plain.image).iter().zip(pixels(&warped.image)).enumerate() {
        let x = (i % plain.image.width()).wrapping_sub(plain.offset.0);
        let y = (i / plain.image.width()).wrapping_sub(plain.offset.1);
        if x < reference.width() && y < reference.height() && usable(a) && usable(b) {
            for c in 0..3 {
                before[c] += linear(b[c]);
                after[c] += linear(a[c]);
            }
        }
    }
    [0, 1, 2].map(|c| after[c] / before[c])
}

#[test]
fn gain_gamma_and_vignetting_are_undone() {
    let scene = scene::gallery();
    let staged = Staged::new(&scene);
    let plain = staged.warped(None);
    let truth = staged.truth(&scene, &plain);
    let uncorrected = psnr(&staged.blend(&plain, &BlendOptions::default()).image, &truth);
    println!("no difference: {uncorrected:.2} dB");
    for how in [
        Taking { gain: [0.55, 0.5, 0.45], gamma: 1.0, vignetting: 0.0 },
        Taking { gain: [0.6, 0.55, 0.5], gamma: 1.1, vignetting: 0.25 },
        Taking { gain: [0.45, 0.5, 0.55], gamma: 0.9, vignetting: 0.15 },
    ] {
        let warped = staged.warped(Some(how));
        let average = psnr(&staged.blend(&warped, &BlendOptions::paper()).image, &truth);
        let expected = true_gains(&plain, &warped, &staged.photos.reference);
        let mosaic = staged.blend(&warped, &BlendOptions::default());
        let ours = psnr(&mosaic.image, &truth);
        println!(
            "{how:?}: average {average:.2} dB, ours {ours:.2} dB, gains {expected:.3?}, found {:.3?}",
            mosaic.gains
        );
        assert!(ours > average + 6.0, "{how:?}: {ours} dB, average {average} dB");
        for (found, expected) in mosaic.gains.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 0.01, "{how:?}: {found}, not {expected}");
        }
    }
}

/// Where everything is clipped nobody knows how bright it was, or what colour: the gains of the rest must not make it gray or give it one.
#[test]
fn what_is_clipped_stays_white() {
    let scene = scene::gallery();
    let staged = Staged::new(&scene);
    let warped = staged.warped(Some(Taking { gain: [3.0, 4.5, 2.5], gamma: 1.0, vignetting: 0.0 }));
    let mosaic = staged.blend(&warped, &BlendOptions::default());
    let (left, top) = warped.offset;
    let mut darkest = Vec::new();
    for (i, (pixel, shown)) in pixels(&warped.image).iter().zip(pixels(&mosaic.image)).enumerate() {
        let (x, y) = (i % warped.image.width(), i / warped.image.width());
        let alone = x < left || y < top || x >= left + SIZE.0 || y >= top + SIZE.1;
        if alone && *pixel == [255; 4] {
            let [r, g, b, _] = shown.map(f64::from);
            darkest.push(r.min(g).min(b));
        }
    }
    let (count, darkest) = (darkest.len(), scene::median(darkest));
    println!("gains {:.2?}, {count} white pixels, darkest channel {darkest}", mosaic.gains);
    assert!(count > 200 && darkest > 251.0, "{count} pixels, {darkest}");
}

/// Squares of 8 pixels, from dark to bright.
fn squares(x: usize, y: usize) -> [u8; 4] {
    let mixed = ((x / 8 * 7919 + y / 8 * 104_729) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let gray = 30 + (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) % 200;
    [gray as u8, gray as u8, gray as u8, 255]
}

/// Two photos of the same height, the target of 500 × 300 pixels, the reference's left border `left` pixels within it, and its right one
/// 100 pixels beyond. With what the target has become.
fn side_by_side(
    left: usize,
    target: impl Fn(usize, usize) -> [u8; 4],
    reference: impl Fn(usize, usize) -> [u8; 4],
) -> (Image, Mosaic) {
    let (width, height) = (600, 300);
    let image = picture(width, height, |x, y| if x < 500 { target(x, y) } else { [0; 4] });
    let warped = warped(image.clone(), (left, 0));
    let reference = picture(width - left, height, |x, y| reference(x + left, y));
    let options = BlendOptions { seam: Seam::Cut, ..BlendOptions::default() };
    let mosaic = blend(&warped, reference.view(), &SeamGuide::default(), &options, &mut ()).unwrap();
    (image, mosaic)
}

/// A warmer target whose red is clipped: where only that shows, gray does not turn cyan as red is darkened.
#[test]
fn a_clipped_channel_does_not_tint() {
    let warm = |x, y| {
        let [r, g, b, _] = squares(x, y).map(f32::from);
        [r * 1.35, g, b * 0.65, 255.0].map(|v| v as u8)
    };
    let (image, mosaic) = side_by_side(200, warm, squares);
    let mut clipped = 0;
    for (i, (before, after)) in pixels(&image).iter().zip(pixels(&mosaic.image)).enumerate() {
        if i % image.width() < 150 && before[0] == 255 {
            let [r, g, b, _] = after.map(i32::from);
            assert!(r >= g.min(b) - 3, "{before:?} became {after:?}");
            clipped += 1;
        }
    }
    assert!(clipped > 1000, "{clipped}");
}

/// Where photos are misaligned, what is bright in one mostly is less so in the other, and the other way round. That is no difference in
/// exposure: what only the target shows stays as it is.
#[test]
fn misalignment_changes_neither_brightness_nor_contrast() {
    let (left, misaligned) = (200, 24);
    let (image, mosaic) = side_by_side(left, squares, |x, y| squares(x + misaligned, y + misaligned));
    let mut changes = Vec::new();
    for (i, (before, after)) in pixels(&image).iter().zip(pixels(&mosaic.image)).enumerate() {
        if i % image.width() < left / 2 {
            changes.push((f64::from(before[1]) - f64::from(after[1])).abs());
        }
    }
    let change = scene::median(changes);
    println!("gains {:.3?}, {change} levels", mosaic.gains);
    assert!(change <= 3.0, "{change} levels");
}

/// Something in front of the scene that the reference's camera sees in another place, or not at all, is no difference in exposure either:
/// it gives little colour to what is gray around it, and makes it neither much darker nor much brighter.
#[test]
fn what_one_photo_shows_alone_hardly_colours_its_surroundings() {
    for (name, [r, g, b]) in [("blue", [40, 60, 200]), ("red", [200, 30, 30]), ("dark", [12, 12, 12])] {
        let [red, green, blue] = [r, g, b].map(|full| move |gray: u8| (u32::from(gray) * full / 230) as u8);
        let in_front = |x: usize, y: usize| {
            let [gray, ..] = squares(x, y);
            if (100..200).contains(&x) { [red(gray), green(gray), blue(gray), 255] } else { [gray, gray, gray, 255] }
        };
        // Misaligned, so that no sample agrees with another.
        let (image, mosaic) = side_by_side(100, in_front, |x, y| squares(x + 24, y + 24));
        let (mut tints, mut ratios) = (Vec::new(), Vec::new());
        for (i, (before, after)) in pixels(&image).iter().zip(pixels(&mosaic.image)).enumerate() {
            if i % image.width() < 100 {
                let [r, g, b, _] = after.map(f64::from);
                tints.push(r.max(g).max(b) - r.min(g).min(b));
                ratios.push(linear(after[1]) / linear(before[1]));
            }
        }
        let (tint, ratio) = (scene::median(tints), scene::median(ratios));
        println!("{name}: {tint} levels apart, green {ratio:.2} times as bright, gains {:.2?}", mosaic.gains);
        assert!(tint <= 35.0, "{name}: {tint} levels");
        assert!(ratio > 0.4 && ratio < 2.4, "{name}: {ratio}");
    }
}

/// A target that is brightened would be white where only it shows something bright: a sky at dusk keeps its clouds.
#[test]
fn brightened_highlights_keep_their_contrast_outside_of_the_reference() {
    let dimmed = |gray: u8| level(0.5 * linear(gray));
    let clouds = |x: usize, y: usize| if (x / 8 + y / 8).is_multiple_of(2) { 205 } else { 240 };
    let target = |x: usize, y: usize| {
        let [gray, ..] = squares(x, y);
        let gray = if x < 100 { clouds(x, y) } else { dimmed(gray) };
        [gray, gray, gray, 255]
    };
    let (image, mosaic) = side_by_side(100, target, squares);
    let (mut dark, mut bright) = (Vec::new(), Vec::new());
    for (i, after) in pixels(&mosaic.image).iter().enumerate() {
        let (x, y) = (i % image.width(), i / image.width());
        if x < 20 {
            if clouds(x, y) == 205 { &mut dark } else { &mut bright }.push(f64::from(after[1]));
        }
    }
    let [dark, bright] = [dark, bright].map(scene::median);
    println!("gains {:.2?}, {dark} and {bright}", mosaic.gains);
    assert!(mosaic.gains[1] > 1.9 && bright > dark + 5.0, "{dark} and {bright}");
}
