//! Planes of the scene where stereo finds nothing: a white wall. Piecewise planar stereo (after Sinha et al., *Piecewise Planar Stereo
//! for Image-based Rendering*, 2009): the planes are those that textured places of all photos lie on, and each part of a photo gets the
//! one by which it looks alike in the others, with few changes between parts.

use nalgebra::Matrix3;

use super::labelling::Labelling;
use crate::depth::{sample_grid, sample_step};
use crate::features::{Luma, luma};
use crate::geometry::{DepthSample, Model, MultiView, plane_depth, tile_planes, weighted_plane};
use crate::image::{filled, reserve};
use crate::rect::diagonal;
use crate::statistics::median;
use crate::{ImageView, InverseDepth, Result};

/// Most planes, and samples that are looked at.
const PLANES: usize = 6;
const SAMPLES: usize = 3000;
/// Planes are started from the samples of the whole photo, and of such tiles.
const TILES: [usize; 4] = [1, 2, 4, 8];
/// Fewer samples start no plane; a plane has at least this share of all.
const FEWEST: usize = 12;
const LEAST_SHARE: f64 = 0.04;
/// Distance in the other photo, as a share of the diagonal, of what is part of a plane.
const TOLERANCE: f64 = 0.0015;
/// Refits to these, the first with twice the tolerance.
const REFITS: usize = 8;
const COARSE: usize = 3;
/// Photos are compared at this longer side, in parts of so many pixels.
const SIDE: usize = 640;
const PART: usize = 10;
/// A place with less contrast around it, in levels, is not textured: what stereo finds there is what it expected.
const CONTRAST: f32 = 14.0;
const AROUND: usize = 4;
/// Levels that cost 1, and beyond which a pixel shows something else.
const LEVELS: f32 = 4.0;
const MOST_LEVELS: f32 = 30.0;
/// The most that a part costs, what it does where no other photo sees it, and beyond which it is not taken for any plane.
const MOST_COST: f32 = 4.0;
const UNSEEN: f32 = 1.0;
const TOO_MUCH: f32 = 3.0;
/// That two planes meet costs this, and so much more if they are not close there.
const CHANGE: f32 = 0.5;
const GAP: f32 = 2.0;
/// Gap in tolerances at which that is all of it.
const WIDE: f64 = 4.0;

/// Photos as they are compared.
pub(super) struct Views {
    views: Vec<Option<Luma>>,
}

/// What planes say of a photo's depth.
pub(super) struct PlaneDepth {
    /// Points and inverse depth there.
    pub samples: Vec<([f64; 2], f64)>,
    columns: usize,
    /// Pixels of the photo along a part.
    part: f64,
    /// Whether a part of the photo is on a plane, row by row.
    on_plane: Vec<bool>,
}

