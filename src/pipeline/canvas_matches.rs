//! Where the canvas shows what was matched, by the models: wherever these are wrong, at two places.

use super::align::Alignment;
use super::projected::ProjectedReference;
use crate::geometry::{Frame, Match, usable_matches};
use crate::image::reserve;
use crate::warp::project;
use crate::{ImageView, Result};

/// The usable `matches` of two photos in pixels of a canvas on which the reference's top left pixel is at `offset`; without those that appear nowhere.
pub(super) fn canvas_matches(
    matches: &[Match],
    photos: [ImageView<'_>; 2],
    alignment: &Alignment<'_>,
    projected: Option<&ProjectedReference>,
    offset: (usize, usize),
) -> Result<Vec<Match>> {
    let surface = projected.map(|projected| &projected.surface);
    let forward = projected.map_or(&alignment.geometry.forward, |projected| &projected.models[0]);
    let depth = alignment.depth[0].as_deref();
    let on_canvas = |[x, y]: [f64; 2]| [x + offset.0 as f64, y + offset.1 as f64];
    let place = |[target, reference]: [[f64; 2]; 2]| {
        let depth = depth.map_or(0.0, |map| map.sample(target[0], target[1]));
        let target = project(surface, forward, target, depth)?;
        let reference = projected.map_or(Some(reference), |projected| projected.place(reference))?;
        Some(Match { target: on_canvas(target), reference: on_canvas(reference) })
    };
    let usable = usable_matches(matches, photos.map(|photo| Frame { size: photo.size(), depth: None }).each_ref());
    let mut found = Vec::new();
    reserve(&mut found, usable.len())?;
    found.extend(usable.iter().filter_map(|usable| place(usable.ends)));
    Ok(found)
}
