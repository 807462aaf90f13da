//! Which part of a photo is on which plane of the scene: measured depth says so where there is texture, and elsewhere how the others
//! look there; planes change where the photo's colours do.

use super::labelling::Labelling;
use super::views::{brightness_at, textured};
use crate::components::{connected_components, neighbours};
use crate::depth::{sample_grid, sample_step};
use crate::features::Luma;
use crate::geometry::{Model, plane_depth};
use crate::image::{filled, reserve};
use crate::statistics::median;
use crate::{InverseDepth, Result};

/// So many pixels of a view along each side of a part.
const PART: usize = 10;
/// Levels that cost 1, and beyond which a pixel shows something else.
const LEVELS: f32 = 4.0;
const MOST_LEVELS: f32 = 30.0;
/// How much of a difference that is the same all over a part counts: light changes with the place that one looks from. Where pixels of a set with
/// white walls land changes little from .1 to .25; with all of it they land three times as far off.
const LIGHT: f32 = 0.15;
/// The most that a part costs, what it does where no other photo sees it, and beyond which it is not taken for any plane.
const MOST_COST: f32 = 4.0;
const UNSEEN: f32 = 1.0;
const TOO_MUCH: f32 = 3.0;
/// A part that is measured is taken for a plane's if it costs less: its distance in tolerances.
const MEASURED: f32 = 2.0;
/// That two planes meet costs this, and so much more if they are not close there.
const CHANGE: f32 = 0.25;
const GAP: f32 = 1.0;
/// Gap in tolerances at which that is all of it.
const WIDE: f64 = 4.0;
/// And so many times more where both parts look the same: that is 1/e of it where they differ by so many levels.
const ALIKE: f32 = 12.0;
const EDGE: f32 = 10.0;
/// What another photo sees at a very flat angle, or from very near, moves by more than this many times as much as most: that says nothing of
/// how far planes are apart.
const MOST_PARALLAX: f64 = 1.5;

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

/// One photo next to the others.
pub(super) struct Scene<'a> {
    pub size: (usize, usize),
    pub view: &'a Luma,
    /// To the photo that sees the same.
    pub model: Model,
    /// By how many of that one's pixels most samples move per unit of inverse depth.
    pub parallax: f64,
    /// Distance of what is part of a plane, in that one's pixels.
    pub tolerance: f64,
    pub others: Vec<NeighbourView<'a>>,
}

/// Another photo.
pub(super) struct NeighbourView<'a> {
    /// Leads there.
    pub model: Model,
    pub view: &'a Luma,
    pub size: (usize, usize),
    /// How many times as bright this photo is as that one.
    pub gain: f32,
}

