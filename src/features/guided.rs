//! Guided matching: candidates are restricted to where a known geometry predicts the keypoint.

use super::matching::{check, pairs};
use super::nearest::{Nearest, squared_distance};
use super::{Features, MatchOptions, Pair};
use crate::geometry::{Model, epipolar_direction};
use crate::image::{check_size, defaults, filled, zeroed};
use crate::observer::{Observer, report};
use crate::{Error, InverseDepth, Result, Stage};

/// Side of a cell of the grid that the reference's keypoints are put into, in pixels.
const CELL: f64 = 16.0;
/// Target keypoints between two reports.
const BATCH: usize = 2048;

/// Geometry that predicts where in the reference the point seen at a target pixel can be.
#[derive(Debug, Clone, Copy)]
pub struct MatchGuide<'a> {
    /// Target to reference.
    pub forward: &'a Model,
    /// The target's inverse depth, of the photo's size: the search is centred on the place it predicts.
    pub depth: Option<&'a InverseDepth>,
    /// Least and largest inverse depth: where the map is missing or has a hole, the search runs between the two places they
    /// predict.
    pub range: [f64; 2],
    /// Largest distance from the epipolar line, in pixels of the reference.
    pub band: f64,
    /// Largest distance along the epipolar line from the predicted place, in pixels of the reference; in any direction when
    /// the model has no parallax.
    pub reach: f64,
}

/// As [`match_features`](super::match_features), but only among the keypoints that the guide allows. As these are few, a
/// larger `ratio` will do.
///
/// # Errors
/// `invalid-argument` for options or a guide out of range, `size-mismatch` for features that lack descriptors or a depth
/// map of another size than the target, `out-of-memory`, `aborted`.
pub fn match_guided(
    target: &Features,
    reference: &Features,
    guide: &MatchGuide<'_>,
    options: &MatchOptions,
    observer: &mut dyn Observer,
) -> Result<Vec<Pair>> {
    check(target, reference, options)?;
    guide.check(target)?;
    let both = [target.ordered_by_place()?, reference.ordered_by_place()?];
    let [(target, _), (reference, _)] = &both;
    let grid = Grid::new(reference)?;
    let mut of_target: Vec<Nearest> = defaults(target.keypoints.len())?;
    let mut of_reference: Vec<Nearest> = defaults(reference.keypoints.len())?;
    for (i, (keypoint, descriptor)) in target.keypoints.iter().zip(&target.descriptors).enumerate() {
        if i % BATCH == 0 {
            report(observer, Stage::Match, i as f32 / target.keypoints.len() as f32)?;
        }
        let Some(region) = guide.region(f64::from(keypoint.x), f64::from(keypoint.y)) else { continue };
        grid.visit(&region, |index| {
            let k = index as usize;
            let place = &reference.keypoints[k];
            if region.contains([f64::from(place.x), f64::from(place.y)]) {
                let distance = squared_distance(descriptor, &reference.descriptors[k]);
                of_target[i].update(distance, index);
                of_reference[k].update(distance, i as u32);
            }
        });
    }
    report(observer, Stage::Match, 1.0)?;
    pairs(&both, [&of_target, &of_reference], options)
}

/// As [`match_guided`], and what was matched `earlier` as well, unless one of its features is matched to another now.
///
/// # Errors
/// As [`match_guided`].
pub(crate) fn match_again(
    target: &Features,
    reference: &Features,
    earlier: impl IntoIterator<Item = Pair>,
    guide: &MatchGuide<'_>,
    options: &MatchOptions,
    observer: &mut dyn Observer,
) -> Result<Vec<Pair>> {
    let mut pairs = match_guided(target, reference, guide, options, observer)?;
    let mut matched = [filled(target.keypoints.len(), false)?, filled(reference.keypoints.len(), false)?];
    for pair in &pairs {
        matched[0][pair.target as usize] = true;
        matched[1][pair.reference as usize] = true;
    }
    let free = |pair: &Pair| !matched[0][pair.target as usize] && !matched[1][pair.reference as usize];
    pairs.extend(earlier.into_iter().filter(free));
    Ok(pairs)
}

/// All points within `radius` of the way from `from` to `to`.
struct Region {
    from: [f64; 2],
    to: [f64; 2],
    radius: f64,
}

impl Region {
    fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let ([x0, y0], [x1, y1]) = (self.from, self.to);
        let (dx, dy) = (x1 - x0, y1 - y0);
        let square = dx * dx + dy * dy;
        let along = (x - x0) * dx + (y - y0) * dy;
        let t = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
        let (ex, ey) = (x - x0 - t * dx, y - y0 - t * dy);
        ex * ex + ey * ey <= self.radius * self.radius
    }

    /// Least and largest x of the points with y from `low` to `high`, or somewhat more; reversed when there are none.
    fn extent(&self, low: f64, high: f64) -> [f64; 2] {
        let upright = self.from[1] <= self.to[1];
        let ([x0, y0], [x1, y1]) = if upright { (self.from, self.to) } else { (self.to, self.from) };
        let (low, high) = (low - self.radius, high + self.radius);
        if y0 > high || y1 < low {
            return [0.0, -1.0];
        }
        let at = |y: f64| x0 + (x1 - x0) * ((y - y0) / (y1 - y0));
        let (a, b) = (if y0 < low { at(low) } else { x0 }, if y1 > high { at(high) } else { x1 });
        [a.min(b) - self.radius, a.max(b) + self.radius]
    }
}