impl Views {
    /// Of the photos that are `used`.
    pub fn of(photos: &[ImageView<'_>], used: &[usize]) -> Result<Self> {
        let view = |(i, photo): (usize, &ImageView<'_>)| used.contains(&i).then(|| view(*photo)).transpose();
        Ok(Self { views: photos.iter().enumerate().map(view).collect::<Result<_>>()? })
    }
}

impl PlaneDepth {
    /// Whether a pixel is on a plane.
    pub fn covers(&self, [x, y]: [f64; 2]) -> bool {
        let at = (y / self.part) as usize * self.columns + (x / self.part) as usize;
        self.on_plane.get(at).is_some_and(|on| *on)
    }
}

/// How a photo looks at [`SIDE`], NaN where it is not there.
fn view(photo: ImageView<'_>) -> Result<Luma> {
    let (w, h) = photo.size();
    let longer = w.max(h).max(SIDE);
    let (width, height) = ((w * SIDE).div_ceil(longer).max(2).min(w), (h * SIDE).div_ceil(longer).max(2).min(h));
    let mut view = luma(photo, (width, height))?;
    if photo.is_masked() {
        for (at, level) in view.data.iter_mut().enumerate() {
            if !photo.is_there(photo.pixel(at % width * w / width, at / width * h / height)) {
                *level = f32::NAN;
            }
        }
    }
    Ok(view)
}

/// One photo next to the others.
struct Scene<'a> {
    size: (usize, usize),
    view: &'a Luma,
    /// To the photo that sees the same.
    model: Model,
    /// Distance of what is part of a plane, in that one's pixels.
    tolerance: f64,
    /// To the others, how they look, their sizes, and by how much darker they are.
    others: Vec<(Model, &'a Luma, (usize, usize), f32)>,
}

/// The planes of `photo`, and what is on them; `None` without any. `known` are maps of all photos that are NaN where nothing is;
/// the `other` photo sees the same.
pub(super) fn plane_depth_of(
    [photo, other]: [usize; 2],
    photos: &[ImageView<'_>],
    views: &Views,
    known: &[Option<InverseDepth>],
    geometry: &MultiView,
) -> Result<Option<PlaneDepth>> {
    let (Some(model), Some(view)) = (geometry.model([photo, other]), &views.views[photo]) else { return Ok(None) };
    let size = photos[photo].size();
    let mut samples: Vec<DepthSample> = Vec::new();
    let mut others = Vec::new();
    for (from, seen) in views.views.iter().enumerate() {
        let Some(seen) = seen else { continue };
        if let Some(map) = &known[from] {
            samples.extend(
                textured_samples([from, photo], seen, map, size, geometry).map(|(p, d)| DepthSample::new(&model, p, d)),
            );
        }
        if from != photo
            && let Some(there) = geometry.model([photo, from])
        {
            let marks = geometry.samples(photo, from);
            samples.extend(marks.iter().map(|s| DepthSample::new(&model, s.point, s.depth)));
            let ratio = |s: &DepthSample| {
                let place = there.project(s.point[0], s.point[1], s.depth)?;
                let ratio = look(view, size, s.point) / look(seen, photos[from].size(), place);
                (ratio.is_finite() && ratio > 0.0).then_some(f64::from(ratio))
            };
            if let Some(darker) = median(marks.iter().filter_map(ratio).collect()) {
                others.push((there, seen, photos[from].size(), darker as f32));
            }
        }
    }
    let tolerance = TOLERANCE * diagonal(size);
    let planes = find(samples, size, tolerance);
    if planes.is_empty() {
        return Ok(None);
    }
    let scene = Scene { size, view, model, tolerance, others };
    scene.label(&planes, known[photo].as_ref()).map(Some)
}

/// What is known of a photo where it is textured, as another one sees it that has this size: near its frame, in front of others or
/// behind.
fn textured_samples<'a>(
    [from, to]: [usize; 2],
    view: &'a Luma,
    map: &'a InverseDepth,
    (width, height): (usize, usize),
    geometry: &MultiView,
) -> impl Iterator<Item = ([f64; 2], f64)> + use<'a> {
    let model = if from == to { Some(Model::homography(Matrix3::identity())) } else { geometry.model([from, to]) };
    let scale = view.width as f64 / map.width() as f64;
    sample_grid(map.size()).filter_map(move |(x, y)| {
        let depth = f64::from(map.data()[y * map.width() + x]);
        let place = [x, y].map(|v| (v as f64 * scale) as usize);
        if depth.is_nan() || !textured(view, place) {
            return None;
        }
        let [u, v, third] = model?.transform(x as f64, y as f64, depth);
        let [u, v] = [u / third, v / third];
        let near = |p: f64, side: usize| p > -(side as f64) && p < 2.0 * side as f64;
        (third > 0.0 && near(u, width) && near(v, height)).then_some(([u, v], depth / third))
    })
}

/// Whether there is enough contrast around a pixel of a view.
fn textured(view: &Luma, [x, y]: [usize; 2]) -> bool {
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for row in y.saturating_sub(AROUND)..(y + AROUND + 1).min(view.height) {
        let columns = x.saturating_sub(AROUND).min(view.width)..(x + AROUND + 1).min(view.width);
        for &level in &view.data[row * view.width..][columns] {
            (least, most) = (least.min(level), most.max(level));
        }
    }
    most - least > CONTRAST
}

/// How bright a place of a photo of this size is in its view; NaN outside.
fn look(view: &Luma, (w, h): (usize, usize), [x, y]: [f64; 2]) -> f32 {
    let along = |p: f64, from: usize, to: usize| (p + 0.5) * to as f64 / from as f64 - 0.5;
    let (x, y) = (along(x, w, view.width), along(y, h, view.height));
    if !(x >= 0.0 && y >= 0.0 && x < (view.width - 1) as f64 && y < (view.height - 1) as f64) {
        return f32::NAN;
    }
    let (column, row) = (x as usize, y as usize);
    let (u, v) = ((x - column as f64) as f32, (y - row as f64) as f32);
    let line = |row: usize| {
        let at = row * view.width + column;
        view.data[at] * (1.0 - u) + view.data[at + 1] * u
    };
    line(row) * (1.0 - v) + line(row + 1) * v
}

/// The planes that most of the samples lie on, one after another.
fn find(samples: Vec<DepthSample>, size: (usize, usize), tolerance: f64) -> Vec<[f64; 3]> {
    let step = samples.len().div_ceil(SAMPLES).max(1);
    let mut rest: Vec<DepthSample> = samples.into_iter().step_by(step).collect();
    let least = ((LEAST_SHARE * rest.len() as f64) as usize).max(2 * FEWEST);
    let mut planes = Vec::new();
    while planes.len() < PLANES && rest.len() >= least {
        let mut best: Option<([f64; 3], usize)> = None;
        for mut plane in tile_planes(&rest, size, &TILES, FEWEST) {
            for round in 0..REFITS {
                let reach = if round < COARSE { 2.0 * tolerance } else { tolerance };
                let near = rest.iter().filter(|s| s.distance(plane) < reach);
                let Some(better) = weighted_plane(near.map(|s| (s, s.parallax * s.parallax))) else { break };
                plane = better;
            }
            let members = rest.iter().filter(|s| s.distance(plane) < tolerance).count();
            if best.is_none_or(|(_, most)| members > most) {
                best = Some((plane, members));
            }
        }
        let Some((plane, _)) = best.filter(|(_, members)| *members >= least) else { break };
        rest.retain(|s| s.distance(plane) >= 2.0 * tolerance);
        planes.push(plane);
    }
    planes
}

impl Scene<'_> {
    /// Every second pixel of the view's part in a column and row, as places of the photo.
    fn pixels(&self, [column, row]: [usize; 2]) -> Vec<[f64; 2]> {
        let scale = self.size.0 as f64 / self.view.width as f64;
        let along = |at: usize, side: usize| (at * PART..((at + 1) * PART).min(side)).step_by(2);
        let place = |v: usize| (v as f64 + 0.5) * scale - 0.5;
        let rows = along(row, self.view.height);
        rows.flat_map(|y| along(column, self.view.width).map(move |x| [place(x), place(y)])).collect()
    }

