//! Many photos on one canvas, added one after another.
//!
//! What is there already plays the part of the reference: each photo's exposure is matched to it, a minimum cut decides
//! where the photo shows, and bands are blended across the cut. Only the surroundings of the photo are looked at, so that
//! the work is in proportion to the photos, not to the canvas times their number.

use super::average::opaque_or_empty;
use super::blend::{BlendOptions, Blending, SeamGuide, compose};
use super::canvas::Placed;
use super::crop::bounds;
use super::exposure::{check_gains, multiply};
use super::multiband::default_bands;
use super::seam::{self, BOTH, TARGET};
use crate::geometry::Match;
use crate::image::{filled, reserve};
use crate::observer::{Observer, report};
use crate::rect::Rect;
use crate::transparency::outside;
use crate::warp::Warped;
use crate::{Error, Image, ImageView, InverseDepth, Mask, Result, Stage};

/// Photos on one canvas.
#[derive(Debug, Clone, PartialEq)]
pub struct Composition {
    /// RGBA, alpha 255 where any photo is valid, 0 (and black) elsewhere.
    pub image: Image,
    /// Which photo shows: 0 none, otherwise the label that it was added with.
    pub labels: Mask,
    /// Where any photo was drawn, valid or not.
    pub footprint: Mask,
    /// Canvas position of the view's origin: the reference's top left pixel.
    pub offset: (usize, usize),
    /// Inverse depth of what shows, in the view's frame, NaN where nothing does.
    pub depth: InverseDepth,
    /// Bands of the pyramid where [`BlendOptions::bands`] is 0.
    bands: u32,
    /// The reference's label.
    reference: u8,
}

/// How a photo is added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer<'a> {
    /// Its value in [`Composition::labels`], above 0.
    pub label: u8,
    /// What its red, green and blue are multiplied by in linear light, up to local differences; `None` to find that where it overlaps
    /// what is there.
    pub gains: Option<[f64; 3]>,
    /// Where it and other photos show the same, in pixels of the view, and the label of the other one, whose place comes second: see
    /// [`SeamGuide::matches`](super::SeamGuide::matches).
    pub matches: &'a [(Match, u8)],
}

/// What became of a photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Added {
    /// What its red, green and blue were multiplied by in linear light, on average over the overlap.
    pub gains: [f64; 3],
    /// Pixels that both it and the mosaic before it covered.
    pub overlap: usize,
    /// The smallest rectangle around it: x and y of the top left pixel, width, height, in pixels from the reference's top left pixel.
    pub extent: [i64; 4],
}

impl Composition {
    /// The reference alone, as far as it is not masked, under this label; without its inverse `depth` that is 0.
    ///
    /// # Errors
    /// `size-mismatch` for depth of another size, `out-of-memory`.
    pub fn of(reference: ImageView<'_>, depth: Option<&InverseDepth>, label: u8) -> Result<Self> {
        let (width, height) = reference.size();
        let there = |at: usize| reference.pixels().get(at).is_none_or(|&pixel| reference.is_there(pixel));
        let depth = match depth {
            Some(depth) => depth.map_indexed(|at, d| if there(at) { d } else { f32::NAN })?,
            None => InverseDepth::constant(0.0, width, height)?,
        };
        let mut image = Image::transparent(width, height)?;
        let pixels = image.pixels_mut().iter_mut().zip(reference.pixels());
        for (pixel, &[r, g, b, _]) in pixels.filter(|(_, pixel)| reference.is_there(**pixel)) {
            *pixel = [r, g, b, 255];
        }
        let mut footprint = Mask::empty(width, height)?;
        footprint.data_mut().fill(255);
        if let Some(outside) = outside(reference)? {
            footprint.data_mut().iter_mut().zip(outside.data()).for_each(|(drawn, outside)| *drawn = !outside);
        }
        let warped = Warped { image, footprint, confidence: None, depth: Some(depth), offset: (0, 0), clipped: false };
        Self::of_warped(warped, (width, height), label)
    }