impl MatchGuide<'_> {
    fn check(&self, target: &Features) -> Result<()> {
        for (name, value) in [("band", self.band), ("reach", self.reach)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::InvalidArgument { name, expected: "a finite number above 0", value }.into());
            }
        }
        for value in self.range {
            if !value.is_finite() {
                return Err(Error::InvalidArgument { name: "range", expected: "finite", value }.into());
            }
        }
        self.forward.check()?;
        self.depth.map_or(Ok(()), |map| check_size("targetDepth", map.size(), target.size))
    }

    /// Where the point at (x, y) can be; `None` behind the camera.
    fn region(&self, x: f64, y: f64) -> Option<Region> {
        if !self.forward.has_parallax() {
            let place = self.forward.project(x, y, 0.0)?;
            return Some(Region { from: place, to: place, radius: self.reach });
        }
        let depth = self.depth.map_or(f64::NAN, |map| map.sample(x, y));
        if depth.is_finite() {
            let [u, v] = self.forward.project(x, y, depth)?;
            let [dx, dy] = epipolar_direction(&self.forward.e, [u, v, 1.0]);
            let length = (dx * dx + dy * dy).sqrt();
            let step = if length > 0.0 { self.reach / length } else { 0.0 };
            let (dx, dy) = (dx * step, dy * step);
            return Some(Region { from: [u - dx, v - dy], to: [u + dx, v + dy], radius: self.band });
        }
        let [a, b] = self.range;
        let (from, to) = (self.visible(x, y, a, b)?, self.visible(x, y, b, a)?);
        Some(Region { from, to, radius: self.band })
    }

    /// Image of (x, y) with inverse depth `d` or, when that is behind the camera, with nearly the last one in front of it
    /// on the way from `other`.
    fn visible(&self, x: f64, y: f64, d: f64, other: f64) -> Option<[f64; 2]> {
        let [here, there] = [d, other].map(|d| self.forward.transform(x, y, d)[2]);
        if here > 0.0 {
            return self.forward.project(x, y, d);
        }
        // At a thousandth of the third coordinate the image is a thousand times as far along the line.
        self.forward.project(x, y, other + (d - other) * (0.999 * there / (there - here)))
    }
}

/// The reference's keypoints by cells.
struct Grid {
    columns: usize,
    rows: usize,
    /// Where each cell's keypoints start in `order`; one more for where the last ones end.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Grid {
    fn new(features: &Features) -> Result<Self> {
        let cells = |side: usize| (side as f64 / CELL) as usize + 1;
        let (columns, rows) = (cells(features.size.0), cells(features.size.1));
        // Places outside the frame count as on its border, those that are no numbers as 0.
        let cell = |i: usize| {
            let k = &features.keypoints[i];
            at(f64::from(k.y), rows) * columns + at(f64::from(k.x), columns)
        };
        let n = features.keypoints.len();
        // Counted one cell further on, so that filling the cells moves their starts to where they belong.
        let mut starts: Vec<u32> = zeroed(columns.saturating_mul(rows).saturating_add(2))?;
        (0..n).for_each(|i| starts[cell(i) + 2] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut order: Vec<u32> = zeroed(n)?;
        for i in 0..n {
            let next = &mut starts[cell(i) + 1];
            order[*next as usize] = i as u32;
            *next += 1;
        }
        Ok(Self { columns, rows, starts, order })
    }

    /// Calls `each` with all keypoints in the region, and some around.
    fn visit(&self, region: &Region, mut each: impl FnMut(u32)) {
        let (a, b) = (region.from[1], region.to[1]);
        let (top, bottom) = (a.min(b) - region.radius, a.max(b) + region.radius);
        for row in at(top, self.rows)..=at(bottom, self.rows) {
            // The outermost cells also hold what lies outside the frame.
            let low = if row == 0 { f64::NEG_INFINITY } else { row as f64 * CELL };
            let high = if row + 1 == self.rows { f64::INFINITY } else { (row + 1) as f64 * CELL };
            let [left, right] = region.extent(low, high);
            if left <= right {
                let first = row * self.columns;
                let start = self.starts[first + at(left, self.columns)] as usize;
                let end = self.starts[first + at(right, self.columns) + 1] as usize;
                self.order[start..end].iter().for_each(|&i| each(i));
            }
        }
    }
}

/// The cell of a coordinate.
fn at(v: f64, cells: usize) -> usize {
    ((v / CELL) as usize).min(cells - 1)
}