    /// The inverse depth of a part that is textured and known.
    fn measured(&self, place: [usize; 2], pixels: &[[f64; 2]], map: &InverseDepth) -> Option<f64> {
        let at = |[x, y]: &[f64; 2]| {
            let [x, y] = [x, y].map(|v| v.max(0.0) as usize);
            map.data().get(y * map.width() + x).map(|d| f64::from(*d)).filter(|d| !d.is_nan())
        };
        let depths: Vec<f64> = pixels.iter().filter_map(at).collect();
        let enough = 2 * depths.len() >= pixels.len() && textured(self.view, place.map(|at| at * PART + PART / 2));
        if enough { median(depths) } else { None }
    }

    /// What it costs that a part is on a plane, by how the others look there.
    fn difference(&self, pixels: &[[f64; 2]], plane: [f64; 3]) -> f32 {
        if pixels.iter().any(|pixel| plane_depth(plane, *pixel) <= 0.0) {
            return 2.0 * MOST_COST;
        }
        let (mut total, mut seeing) = (0.0, 0.0);
        for (model, view, size, darker) in &self.others {
            let (mut sum, mut count) = (0.0, 0);
            for pixel in pixels {
                let Some(place) = model.project(pixel[0], pixel[1], plane_depth(plane, *pixel)) else { continue };
                let off = (look(self.view, self.size, *pixel) - darker * look(view, *size, place)).abs();
                if !off.is_nan() {
                    (sum, count) = (sum + off.min(MOST_LEVELS), count + 1);
                }
            }
            if 2 * count > pixels.len() {
                (total, seeing) = (total + sum / count as f32, seeing + 1.0);
            }
        }
        if seeing > 0.0 { (total / seeing / LEVELS).min(MOST_COST) } else { UNSEEN }
    }

