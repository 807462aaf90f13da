//! Large photos alone are aligned at half their size, or a quarter: only a smooth surface is made of the depth that is found, and time and memory of
//! finding it grow with the pixels.

use std::borrow::Cow;

use nalgebra::Matrix3;

use super::align::Alignment;
use super::options::{Options, WithoutDepth};
use super::picture::Size;
use crate::depth::RefineOptions;
use crate::features::Features;
use crate::geometry::{Estimate, EstimateOptions, Match, Model, Threshold};
use crate::image::{reserve, zeroed};
use crate::report::Warning;
use crate::upsampling::{WEIGHTS, neighbours};
use crate::{Image, ImageView, InverseDepth, Result, View};

/// Photos that both have more pixels are halved until one has no more: 12 MP are aligned at 3, 24 MP at 6.
const MOST: u64 = 7_000_000;

/// Whether two photos of these sizes are halved once more. `alone`: without depth maps.
pub(super) fn is_halved(photos: [Size; 2], alone: bool, options: &Options) -> bool {
    options.without_depth == WithoutDepth::TwoView && are_halved(&photos, alone, options)
}

/// Whether photos of these sizes, whose depth is found where there is none, are halved once more.
pub(super) fn are_halved(photos: &[Size], alone: bool, options: &Options) -> bool {
    let large = |&(width, height): &Size| width as u64 * height as u64 > MOST;
    alone && options.refine.is_some() && photos.iter().all(large)
}

/// How many times as wide and high photos were before so many halvings.
pub(super) fn factor(halvings: u32) -> f64 {
    f64::from(1u32 << halvings)
}

/// Of an odd side the last pixel counts twice.
pub(super) fn half_size((width, height): Size) -> Size {
    (width.div_ceil(2), height.div_ceil(2))
}

/// Two photos, halved once or more. Of photos at 1/n of their size, pixel x is at nx + (n − 1)/2 of the photos as they were.
pub(super) struct Halved {
    photos: [Image; 2],
    /// Sizes before each halving, the photos' own first.
    sizes: Vec<[Size; 2]>,
}