    /// The reference alone, warped into the view, under this label; its `size` (width, height) as a photo.
    ///
    /// # Errors
    /// `size-mismatch` for a footprint, confidence or depth of another size than the picture's, `out-of-memory`.
    pub fn of_warped(reference: Warped, size: (usize, usize), label: u8) -> Result<Self> {
        reference.check()?;
        let Warped { image, footprint, depth, offset, .. } = reference;
        let depth = match depth {
            Some(depth) => depth,
            None => InverseDepth::constant(0.0, image.width(), image.height())?,
        };
        let mut labels = Mask::empty(image.width(), image.height())?;
        for (own, pixel) in labels.data_mut().iter_mut().zip(image.pixels()) {
            *own = if pixel[3] == 0 { 0 } else { label };
        }
        let bands = default_bands(size);
        Ok(Self { image, labels, footprint, offset, depth, bands, reference: label })
    }

    /// Multiplies the linear light of all that is there by the gains of red, green and blue, without losing highlights.
    ///
    /// # Errors
    /// `invalid-argument` for gains that are not finite numbers above 0, `out-of-memory`, `aborted`.
    pub fn multiply(&mut self, gains: [f64; 3], observer: &mut dyn Observer) -> Result<()> {
        check_gains(gains)?;
        multiply(&mut self.image, gains, observer)
    }

    /// The part of the picture from (x0, y0) to (x1, y1), end excluded, in pixels of the view: with its inverse depth, and where its top
    /// left pixel is in the view. One pixel at least.
    ///
    /// # Errors
    /// `out-of-memory`.
    pub fn part(&self, [x0, y0, x1, y1]: [i64; 4]) -> Result<(Image, InverseDepth, [i64; 2])> {
        let range = |from: i64, to: i64, offset: usize, side: usize| {
            let within = |at: i64, most: usize| (at + offset as i64).clamp(0, most as i64) as usize;
            let first = within(from, side.saturating_sub(1));
            (first, within(to, side).max(first + 1) - first)
        };
        let (x, width) = range(x0, x1, self.offset.0, self.image.width());
        let (y, height) = range(y0, y1, self.offset.1, self.image.height());
        let window = Rect { x, y, width, height };
        let depth = InverseDepth::from_values(part(self.depth.data(), self.depth.width(), window)?, width, height);
        Ok((self.cut_out(window)?, depth, [x as i64 - self.offset.0 as i64, y as i64 - self.offset.1 as i64]))
    }

    /// Where a warped photo's canvas begins on this one; `at` is where its own origin is in the view.
    fn place(&self, warped: &Warped, at: [i64; 2]) -> [i64; 2] {
        let (own, other) = (self.offset, warped.offset);
        [at[0].saturating_add(own.0 as i64 - other.0 as i64), at[1].saturating_add(own.1 as i64 - other.1 as i64)]
    }

    /// The canvas (width, height) that this and a photo warped onto it would take together. `at` is where the photo's origin is
    /// in the view.
    pub fn size_with(&self, warped: &Warped, at: [i64; 2]) -> (usize, usize) {
        let [x, y] = self.place(warped, at);
        let side = |from: i64, own: usize, other: usize| {
            let side = (own as i64).max(from.saturating_add(other as i64)).saturating_sub(from.min(0));
            usize::try_from(side).unwrap_or(usize::MAX)
        };
        let ((w, h), (width, height)) = (self.image.size(), warped.image.size());
        (side(x, w, width), side(y, h, height))
    }