    /// Decides which part is on which plane. What is `known` and textured is not asked.
    fn label(&self, planes: &[[f64; 3]], known: Option<&InverseDepth>) -> Result<PlaneDepth> {
        let (columns, rows) = (self.view.width.div_ceil(PART), self.view.height.div_ceil(PART));
        let part = PART as f64 * self.size.0 as f64 / self.view.width as f64;
        let mut costs = filled(columns * rows * planes.len(), 0.0)?;
        let mut open = filled(columns * rows, false)?;
        for (node, costs) in costs.chunks_exact_mut(planes.len()).enumerate() {
            let place = [node % columns, node / columns];
            let (pixels, middle) = (self.pixels(place), place.map(|at| (at as f64 + 0.5) * part));
            match known.and_then(|map| self.measured(place, &pixels, map)) {
                Some(depth) => {
                    let parallax = self.model.parallax(middle, depth);
                    for (cost, plane) in costs.iter_mut().zip(planes) {
                        let off = (depth - plane_depth(*plane, middle)).abs() * parallax / self.tolerance;
                        *cost = (off as f32).min(MOST_COST);
                    }
                }
                None => {
                    open[node] = true;
                    costs.iter_mut().zip(planes).for_each(|(cost, plane)| *cost = self.difference(&pixels, *plane));
                }
            }
        }
        let apart = |[a, b]: [usize; 2], [one, two]: [usize; 2]| {
            if one == two {
                return 0.0;
            }
            let along = |of: &dyn Fn(usize) -> usize| 0.5 * part * (of(a) + of(b) + 1) as f64;
            let between = [along(&|node| node % columns), along(&|node| node / columns)];
            let [one, two] = [one, two].map(|label| plane_depth(planes[label], between));
            let gap = (one - two).abs() * self.model.parallax(between, 0.5 * (one + two));
            CHANGE + GAP * (gap / (WIDE * self.tolerance)).min(1.0) as f32
        };
        let labelling = Labelling { columns, rows, labels: planes.len(), costs };
        let labels = labelling.solve(&apart)?;
        // A surface cannot tear: where planes lie apart, what nobody else sees is better left to it.
        let torn = |a: usize, b: usize| apart([a, b], [labels[a], labels[b]]) >= CHANGE + GAP;
        let whole = (0..columns * rows).all(|node| {
            let last = node % columns + 1 == columns;
            (last || !torn(node, node + 1)) && (node + columns >= columns * rows || !torn(node, node + columns))
        });
        let covered = |node: usize| {
            let cost = labelling.costs[node * planes.len() + labels[node]];
            open[node] && cost < TOO_MUCH && (whole || cost != UNSEEN)
        };
        let on_plane: Vec<bool> = (0..columns * rows).map(covered).collect();
        let mut samples = Vec::new();
        let step = sample_step(self.size);
        reserve(&mut samples, self.size.0.div_ceil(step) * self.size.1.div_ceil(step))?;
        for (x, y) in sample_grid(self.size) {
            let point = [x as f64, y as f64];
            let node = (point[1] / part) as usize * columns + (point[0] / part) as usize;
            if on_plane.get(node).is_some_and(|on| *on) {
                samples.push((point, plane_depth(planes[labels[node]], point)));
            }
        }
        Ok(PlaneDepth { samples, columns, part, on_plane })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::Vector3;

    use super::*;
    use crate::Image;

    const SIZE: (usize, usize) = (320, 240);
    /// Where the wall stands on the floor; above it is a patterned board.
    const FOOT: usize = 160;
    const BOARD: usize = 140;
    /// By how many pixels a unit of inverse depth moves.
    const ASIDE: f64 = 120.0;
    const FLOOR: [f64; 3] = [0.0, 0.004, -0.14];
    const WALL: [f64; 3] = [0.0, 0.0, 0.5];

    fn truth(y: usize) -> f64 {
        plane_depth(if y < FOOT { WALL } else { FLOOR }, [0.0, y as f64])
    }

    /// A photo from a place so far aside: patterned floor and board, a white wall with a few joints.
    fn photo(aside: f64) -> Image {
        let level = |i: usize| {
            let (u, y) = (i % SIZE.0, i / SIZE.0);
            let x = u as f64 - aside * truth(y);
            let cell = ((x / 7.0).floor() as i64).wrapping_mul(7919) ^ (y as i64 / 7).wrapping_mul(104729);
            let patterned = 60 + (cell.wrapping_mul(2654435761) >> 7 & 127) as u8;
            let joint = x.rem_euclid(50.0) < 2.0;
            if y >= BOARD {
                patterned
            } else if joint {
                120
            } else {
                210
            }
        };
        let data = (0..SIZE.0 * SIZE.1).flat_map(|i| [level(i), level(i), level(i), 255]).collect();
        Image::new(data, SIZE.0, SIZE.1).unwrap()
    }

    #[test]
    fn a_white_wall_stands_on_its_board_and_does_not_go_on_as_the_floor() {
        let views = [0.0, ASIDE].map(|aside| view(photo(aside).view()).unwrap());
        let model = Model { h: Matrix3::identity(), e: Vector3::new(ASIDE, 0.0, 0.0) };
        // Stereo finds what is patterned.
        let known = (0..SIZE.0 * SIZE.1).map(|i| if i / SIZE.0 < BOARD { f32::NAN } else { truth(i / SIZE.0) as f32 });
        let known = InverseDepth::from_values(known.collect(), SIZE.0, SIZE.1);
        let points = sample_grid(SIZE).filter(|(_, y)| *y >= BOARD);
        let samples = points.map(|(x, y)| DepthSample::new(&model, [x as f64, y as f64], truth(y))).collect();
        let tolerance = TOLERANCE * diagonal(SIZE);
        let planes = find(samples, SIZE, tolerance);
        for plane in [FLOOR, WALL] {
            let off = |found: &[f64; 3], y| (plane_depth(*found, [100.0, y]) - plane_depth(plane, [100.0, y])).abs();
            let same = |found: &[f64; 3]| off(found, 150.0) < 3e-3 && off(found, 220.0) < 3e-3;
            assert!(planes.iter().any(same), "{planes:?} lack {plane:?}");
        }
        let scene =
            Scene { size: SIZE, view: &views[0], model, tolerance, others: vec![(model, &views[1], SIZE, 1.0)] };
        let found = scene.label(&planes, Some(&known)).unwrap();
        let wall = sample_grid(SIZE).filter(|(_, y)| *y < BOARD).count();
        let on_wall: Vec<_> = found.samples.iter().filter(|([_, y], _)| *y < BOARD as f64).collect();
        let right = on_wall.iter().filter(|(_, depth)| (depth - WALL[2]).abs() < 5e-3).count();
        assert!(
            10 * on_wall.len() > 9 * wall && 20 * right > 19 * on_wall.len(),
            "{right} of {} of {wall}",
            on_wall.len()
        );
    }
}