impl Halved {
    /// `None` of photos that are aligned as they are.
    pub fn of(views: [View<'_>; 2], options: &Options) -> Result<Option<Self>> {
        let alone = views.iter().all(|view| view.depth.is_none());
        let (mut sizes, mut size) = (Vec::new(), views.map(|view| view.image.size()));
        let mut photos: Option<[Image; 2]> = None;
        while is_halved(size, alone, options) {
            let [target, reference] = match &photos {
                Some(photos) => photos.each_ref().map(Image::view),
                None => views.map(|view| view.image),
            };
            photos = Some([half(target)?, half(reference)?]);
            sizes.push(size);
            size = size.map(half_size);
        }
        Ok(photos.map(|photos| Self { photos, sizes }))
    }

    /// How many times as wide and high the photos were.
    fn factor(&self) -> f64 {
        factor(self.sizes.len() as u32)
    }

    /// The photos.
    pub fn views(&self) -> [View<'_>; 2] {
        self.photos.each_ref().map(|photo| View { image: photo.view(), depth: None })
    }

    /// Matches of the photos as they were, in pixels of these.
    pub fn matches(&self, matches: &[Match]) -> Result<Vec<Match>> {
        let factor = self.factor();
        moved(matches, &|at| (at + 0.5) / factor - 0.5)
    }

    /// Features of the photos as they were, in pixels of these.
    pub fn features(&self, mut features: [Features; 2]) -> [Features; 2] {
        let factor = self.factor() as f32;
        for (features, photo) in features.iter_mut().zip(&self.photos) {
            for keypoint in &mut features.keypoints {
                keypoint.x = (keypoint.x + 0.5) / factor - 0.5;
                keypoint.y = (keypoint.y + 0.5) / factor - 0.5;
                keypoint.scale /= factor;
            }
            features.size = photo.size();
        }
        features
    }

    /// Options, whose lengths are in pixels of these.
    pub fn options(&self, options: &Options) -> Options {
        reduced_options(options, self.factor())
    }

    /// The alignment of the photos as they were. Without depth maps given, nothing but a smooth surface or a homography is found: no
    /// depth is reliable pixel by pixel.
    pub fn enlarged(&self, found: Alignment<'_>) -> Result<Alignment<'static>> {
        let Alignment { matches, mut geometry, depth: [target, reference], prediction_error, smooth, .. } = found;
        let factor = self.factor();
        enlarge(&mut geometry, factor);
        let map = |map: Option<Cow<'_, InverseDepth>>, side: usize| -> Result<Option<Cow<'static, InverseDepth>>> {
            let Some(map) = map else { return Ok(None) };
            let mut map = map.into_owned();
            for sizes in self.sizes.iter().rev() {
                map = enlarged_map(&map, sizes[side])?;
            }
            Ok(Some(Cow::Owned(map)))
        };
        Ok(Alignment {
            matches: matches.map(|matches| moved(&matches, &|at| factor * (at + 0.5) - 0.5)).transpose()?,
            geometry,
            depth: [map(target, 0)?, map(reference, 1)?],
            missing: None,
            reliable: None,
            prediction_error: prediction_error.map(|error| error.map(|pixels| factor * pixels)),
            smooth,
        })
    }
}

/// Options, whose lengths are in pixels of photos at 1/`factor` of their size.
pub(super) fn reduced_options(options: &Options, factor: f64) -> Options {
    let threshold = match options.estimate.threshold {
        Threshold::Pixels(pixels) => Threshold::Pixels(pixels / factor),
        normalised => normalised,
    };
    let focal = options.estimate.focal.map(|focal| focal / factor);
    let refine = options.refine.map(|refine| RefineOptions { range: refine.range.map(|range| range / factor) });
    Options { estimate: EstimateOptions { threshold, focal, ..options.estimate.clone() }, refine, ..options.clone() }
}

/// The mean of each four pixels, masked where one of them is.
pub(super) fn half(photo: ImageView<'_>) -> Result<Image> {
    let ((width, height), (columns, rows)) = (photo.size(), half_size(photo.size()));
    let mut out = Image::transparent(columns, rows)?;
    for (y, out) in out.pixels_mut().chunks_exact_mut(columns).enumerate() {
        let row = |y: usize| &photo.pixels()[y.min(height - 1) * width..][..width];
        let pairs = row(2 * y).chunks(2).zip(row(2 * y + 1).chunks(2));
        for (out, (above, below)) in out.iter_mut().zip(pairs) {
            let four = [above[0], above[above.len() - 1], below[0], below[below.len() - 1]];
            let mean = |c: usize| ((four.iter().map(|pixel| u16::from(pixel[c])).sum::<u16>() + 2) / 4) as u8;
            let alpha = four.iter().fold(u8::MAX, |least, pixel| least.min(pixel[3]));
            *out = [mean(0), mean(1), mean(2), alpha];
        }
    }
    Ok(out)
}

fn moved(matches: &[Match], place: &dyn Fn(f64) -> f64) -> Result<Vec<Match>> {
    let mut out = Vec::new();
    reserve(&mut out, matches.len())?;
    out.extend(matches.iter().map(|m| Match { target: m.target.map(place), reference: m.reference.map(place) }));
    Ok(out)
}

/// Takes the geometry of photos at 1/`factor` of their size to that of the photos as they were.
fn enlarge(geometry: &mut Estimate, factor: f64) {
    let scaled = |factor: f64| {
        let shift = 0.5 * (factor - 1.0);
        Matrix3::new(factor, 0.0, shift, 0.0, factor, shift, 0.0, 0.0, 1.0)
    };
    let (grow, shrink) = (scaled(factor), scaled(1.0 / factor));
    for model in [&mut geometry.forward, &mut geometry.reverse] {
        *model = Model { h: grow * model.h * shrink, e: grow * model.e };
    }
    geometry.threshold *= factor;
    geometry.residual = geometry.residual.map(|pixels| factor * pixels);
    geometry.focal = geometry.focal.map(|pixels| factor * pixels);
    for warning in &mut geometry.warnings {
        if let Warning::ThresholdWidened { threshold } = warning {
            *threshold *= factor;
        }
    }
}

/// A map of twice the size, bilinear.
fn enlarged_map(map: &InverseDepth, (width, height): Size) -> Result<InverseDepth> {
    let (columns, rows) = map.size();
    let mut line: Vec<f32> = zeroed(columns)?;
    let mut out = Vec::new();
    reserve(&mut out, width * height)?;
    let between = |[near, far]: [f32; 2]| WEIGHTS[0] * near + WEIGHTS[1] * far;
    for y in 0..height {
        let [near, far] = neighbours(y, rows).map(|y| &map.data()[y * columns..][..columns]);
        line.iter_mut().zip(near).zip(far).for_each(|((line, near), far)| *line = between([*near, *far]));
        out.extend((0..width).map(|x| between(neighbours(x, columns).map(|x| line[x]))));
    }
    Ok(InverseDepth::from_values(out, width, height))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Vector3;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn pixels_there_are_four_here() {
        let pixels: Vec<u8> = (0..15u8).flat_map(|i| [i, 2 * i, 100, if i == 0 { 0 } else { 255 }]).collect();
        let photo = Image::new(pixels, 5, 3).unwrap();
        let half = half(photo.view()).unwrap();
        assert_eq!(half.size(), (3, 2));
        // 0, 1, 5, 6; of the last column 4, 9 and of the last row 10, 11 count twice.
        assert_eq!(
            half.pixels(),
            [
                [3, 6, 100, 0],
                [5, 10, 100, 255],
                [7, 13, 100, 255],
                [11, 21, 100, 255],
                [13, 25, 100, 255],
                [14, 28, 100, 255]
            ]
        );
    }

    #[test]
    fn a_model_of_halved_photos_leads_to_the_same_places() {
        let h = Matrix3::new(1.1, 0.02, 5.0, -0.03, 0.9, -7.0, 1e-4, 2e-4, 1.0);
        let model = Model { h, e: Vector3::new(3.0, -2.0, 0.001) };
        let mut geometry = Estimate {
            forward: model,
            reverse: model.inverse().unwrap(),
            inliers: Vec::new(),
            kind: crate::geometry::ModelKind::TwoView,
            usable: 0,
            tracked: 0,
            threshold: 1.5,
            trials: 0,
            residual: [0.25; 2],
            focal: Some(400.0),
            comparison: None,
            warnings: Vec::new(),
        };
        enlarge(&mut geometry, 4.0);
        let place = |v: f64| 4.0 * v + 1.5;
        let [x, y] = geometry.forward.project(place(30.0), place(40.0), 0.7).unwrap();
        let [u, v] = model.project(30.0, 40.0, 0.7).unwrap();
        assert!((x - place(u)).abs() < 1e-9 && (y - place(v)).abs() < 1e-9, "{x} {y}");
        let back = geometry.forward.inverse().unwrap();
        assert!((back.h - geometry.reverse.h).norm() < 1e-9 && (back.e - geometry.reverse.e).norm() < 1e-9);
        assert_eq!((geometry.threshold, geometry.residual, geometry.focal), (6.0, [1.0; 2], Some(1600.0)));
    }

    #[test]
    fn photos_are_halved_until_they_are_small() {
        let photos = [(6001, 4700), (5900, 4800)].map(|(width, height)| Image::transparent(width, height).unwrap());
        let views = photos.each_ref().map(|photo| View { image: photo.view(), depth: None });
        let halved = Halved::of(views, &Options::default()).unwrap().unwrap();
        assert_eq!(halved.views().map(|view| view.image.size()), [(1501, 1175), (1475, 1200)]);
        assert_eq!(halved.sizes, [[(6001, 4700), (5900, 4800)], [(3001, 2350), (2950, 2400)]]);
        // Pixels 400 to 403 of the photo are pixel 100 there.
        let at = halved.matches(&[Match { target: [401.5, 801.5], reference: [1.5, 5.5] }]).unwrap();
        assert_eq!(at, [Match { target: [100.0, 200.0], reference: [0.0, 1.0] }]);
    }

    #[test]
    fn a_plane_stays_the_plane_it_is() {
        let values = (0..12).map(|i| (i % 4) as f32 + 10.0 * (i / 4) as f32).collect();
        let map = enlarged_map(&InverseDepth::from_values(values, 4, 3), (7, 6)).unwrap();
        for (x, y) in (1..5).flat_map(|y| (1..7).map(move |x| (x, y))) {
            let (u, v) = (0.5 * x as f32 - 0.25, 0.5 * y as f32 - 0.25);
            assert!((map.data()[7 * y + x] - u - 10.0 * v).abs() < 1e-5);
        }
    }
}
