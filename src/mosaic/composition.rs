//! Many photos on one canvas, added one after another.
//!
//! What is there already plays the part of the reference: each photo's exposure is matched to it, a minimum cut decides
//! where the photo shows, and bands are blended across the cut. Only the surroundings of the photo are looked at, so that
//! the work is in proportion to the photos, not to the canvas times their number.

use super::average::opaque_or_empty;
use super::blend::{BlendOptions, compose};
use super::canvas::Placed;
use super::seam;
use crate::image::{check_size, filled};
use crate::observer::{Observer, report};
use crate::rect::{Rect, bounding_box, extent};
use crate::warp::Warped;
use crate::{Image, ImageView, InverseDepth, Mask, Result, Stage};

/// Photos on one canvas.
#[derive(Debug, Clone, PartialEq)]
pub struct Composition {
    /// RGBA, alpha 255 where any photo is valid, 0 (and black) elsewhere.
    pub image: Image,
    /// Which photo shows: 0 none, otherwise the label that it was added with.
    pub labels: Mask,
    /// Where any photo was drawn, valid or not.
    pub footprint: Mask,
    /// Canvas position of the reference's top left pixel.
    pub offset: (usize, usize),
    /// Inverse depth of what shows, in the reference's frame, NaN where it is not known; `None` if it is not wanted. It guides
    /// the filling.
    pub depth: Option<InverseDepth>,
    /// Bands of the pyramid where [`BlendOptions::bands`] is 0.
    bands: u32,
}

/// What became of a photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Added {
    /// What its red, green and blue were multiplied by in linear light, on average over the overlap.
    pub gains: [f64; 3],
    /// Pixels that both it and the mosaic before it covered.
    pub overlap: usize,
    /// The smallest rectangle around it, from the reference's top left pixel.
    pub extent: [i64; 4],
}

impl Composition {
    /// The reference alone, under this label. With its inverse `depth` that of the composition is kept.
    ///
    /// # Errors
    /// `size-mismatch` for depth of another size, `out-of-memory`.
    pub fn of(reference: ImageView<'_>, depth: Option<&InverseDepth>, label: u8) -> Result<Self> {
        let (width, height) = reference.size();
        if let Some(depth) = depth {
            check_size("depth", depth.size(), (width, height))?;
        }
        let mut image = Image::transparent(width, height)?;
        for (pixel, &[r, g, b, _]) in image.pixels_mut().iter_mut().zip(reference.pixels()) {
            *pixel = [r, g, b, 255];
        }
        let mut labels = Mask::empty(width, height)?;
        labels.data_mut().fill(label);
        let mut footprint = Mask::empty(width, height)?;
        footprint.data_mut().fill(255);
        // As of two photos.
        let bands = (width.max(height) / 32).max(2).ilog2();
        Ok(Self { image, labels, footprint, offset: (0, 0), depth: depth.cloned(), bands })
    }

    /// The canvas (width, height) that this and a photo warped onto it would take together.
    pub fn size_with(&self, warped: &Warped) -> (usize, usize) {
        let (left, top) = (self.offset.0.max(warped.offset.0), self.offset.1.max(warped.offset.1));
        let right = (self.image.width() - self.offset.0).max(warped.image.width() - warped.offset.0);
        let bottom = (self.image.height() - self.offset.1).max(warped.image.height() - warped.offset.1);
        (left + right, top + bottom)
    }

    /// Adds a photo warped into the reference's view. `None` when nothing of it is visible.
    ///
    /// # Errors
    /// `size-mismatch` for a footprint of another size than the picture's, `out-of-memory`, `aborted`.
    pub fn add(
        &mut self,
        warped: &Warped,
        label: u8,
        options: &BlendOptions,
        observer: &mut dyn Observer,
    ) -> Result<Option<Added>> {
        let size = warped.image.size();
        check_size("footprint", warped.footprint.size(), size)?;
        report(observer, Stage::Blend, 0.0)?;
        let drawn = |y: usize| {
            let row = y * size.0..(y + 1) * size.0;
            extent(warped.image.pixels()[row].iter().map(|pixel| pixel[3] != 0))
        };
        let Some(bounds) = bounding_box(size.1, drawn) else { return Ok(None) };
        self.grow(warped)?;
        // Where the warped picture's canvas lies on this one.
        let (left, top) = (self.offset.0 - warped.offset.0, self.offset.1 - warped.offset.1);
        let bands = if options.bands == 0 { self.bands } else { options.bands };
        let own = Rect { x: bounds.x + left, y: bounds.y + top, ..bounds };
        let window = own.grown(3 << bands, self.image.size());

        let before = self.cut_out(window)?;
        let placed = Placed { photo: before.view(), left: 0, top: 0, masked: true };
        let (mut image, confidence) = cut_warped(warped, window, (left, top))?;
        let mut shown = seam::sides(&image, &placed)?;
        let overlap = shown.data().iter().filter(|side| **side == 3).count();
        let reliability = seam::Reliability { reliable: None, confidence: confidence.as_ref() };
        let options = BlendOptions { bands, ..options.clone() };
        let gains = compose(&mut image, &mut shown, &placed, &reliability, &options, observer)?;
        self.paste(&image, &shown, window, label);
        self.paste_depth(warped, &shown, window, (left, top));
        self.add_footprint(warped, (left, top));
        report(observer, Stage::Blend, 1.0)?;
        let from = |at: usize, offset: usize| at as i64 - offset as i64;
        let (x, y) = (from(bounds.x, warped.offset.0), from(bounds.y, warped.offset.1));
        Ok(Some(Added { gains, overlap, extent: [x, y, bounds.width as i64, bounds.height as i64] }))
    }

