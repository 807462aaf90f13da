//! Masked pixels of photos: see [`ImageView`].

use crate::components::neighbours;
use crate::distance::distance;
use crate::image::{LEAST_ALPHA, reserve, reserve_more};
use crate::{Error, Image, ImageView, InverseDepth, Mask, Result, View};

/// While colours are extended, alpha says what is known of a pixel: of the photo, or extended from it.
const OPAQUE: u8 = 255;
const EXTENDED: u8 = 2;
const NEXT: u8 = 1;
const UNKNOWN: u8 = 0;

/// A photo with masked pixels, its colours extended into them, and its depth, which is not known there either.
#[derive(Debug, Clone)]
pub(crate) struct Extended {
    image: Image,
    depth: Option<InverseDepth>,
}

impl Extended {
    /// `None` of a photo without masked pixels.
    ///
    /// Whatever colours and depth are beneath transparent pixels, all that is made of the result is the same. Alpha is 0 or 255.
    ///
    /// # Errors
    /// `invalid-argument` where nothing is there: `name` is how the error calls the photo.
    pub fn of(view: View<'_>, name: &'static str) -> Result<Option<Self>> {
        if !view.image.is_masked() {
            return Ok(None);
        }
        let (width, height) = view.image.size();
        let mut image = Image::transparent(width, height)?;
        let mut there = false;
        for (out, &[r, g, b, alpha]) in image.pixels_mut().iter_mut().zip(view.image.pixels()) {
            if alpha >= LEAST_ALPHA {
                (*out, there) = ([r, g, b, OPAQUE], true);
            }
        }
        if !there {
            let pixels = view.image.pixels().len() as u64;
            return Err(Error::TransparentPhoto { name, pixels }.into());
        }
        let pixels = image.pixels();
        let of = |depth: &InverseDepth| {
            depth.map_indexed(|i, d| if pixels.get(i).is_some_and(|p| p[3] == 0) { f32::NAN } else { d })
        };
        let depth = view.depth.map(of).transpose()?;
        Self::new(image, depth).map(Some)
    }

    /// Of a photo whose pixels are opaque or masked, and depth that is known of the former alone.
    pub fn new(mut image: Image, depth: Option<InverseDepth>) -> Result<Self> {
        extend_colours(&mut image)?;
        Ok(Self { image, depth })
    }

    /// Both.
    pub fn as_view(&self) -> View<'_> {
        View { image: self.image.view(), depth: self.depth.as_ref() }
    }

    /// The photo.
    pub fn into_image(self) -> Image {
        self.image
    }

    /// It, or the photo itself where none of that is masked.
    pub fn view<'a>(extended: &'a Option<Self>, photo: View<'a>) -> View<'a> {
        match extended {
            Some(extended) => extended.as_view(),
            None => photo,
        }
    }
}

/// Fills the empty pixels from their surroundings inwards, each with the mean of those neighbours that are nearer to the outside; alpha
/// stays.
fn extend_colours(image: &mut Image) -> Result<()> {
    let width = image.width();
    let pixels = image.pixels_mut();
    let (mut front, mut next): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
    for at in 0..pixels.len() {
        let beside = |other: &usize| pixels.get(*other).is_some_and(|pixel| pixel[3] == OPAQUE);
        if pixels[at][3] == UNKNOWN && neighbours(at, width).iter().any(beside) {
            pixels[at][3] = NEXT;
            reserve_more(&mut front, 1)?;
            front.push(at as u32);
        }
    }
    while !front.is_empty() {
        for &at in &front {
            let known = neighbours(at as usize, width).into_iter().filter_map(|other| pixels.get(other));
            let (mut sum, mut count) = ([0u32; 3], 0);
            for [r, g, b, _] in known.filter(|pixel| pixel[3] >= EXTENDED) {
                sum = [sum[0] + u32::from(*r), sum[1] + u32::from(*g), sum[2] + u32::from(*b)];
                count += 1;
            }
            // There is one at least: it was reached from there.
            let [r, g, b] = sum.map(|sum| ((sum + count / 2) / count.max(1)) as u8);
            pixels[at as usize] = [r, g, b, NEXT];
        }
        for &at in &front {
            pixels[at as usize][3] = EXTENDED;
            for other in neighbours(at as usize, width) {
                if let Some(pixel) = pixels.get_mut(other).filter(|pixel| pixel[3] == UNKNOWN) {
                    pixel[3] = NEXT;
                    reserve_more(&mut next, 1)?;
                    next.push(other as u32);
                }
            }
        }
        std::mem::swap(&mut front, &mut next);
        next.clear();
    }
    pixels.iter_mut().filter(|pixel| pixel[3] != OPAQUE).for_each(|pixel| pixel[3] = 0);
    Ok(())
}

/// The masked pixels that hang together with the photo's border: there the photo ends, while others are holes in it. `None`
/// of a photo without masked pixels.
pub(crate) fn outside(photo: ImageView<'_>) -> Result<Option<Mask>> {
    if !photo.is_masked() {
        return Ok(None);
    }
    let (width, height) = photo.size();
    let mut mask = Mask::empty(width, height)?;
    let marks = mask.data_mut();
    let missing = |at: usize| photo.pixels().get(at).is_some_and(|&pixel| !photo.is_there(pixel));
    let mut reached: Vec<u32> = Vec::new();
    reserve(&mut reached, photo.pixels().iter().filter(|pixel| !photo.is_there(**pixel)).count())?;
    let sides = (0..height).flat_map(|y| [y * width, (y + 1) * width - 1]);
    for at in (0..width).chain((height - 1) * width..height * width).chain(sides) {
        if missing(at) && marks[at] == 0 {
            marks[at] = 255;
            reached.push(at as u32);
        }
    }
    while let Some(at) = reached.pop() {
        for other in neighbours(at as usize, width) {
            if missing(other) && marks[other] == 0 {
                marks[other] = 255;
                reached.push(other as u32);
            }
        }
    }
    Ok(Some(mask))
}

/// Distance of every pixel from the nearest masked one, as [`distance`] counts it; `None` of a photo without any.
pub(crate) fn distance_to_missing(photo: ImageView<'_>) -> Result<Option<Vec<u16>>> {
    if !photo.is_masked() {
        return Ok(None);
    }
    let pixels = photo.pixels();
    distance(pixels.len(), photo.width(), &|at| !photo.is_there(pixels[at])).map(Some)
}
