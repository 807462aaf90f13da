//! Draws the photos where they belong, each once and from the original, one after another from the reference outward.

use std::borrow::Cow;

use super::align::ManyAlignment;
use super::memory::Budget;
use super::placement::Placement;
use super::reduced::{ReducedPhotos, can_be_halved, reduced_sizes};
use super::result::{Photo, PhotoCode, PhotoReport};
use super::undistorted::UndistortedPhoto;
use crate::geometry::{Match, Undistortion};
use crate::image::reserve_more;
use crate::mosaic::{Added, Composition, Layer, crop};
use crate::observer::{Observer, Portion, Subject};
use crate::pipeline::align::void_distance;
use crate::pipeline::halved::factor;
use crate::pipeline::options::Options;
use crate::pipeline::timer::StageTimer;
use crate::warp::{Distorted, WarpJob, WarpOptions, Warped, project, warp_within};
use crate::{Error, Image, InverseDepth, Rect, Result, Stage, View};

/// Bounds that nothing lies beyond.
const EVERYTHING: [i64; 4] = [i64::MIN / 4, i64::MIN / 4, i64::MAX / 4, i64::MAX / 4];

/// What was drawn.
pub(super) struct Drawn {
    pub composition: Composition,
    /// What became of each photo.
    pub reports: Vec<PhotoReport>,
    /// Whether part of a photo was beyond the canvas limit.
    pub clipped: bool,
    /// How often the photos were halved before.
    pub halvings: u32,
}

/// Draws the photos `given` at the largest size at which the picture takes no more memory than it may: `reduced` are those that were aligned.
pub(super) fn draw_as_large_as_fits(
    given: &[Photo<'_>],
    mut reduced: ReducedPhotos,
    alignment: &mut ManyAlignment,
    gains: &[Option<[f64; 3]>],
    budget: &Budget<'_>,
    observer: &mut dyn Observer,
    timer: &mut StageTimer,
) -> Result<Drawn> {
    let (options, sizes) = (budget.options, budget.given.clone());
    let mut halvings = 0;
    loop {
        let factor = factor(budget.halvings) / factor(halvings);
        let placement = Placement::of(alignment, &reduced_sizes(&sizes, halvings), factor)?;
        let budget = budget.drawing(halvings, &placement.sizes);
        let smaller = can_be_halved(&sizes, halvings + 1);
        let canvas = placement.canvas(&alignment.order, options.warp.canvas_limit);
        if smaller && canvas.is_some_and(|canvas| budget.check(canvas).is_err()) {
            halvings += 1;
            continue;
        }
        if reduced.halvings != halvings {
            // What was worked on makes room.
            alignment.undistorted = None;
            reduced.replace(given, halvings)?;
        }
        let mut reports = alignment.reports();
        let photos = &reduced.photos(given)[..];
        let (alignment, placement, budget) = (&*alignment, &placement, &budget);
        let mut drawing = Drawing { alignment, placement, photos, options, budget, composition: None, clipped: false };
        match drawing.draw(gains, &mut reports, observer, timer) {
            Err(error) if smaller && matches!(*error, Error::TooLarge { .. }) => halvings += 1,
            done => {
                done?;
                let composition = drawing.composition.ok_or(Error::NoOverlap { pixels: 0 })?;
                return Ok(Drawn { composition, reports, clipped: drawing.clipped, halvings });
            }
        }
    }
}

/// The picture as it grows.
struct Drawing<'a> {
    alignment: &'a ManyAlignment,
    /// What belongs where, in pixels of the photos.
    placement: &'a Placement,
    /// The photos to draw, with the distortion of their lens.
    photos: &'a [Photo<'a>],
    options: &'a Options,
    budget: &'a Budget<'a>,
    /// Nothing at first.
    composition: Option<Composition>,
    clipped: bool,
}