    /// Pixels inside of the photos' footprints that none of them shows.
    ///
    /// # Errors
    /// `out-of-memory`.
    pub fn voids(&self) -> Result<Mask> {
        let mut voids = Mask::empty(self.image.width(), self.image.height())?;
        let marks = self.footprint.data().iter().zip(self.labels.data());
        for (void, (&drawn, &label)) in voids.data_mut().iter_mut().zip(marks) {
            *void = if drawn != 0 && label == 0 { 255 } else { 0 };
        }
        Ok(voids)
    }

    /// Makes room for a photo.
    fn grow(&mut self, warped: &Warped) -> Result<()> {
        let (width, height) = self.size_with(warped);
        if (width, height) == self.image.size() {
            return Ok(());
        }
        let offset = (self.offset.0.max(warped.offset.0), self.offset.1.max(warped.offset.1));
        let (left, top) = (offset.0 - self.offset.0, offset.1 - self.offset.1);
        let place = (left, top, width, height);
        let size = self.image.size();
        self.image = Image::from_bytes(moved(self.image.data(), size, 4, (0, place))?, width, height);
        self.labels = Mask::from_bytes(moved(self.labels.data(), size, 1, (0, place))?, width, height);
        self.footprint = Mask::from_bytes(moved(self.footprint.data(), size, 1, (0, place))?, width, height);
        if let Some(depth) = &mut self.depth {
            let values = moved(depth.data(), size, 1, (f32::NAN, place))?;
            *depth = InverseDepth::from_values(values, width, height);
        }
        self.offset = offset;
        Ok(())
    }

    /// A window of the mosaic.
    fn cut_out(&self, window: Rect) -> Result<Image> {
        let mut out = Image::transparent(window.width, window.height)?;
        let rows = self.image.pixels().chunks_exact(self.image.width()).skip(window.y);
        for (to, from) in out.pixels_mut().chunks_exact_mut(window.width).zip(rows) {
            to.copy_from_slice(&from[window.x..window.x + window.width]);
        }
        Ok(out)
    }

    /// Puts a blended window in its place.
    fn paste(&mut self, image: &Image, shown: &Mask, window: Rect, label: u8) {
        let width = self.image.width();
        let sources = image.pixels().chunks_exact(window.width).zip(shown.data().chunks_exact(window.width));
        for (y, (pixels, shown)) in sources.enumerate() {
            let at = (window.y + y) * width + window.x;
            self.image.pixels_mut()[at..at + window.width].copy_from_slice(pixels);
            let labels = self.labels.data_mut()[at..at + window.width].iter_mut();
            labels.zip(shown).filter(|(_, shown)| **shown == 1).for_each(|(own, _)| *own = label);
        }
    }

    /// The depth of the photo where it shows in a window; its own canvas lies at (left, top).
    fn paste_depth(&mut self, warped: &Warped, shown: &Mask, window: Rect, (left, top): (usize, usize)) {
        let (Some(own), Some(depth)) = (self.depth.take(), &warped.depth) else { return };
        let (width, height) = own.size();
        let mut values = own.into_values();
        for (i, _) in shown.data().iter().enumerate().filter(|(_, shown)| **shown == 1) {
            let (x, y) = (window.x + i % window.width, window.y + i / window.width);
            // Where the photo shows, its canvas reaches.
            values[y * width + x] = depth.data()[(y - top) * depth.width() + x - left];
        }
        self.depth = Some(InverseDepth::from_values(values, width, height));
    }

    fn add_footprint(&mut self, warped: &Warped, (left, top): (usize, usize)) {
        let width = self.image.width();
        let rows = warped.footprint.data().chunks_exact(warped.footprint.width());
        for (own, drawn) in self.footprint.data_mut().chunks_exact_mut(width).skip(top).zip(rows) {
            own[left..].iter_mut().zip(drawn).for_each(|(own, &drawn)| *own |= drawn);
        }
    }
}

/// `data` of this size, so many numbers a pixel, on a larger canvas (left, top, width, height) of a value.
fn moved<T: Copy>(
    data: &[T],
    size: (usize, usize),
    count: usize,
    (empty, (left, top, width, height)): (T, (usize, usize, usize, usize)),
) -> Result<Vec<T>> {
    let mut out = filled(count * width * height, empty)?;
    let rows = out.chunks_exact_mut(count * width).skip(top).zip(data.chunks_exact(count * size.0));
    for (to, from) in rows {
        to[count * left..count * (left + size.0)].copy_from_slice(from);
    }
    Ok(out)
}

/// The part of a warped photo in a window of a canvas on which its own lies at (left, top), and its confidence.
fn cut_warped(warped: &Warped, window: Rect, (left, top): (usize, usize)) -> Result<(Image, Option<Mask>)> {
    let mut image = Image::transparent(window.width, window.height)?;
    let mut confidence = match &warped.confidence {
        Some(_) => Some(Mask::empty(window.width, window.height)?),
        None => None,
    };
    let width = warped.image.width();
    for y in 0..window.height {
        let Some(row) = (window.y + y).checked_sub(top).filter(|row| *row < warped.image.height()) else { continue };
        // Columns of the window that the warped canvas has.
        let from = left.saturating_sub(window.x);
        let to = (left + width).saturating_sub(window.x).min(window.width);
        if from >= to {
            continue;
        }
        let source = row * width + window.x + from - left;
        let target = y * window.width + from..y * window.width + to;
        let pixels = &warped.image.pixels()[source..source + (to - from)];
        let out = image.pixels_mut()[target.clone()].iter_mut();
        out.zip(pixels).for_each(|(out, pixel)| *out = opaque_or_empty(*pixel));
        if let (Some(out), Some(own)) = (&mut confidence, &warped.confidence) {
            out.data_mut()[target].copy_from_slice(&own.data()[source..source + (to - from)]);
        }
    }
    Ok((image, confidence))
}
