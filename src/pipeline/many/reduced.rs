//! Photos at a fraction of their size: at half of it large ones are aligned, and all are drawn where a larger picture would take too much memory.

use super::ManyOptions;
use super::result::Photo;
use crate::image::reserve;
use crate::pipeline::halved::{factor, half, half_size, reduced_options};
use crate::pipeline::picture::Size;
use crate::{Image, ImageView, InverseDepth, Result};

/// No side becomes shorter.
const SHORTEST: usize = 120;

/// The size of a photo after so many halvings.
fn reduced_size(size: Size, halvings: u32) -> Size {
    (0..halvings).fold(size, |size, _| half_size(size))
}

/// The same of many.
pub(super) fn reduced_sizes(sizes: &[Size], halvings: u32) -> Vec<Size> {
    sizes.iter().map(|&size| reduced_size(size, halvings)).collect()
}

/// Whether photos of these sizes can be halved so often.
pub(super) fn can_be_halved(sizes: &[Size], halvings: u32) -> bool {
    let side = |&(width, height): &Size| width.min(height) >> halvings;
    sizes.iter().all(|size| side(size) >= SHORTEST)
}

/// Options, whose lengths are in pixels of photos that were halved so often.
pub(super) fn options_for(options: &ManyOptions, halvings: u32) -> ManyOptions {
    ManyOptions { stages: reduced_options(&options.stages, factor(halvings)), ..options.clone() }
}

/// Photos that were halved once or more, or not at all: then they are those given.
pub(super) struct ReducedPhotos {
    pub halvings: u32,
    photos: Vec<(Image, Option<InverseDepth>)>,
}

impl ReducedPhotos {
    /// # Errors
    /// `out-of-memory`.
    pub fn of(given: &[Photo<'_>], halvings: u32) -> Result<Self> {
        let photos = if halvings == 0 { &[] } else { given };
        let one = |photo: &Photo<'_>| {
            let image = reduced_image(photo.image, halvings)?;
            let depth = photo.depth.map(|depth| resampled(depth, image.size(), 1.0 / factor(halvings))).transpose()?;
            Ok((image, depth))
        };
        Ok(Self { halvings, photos: photos.iter().map(one).collect::<Result<_>>()? })
    }

    /// Makes room before others are made.
    ///
    /// # Errors
    /// `out-of-memory`.
    pub fn replace(&mut self, given: &[Photo<'_>], halvings: u32) -> Result<()> {
        self.photos = Vec::new();
        *self = Self::of(given, halvings)?;
        Ok(())
    }

    /// As photos, of those `given`.
    pub fn photos<'a>(&'a self, given: &[Photo<'a>]) -> Vec<Photo<'a>> {
        if self.halvings == 0 {
            return given.to_vec();
        }
        let one = |((image, depth), photo): (&'a (Image, Option<InverseDepth>), &Photo<'a>)| Photo {
            image: image.view(),
            depth: depth.as_ref(),
            focal: photo.focal.map(|focal| focal / factor(self.halvings)),
            ..*photo
        };
        self.photos.iter().zip(given).map(one).collect()
    }
}

fn reduced_image(photo: ImageView<'_>, halvings: u32) -> Result<Image> {
    let first = half(photo)?;
    (1..halvings).try_fold(first, |photo, _| half(photo.view()))
}

/// Depth of a photo that is `factor` times as large and has this size, around the same middle; unknown next to what is. Beyond the frame it goes on as at
/// its border.
pub(super) fn resampled(map: &InverseDepth, size: Size, factor: f64) -> Result<InverseDepth> {
    let (width, height) = size;
    let place = |at: usize, to: usize, from: usize| {
        let middle = |side: usize| 0.5 * (side as f64 - 1.0);
        middle(from) + (at as f64 - middle(to)) / factor
    };
    let mut values = Vec::new();
    reserve(&mut values, width * height)?;
    for y in 0..height {
        let v = place(y, height, map.height());
        values.extend((0..width).map(|x| map.sample(place(x, width, map.width()), v) as f32));
    }
    Ok(InverseDepth::from_values(values, width, height))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn a_plane_stays_the_plane_it_is() {
        let values = (0..12 * 8).map(|i| (i % 12) as f32 + 10.0 * (i / 12) as f32).collect();
        let map = InverseDepth::from_values(values, 12, 8);
        // Four pixels are at 2x + ½, and a frame may be cut.
        for (size, factor, [left, top]) in
            [((6, 4), 0.5, [0.5, 0.5]), ((24, 16), 2.0, [-0.25, -0.25]), ((20, 12), 2.0, [0.75, 0.75])]
        {
            let resized = resampled(&map, size, factor).unwrap();
            for (x, y) in (1..size.1 - 1).flat_map(|y| (1..size.0 - 1).map(move |x| (x, y))) {
                let (u, v) = (left + x as f32 / factor as f32, top + y as f32 / factor as f32);
                assert!((resized.data()[size.0 * y + x] - u - 10.0 * v).abs() < 1e-4, "{size:?}: {x} {y}");
            }
        }
    }

    #[test]
    fn photos_are_halved_with_what_is_known_of_them() {
        let image = Image::transparent(403, 300).unwrap();
        let depth = InverseDepth::constant(2.0, 403, 300).unwrap();
        let given = [Photo { focal: Some(400.0), depth: Some(&depth), ..Photo::new(image.view()) }];
        let reduced = ReducedPhotos::of(&given, 1).unwrap();
        let [photo] = reduced.photos(&given)[..] else { unreachable!() };
        assert_eq!((photo.image.size(), photo.focal), ((202, 150), Some(200.0)));
        assert_eq!(photo.depth.unwrap(), &InverseDepth::constant(2.0, 202, 150).unwrap());
        assert_eq!(reduced_sizes(&[(403, 300)], 2), [(101, 75)]);
        assert!(can_be_halved(&[(403, 300)], 1) && !can_be_halved(&[(403, 300), (400, 230)], 1));
    }
}