    /// Adds a photo warped into the view; `at` is where the photo's origin is there. `None` when nothing of it is visible.
    ///
    /// # Errors
    /// `invalid-argument` for options out of range, the label 0 and gains that are not finite numbers above 0, `size-mismatch` for a footprint,
    /// confidence or depth of another size than the picture's, `out-of-memory`, `aborted`.
    pub fn add(
        &mut self,
        warped: &Warped,
        at: [i64; 2],
        layer: Layer<'_>,
        options: &BlendOptions,
        observer: &mut dyn Observer,
    ) -> Result<Option<Added>> {
        options.check()?;
        warped.check()?;
        if layer.label == 0 {
            return Err(Error::InvalidArgument { name: "label", expected: "from 1 to 255", value: 0.0 }.into());
        }
        layer.gains.map_or(Ok(()), check_gains)?;
        report(observer, Stage::Blend, 0.0)?;
        let Some(bounds) = bounds(&warped.image) else { return Ok(None) };
        self.grow(warped, at)?;
        // Where the warped picture's canvas lies on this one: within it, now.
        let [left, top] = self.place(warped, at).map(|v| v.max(0) as usize);
        let bands = if options.bands == 0 { self.bands } else { options.bands };
        let own = Rect { x: bounds.x + left, y: bounds.y + top, ..bounds };
        // What bands reach, and enough around the overlap for the seam and the ramp across it.
        let ramp = if options.blending == Blending::Feather { options.feather as usize / 2 + 1 } else { 0 };
        let window = own.grown((3 << bands.max(self.bands)).max(ramp), self.image.size());

        let before = self.cut_out(window)?;
        let placed = Placed { photo: before.view(), left: 0, top: 0 };
        let (mut image, confidence) = cut_warped(warped, window, (left, top))?;
        let mut shown = seam::sides(&image, &placed)?;
        let overlap = shown.data().iter().filter(|side| **side == BOTH).count();
        let labels =
            Mask::from_bytes(part(self.labels.data(), self.labels.width(), window)?, window.width, window.height);
        let matches = self.visible_matches(layer.matches, window, &labels)?;
        let preference = seam::Preference {
            guide: SeamGuide { reliable: None, matches: &matches },
            confidence: confidence.as_ref(),
            labels: Some((&labels, self.reference)),
        };
        let options = BlendOptions { bands, ..options.clone() };
        let gains = compose((&mut image, layer.gains), &mut shown, &placed, &preference, &options, observer)?;
        self.paste(&image, &shown, window, layer.label);
        self.paste_depth(warped, &shown, window, (left, top));
        self.add_footprint(warped, (left, top));
        report(observer, Stage::Blend, 1.0)?;
        let [x, y] = [own.x as i64 - self.offset.0 as i64, own.y as i64 - self.offset.1 as i64];
        Ok(Some(Added { gains, overlap, extent: [x, y, own.width as i64, own.height as i64] }))
    }

