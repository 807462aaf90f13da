//! Where the canvas shows what was matched, by the models: wherever these are wrong, at two places.

use super::align::Alignment;
use super::projected::ProjectedReference;
use crate::Result;
use crate::geometry::Match;
use crate::image::reserve;
use crate::warp::project;

/// The `matches` in pixels of a canvas on which the reference's top left pixel is at `offset`; without those that appear nowhere.
pub(super) fn canvas_matches(
    matches: &[Match],
    alignment: &Alignment<'_>,
    projected: Option<&ProjectedReference>,
    offset: (usize, usize),
) -> Result<Vec<Match>> {
    let surface = projected.map(|projected| &projected.surface);
    let forward = projected.map_or(&alignment.geometry.forward, |projected| &projected.models[0]);
    let on_canvas = |[x, y]: [f64; 2]| [x + offset.0 as f64, y + offset.1 as f64];
    let place = |m: &Match| {
        let [x, y] = m.target;
        let depth = alignment.depth[0].as_ref().map_or(0.0, |map| map.sample(x, y));
        let target = project(surface, forward, m.target, depth)?;
        let reference = projected.map_or(Some(m.reference), |projected| projected.place(m.reference))?;
        Some(Match { target: on_canvas(target), reference: on_canvas(reference) })
    };
    let mut found = Vec::new();
    reserve(&mut found, matches.len())?;
    found.extend(matches.iter().filter_map(place));
    Ok(found)
}