impl PlaneDepth {
    /// Whether a pixel is on a plane.
    pub fn covers(&self, [x, y]: [f64; 2]) -> bool {
        let at = (y / self.part) as usize * self.columns + (x / self.part) as usize;
        self.on_plane.get(at).is_some_and(|on| *on)
    }
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
        for NeighbourView { model, view, size, gain } in &self.others {
            let off = |pixel: &[f64; 2]| {
                let place = model.project(pixel[0], pixel[1], plane_depth(plane, *pixel))?;
                let off = brightness_at(self.view, self.size, *pixel) - gain * brightness_at(view, *size, place);
                Some(off).filter(|off| !off.is_nan())
            };
            let found: Vec<f32> = pixels.iter().filter_map(off).collect();
            if 2 * found.len() > pixels.len() {
                let count = found.len() as f32;
                let light = (1.0 - LIGHT) * found.iter().sum::<f32>() / count;
                let sum: f32 = found.iter().map(|off| (off - light).abs().min(MOST_LEVELS)).sum();
                (total, seeing) = (total + sum / count, seeing + 1.0);
            }
        }
        if seeing > 0.0 { (total / seeing / LEVELS).min(MOST_COST) } else { UNSEEN }
    }

    /// By how many levels each part differs from the next to the right, and below: between their medians, as a joint of a wall is no edge of it.
    fn edges(&self, columns: usize, rows: usize) -> Result<Vec<[f32; 2]>> {
        let Luma { data, width, .. } = self.view;
        let mut levels = filled(columns * rows, f64::NAN)?;
        for (node, level) in levels.iter_mut().enumerate() {
            let lines = data.chunks_exact(*width).skip(node / columns * PART).take(PART);
            let pixels = lines.flat_map(|line| line.iter().skip(node % columns * PART).take(PART));
            *level = median(pixels.filter(|v| !v.is_nan()).map(|v| f64::from(*v)).collect()).unwrap_or(f64::NAN);
        }
        let mut edges = filled(columns * rows, [0.0; 2])?;
        for (node, edges) in edges.iter_mut().enumerate() {
            for (edge, next) in edges.iter_mut().zip([node + 1, node + columns]) {
                // Nothing where one of them is masked.
                *edge = levels.get(next).map_or(0.0, |level| (level - levels[node]).abs().max(0.0) as f32);
            }
        }
        Ok(edges)
    }

    /// What it costs that each part is on each plane, and whether it is open: not both textured and `known`.
    fn costs(
        &self,
        planes: &[[f64; 3]],
        known: Option<&InverseDepth>,
        (columns, rows): (usize, usize),
    ) -> Result<(Vec<f32>, Vec<bool>)> {
        let mut costs = filled(columns * rows * planes.len(), 0.0)?;
        let mut open = filled(columns * rows, false)?;
        for (node, costs) in costs.chunks_exact_mut(planes.len()).enumerate() {
            let place = [node % columns, node / columns];
            let (pixels, middle) = (self.pixels(place), place.map(|at| (at as f64 + 0.5) * self.part()));
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
        Ok((costs, open))
    }

    /// Pixels of the photo along a part.
    fn part(&self) -> f64 {
        PART as f64 * self.size.0 as f64 / self.view.width as f64
    }

    /// Decides which part is on which plane. What is `known` and textured is not asked.
    pub fn label(&self, planes: &[[f64; 3]], known: Option<&InverseDepth>) -> Result<PlaneDepth> {
        let (columns, rows) = (self.view.width.div_ceil(PART), self.view.height.div_ceil(PART));
        let part = self.part();
        let (costs, open) = self.costs(planes, known, (columns, rows))?;
        let edges = self.edges(columns, rows)?;
        // How far apart two planes are between neighbouring parts, from 0 to 1.
        let gap = |[a, b]: [usize; 2], labels: [usize; 2]| {
            let along = |of: &dyn Fn(usize) -> usize| 0.5 * part * (of(a) + of(b) + 1) as f64;
            let between = [along(&|node| node % columns), along(&|node| node / columns)];
            let [one, two] = labels.map(|label| plane_depth(planes[label], between));
            let parallax = self.model.parallax(between, 0.5 * (one + two)).min(MOST_PARALLAX * self.parallax);
            ((one - two).abs() * parallax / (WIDE * self.tolerance)).min(1.0) as f32
        };
        let apart = |[a, b]: [usize; 2], labels: [usize; 2]| {
            if labels[0] == labels[1] {
                return 0.0;
            }
            let alike = libm::expf(-edges[a][usize::from(b != a + 1)] / EDGE);
            (1.0 + ALIKE * alike) * (CHANGE + GAP * gap([a, b], labels))
        };
        let labelling = Labelling { columns, rows, labels: planes.len(), costs };
        let labels = labelling.solve(&apart)?;
        let cost = |node: usize| labelling.costs[node * planes.len() + labels[node]];
        let taken = |node: usize| cost(node) < if open[node] { TOO_MUCH } else { MEASURED };
        let unseen = |node: usize| open[node] && cost(node) == UNSEEN;
        let torn = |a: usize, b: usize| {
            let pair = [a.min(b), a.max(b)];
            taken(a) && taken(b) && gap(pair, pair.map(|node| labels[node])) >= 1.0
        };
        // A surface cannot tear: what nobody else sees is better left to it, as far as it hangs together with where planes lie apart.
        let mut left = filled(columns * rows, false)?;
        let labels_of_unseen = (0..columns * rows).map(|node| u8::from(unseen(node))).collect();
        connected_components(labels_of_unseen, columns, usize::MAX, &mut |component| {
            let beside = |node: usize| neighbours(node, columns).into_iter().filter(|next| *next < columns * rows);
            let tears = |node: usize| beside(node).any(|next| torn(node, next));
            if component.iter().cloned().flatten().any(tears) {
                component.iter().for_each(|span| left[span.clone()].fill(true));
            }
        })?;
        let on_plane: Vec<bool> = (0..columns * rows).map(|node| open[node] && taken(node) && !left[node]).collect();
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