impl Drawing<'_> {
    /// Draws all photos, and reports what became of each.
    fn draw(
        &mut self,
        gains: &[Option<[f64; 3]>],
        reports: &mut [PhotoReport],
        observer: &mut dyn Observer,
        timer: &mut StageTimer,
    ) -> Result<()> {
        let order = &self.alignment.order;
        let count = order.len() as f32;
        for (i, &photo) in order.iter().enumerate() {
            observer.subject(Subject::Photo(photo));
            let (from, to) = (i as f32 / count, (i + 1) as f32 / count);
            let warped = self.render(photo, &mut Portion::new(observer, from, to))?;
            timer.end(Stage::Warp, observer);
            self.clipped |= warped.as_ref().is_some_and(|(warped, _)| warped.clipped);
            let matches = &self.matches_with(photo, &order[..i])?;
            let layer = Layer { label: label_of(photo), gains: gains[photo], matches };
            match self.add(warped, photo, layer, &mut Portion::new(observer, from, to))? {
                Some(added) => (reports[photo].gains, reports[photo].extent) = (added.gains, Some(added.extent)),
                None => reports[photo].code = PhotoCode::NotVisible,
            }
            timer.end(Stage::Blend, observer);
        }
        observer.subject(Subject::All);
        Ok(())
    }

    /// Renders a photo next to what is there already, and says where the origin of its canvas is in the view; `None` when nothing of
    /// it lands there, or it needs no rendering.
    fn render(&self, photo: usize, observer: &mut dyn Observer) -> Result<Option<(Warped, [i64; 2])>> {
        let Self { alignment, photos, placement: Placement { factor, sizes, geometry, picture }, .. } = *self;
        let distortion = alignment.distortion;
        let (base, base_depth, at) = match &self.composition {
            None if picture.is_plane() && distortion.is_none() => return Ok(None),
            None => {
                // On a plane canvases are as large as the reference allows.
                let (width, height) = if picture.is_plane() { sizes[photo] } else { (1, 1) };
                (Image::transparent(width, height)?, InverseDepth::constant(0.0, width, height)?, [0; 2])
            }
            // All of it, where it is not clear how much is needed.
            Some(there) => there.part(picture.bounds(photo, sizes, geometry).unwrap_or(EVERYTHING))?,
        };
        let Some([forward, reverse]) = picture.models(geometry, photo, at) else { return Ok(None) };
        let given = &photos[photo];
        let depth = self.depth(photo)?;
        let undistorted = match (distortion, &alignment.undistorted) {
            (Some(distortion), None) => Some(UndistortedPhoto::of(&Photo { depth: None, ..*given }, distortion)?),
            _ => None,
        };
        let kept = alignment.undistorted.as_ref().and_then(|kept| kept.photos().get(photo));
        let image = undistorted.as_ref().or(kept).map_or(given.image, UndistortedPhoto::image);
        let error = factor * alignment.prediction_error(photo);
        let options = WarpOptions {
            void_distance: void_distance(error, sizes[photo], self.options.warp.void_distance),
            depth: true,
            ..self.options.warp.clone()
        };
        let lens =
            |distortion| Distorted { photo: given.image, lens: Undistortion::of(given.image.size(), distortion) };
        let job = WarpJob {
            target: View { image, depth: depth.as_deref() },
            reference: View { image: base.view(), depth: Some(&base_depth) },
            forward: &forward,
            reverse: &reverse,
            surface: picture.surface_at(at),
            limits: picture
                .limits(photo, sizes, geometry, self.options.warp.canvas_limit)
                .map(|limits| limits.relative_to(at)),
            distorted: distortion.map(lens),
        };
        match warp_within(&job, &options, &|canvas| self.budget.check(canvas), observer) {
            Err(error) if matches!(*error, Error::NoOverlap { .. }) => Ok(None),
            warped => warped.map(|warped| Some((warped, at))),
        }
    }

    /// The depth of a photo, without distortion.
    fn depth(&self, photo: usize) -> Result<Option<Cow<'_, InverseDepth>>> {
        self.alignment.depth(photo).map(|map| self.placement.depth(Cow::Borrowed(map), photo)).transpose()
    }

    /// What a photo shares with others: where both are in the view, and the label of the other one.
    fn matches_with(&self, photo: usize, others: &[usize]) -> Result<Vec<(Match, u8)>> {
        let mut found = Vec::new();
        for (photos, matches) in &self.alignment.matches {
            let Some(side) = photos.iter().position(|of| *of == photo) else { continue };
            let other = photos[1 - side];
            if !others.contains(&other) {
                continue;
            }
            let (Some(place), Some(place_other)) = (self.places(photo), self.places(other)) else { continue };
            reserve_more(&mut found, matches.len())?;
            found.extend(matches.iter().filter_map(|m| {
                let ends = [m.target, m.reference];
                let (own, its) = (place(ends[side])?, place_other(ends[1 - side])?);
                Some((Match { target: own, reference: its }, label_of(other)))
            }));
        }
        Ok(found)
    }

    /// Where points of an aligned photo are in the view. `None` for a photo without a place.
    fn places(&self, photo: usize) -> Option<impl Fn([f64; 2]) -> Option<[f64; 2]>> {
        let Placement { factor, geometry, picture, .. } = self.placement;
        let [model, _] = picture.models(geometry, photo, [0; 2])?;
        let (surface, map) = (picture.surface_at([0; 2]), self.alignment.depth(photo));
        Some(move |[x, y]: [f64; 2]| {
            let depth = map.map_or(0.0, |map| map.sample(x, y));
            project(surface.as_ref(), &model, [x, y].map(|v| factor * (v + 0.5) - 0.5), depth)
        })
    }

    /// Adds a photo; `None` when nothing of it is visible.
    fn add(
        &mut self,
        warped: Option<(Warped, [i64; 2])>,
        photo: usize,
        layer: Layer<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Option<Added>> {
        let Some(composition) = &mut self.composition else {
            let mut first = match warped {
                Some((warped, _)) => Composition::of_warped(warped, self.placement.sizes[photo], layer.label)?,
                None => Composition::of(self.photos[photo].image, self.depth(photo)?.as_deref(), layer.label)?,
            };
            let (left, top) = first.offset;
            let Some(drawn) = crop::bounds(&first.image) else { return Ok(None) };
            let Rect { width, height, .. } = drawn;
            let extent = [drawn.x as i64 - left as i64, drawn.y as i64 - top as i64, width as i64, height as i64];
            let gains = layer.gains.unwrap_or([1.0; 3]);
            first.multiply(gains, observer)?;
            self.composition = Some(first);
            return Ok(Some(Added { gains, overlap: 0, extent }));
        };
        let Some((warped, at)) = warped else { return Ok(None) };
        self.budget.check(composition.size_with(&warped, at))?;
        composition.add(&warped, at, layer, &self.options.blend, observer)
    }
}

/// The value of a photo in [`Composition::labels`].
fn label_of(photo: usize) -> u8 {
    (photo + 1) as u8
}