    /// The matches of a new photo whose other end the mosaic shows, in pixels of a window; `labels` are those there.
    fn visible_matches(&self, matches: &[(Match, u8)], window: Rect, labels: &Mask) -> Result<Vec<Match>> {
        let (left, top) = self.offset;
        let (left, top) = (left as f64 - window.x as f64, top as f64 - window.y as f64);
        let shown = |[x, y]: [f64; 2]| {
            let inside = x >= 0.0 && y >= 0.0 && x < window.width as f64 && y < window.height as f64;
            inside.then(|| labels.data()[y as usize * window.width + x as usize])
        };
        let mut found = Vec::new();
        reserve(&mut found, matches.len())?;
        found.extend(matches.iter().filter_map(|(Match { target, reference }, label)| {
            let [target, reference] = [target, reference].map(|[x, y]| [x + left, y + top]);
            (shown(reference) == Some(*label)).then_some(Match { target, reference })
        }));
        Ok(found)
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
    fn grow(&mut self, warped: &Warped, at: [i64; 2]) -> Result<()> {
        let (width, height) = self.size_with(warped, at);
        if (width, height) == self.image.size() {
            return Ok(());
        }
        let [left, top] = self.place(warped, at).map(|v| v.saturating_neg().max(0) as usize);
        let size = self.image.size();
        // Where what is there lies on the larger canvas.
        let place = Rect { x: left, y: top, width: size.0, height: size.1 };
        let larger = (width, height);
        // Nothing is changed before there is memory for all.
        let image = moved(self.image.data(), 4, place, larger, 0)?;
        let labels = moved(self.labels.data(), 1, place, larger, 0)?;
        let footprint = moved(self.footprint.data(), 1, place, larger, 0)?;
        let depth = moved(self.depth.data(), 1, place, larger, f32::NAN)?;
        self.image = Image::from_bytes(image, width, height);
        self.labels = Mask::from_bytes(labels, width, height);
        self.footprint = Mask::from_bytes(footprint, width, height);
        self.depth = InverseDepth::from_values(depth, width, height);
        self.offset = (self.offset.0 + left, self.offset.1 + top);
        Ok(())
    }

    /// A window of the mosaic.
    fn cut_out(&self, window: Rect) -> Result<Image> {
        let pixels = part(self.image.pixels(), self.image.width(), window)?;
        Ok(Image::from_bytes(pixels.into_flattened(), window.width, window.height))
    }

    /// Puts a blended window in its place.
    fn paste(&mut self, image: &Image, shown: &Mask, window: Rect, label: u8) {
        let width = self.image.width();
        let sources = image.pixels().chunks_exact(window.width).zip(shown.data().chunks_exact(window.width));
        for (y, (pixels, shown)) in sources.enumerate() {
            let at = (window.y + y) * width + window.x;
            self.image.pixels_mut()[at..at + window.width].copy_from_slice(pixels);
            let labels = self.labels.data_mut()[at..at + window.width].iter_mut();
            labels.zip(shown).filter(|(_, shown)| **shown == TARGET).for_each(|(own, _)| *own = label);
        }
    }

    /// The depth of the photo where it shows in a window; its own canvas lies at (left, top).
    fn paste_depth(&mut self, warped: &Warped, shown: &Mask, window: Rect, (left, top): (usize, usize)) {
        let (width, height) = self.depth.size();
        let mut values = std::mem::replace(&mut self.depth, InverseDepth::from_values(Vec::new(), 0, 0)).into_values();
        for (i, _) in shown.data().iter().enumerate().filter(|(_, shown)| **shown == TARGET) {
            let (x, y) = (window.x + i % window.width, window.y + i / window.width);
            // Where the photo shows, its canvas reaches. Without parallax it is infinitely far away.
            let of = |depth: &InverseDepth| depth.data()[(y - top) * depth.width() + x - left];
            values[y * width + x] = warped.depth.as_ref().map_or(0.0, of);
        }
        self.depth = InverseDepth::from_values(values, width, height);
    }

    fn add_footprint(&mut self, warped: &Warped, (left, top): (usize, usize)) {
        let width = self.image.width();
        let rows = warped.footprint.data().chunks_exact(warped.footprint.width());
        for (own, drawn) in self.footprint.data_mut().chunks_exact_mut(width).skip(top).zip(rows) {
            own[left..].iter_mut().zip(drawn).for_each(|(own, &drawn)| *own |= drawn);
        }
    }
}

/// A window of `data` of this width, row by row.
fn part<T: Copy>(data: &[T], width: usize, window: Rect) -> Result<Vec<T>> {
    let mut out = Vec::new();
    reserve(&mut out, window.width * window.height)?;
    for row in data.chunks_exact(width).skip(window.y).take(window.height) {
        out.extend_from_slice(&row[window.x..window.x + window.width]);
    }
    Ok(out)
}

/// `data`, so many numbers a pixel, at `place` on a larger canvas (width, height) that is `empty` elsewhere.
fn moved<T: Copy>(data: &[T], count: usize, place: Rect, (width, height): (usize, usize), empty: T) -> Result<Vec<T>> {
    let mut out = filled(count.saturating_mul(width).saturating_mul(height), empty)?;
    let rows = out.chunks_exact_mut(count * width).skip(place.y).zip(data.chunks_exact(count * place.width));
    for (to, from) in rows {
        to[count * place.x..count * (place.x + place.width)].copy_from_slice(from);
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
