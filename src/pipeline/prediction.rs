//! What a person will see of an alignment, predicted on a coarse grid of the target before anything is rendered: where the seam
//! would run, what would differ there, and how the target would be distorted where it shows.

use wide::f32x4;

use super::bilinear::{Bilinear, in_cells};
use super::misalignment::Border;
use super::picture::Picture;
use super::straightness::straightness;
use crate::features::LineSegment;
use crate::geometry::{MOST_ANISOTROPY, Model, log_singular_value_ratio};
use crate::image::reserve;
use crate::mosaic::{Choice, predict_seam};
use crate::{ImageView, Result};

/// Cells of the grid, about.
const CELLS: usize = 6000;
/// Sides of the squares whose mean colours are compared, next to the square root of a cell's: fine enough for a line to be seen,
/// coarse enough for noise not to be.
const SQUARE: f64 = 0.75;
/// Standard deviation of brightness, in levels, from which on a cell shows how it is bent.
const TEXTURE: f64 = 8.0;
/// Gains beyond these are no exposure.
const GAINS: [f64; 2] = [0.25, 4.0];
/// Bending beyond this is all the same.
const MOST_BENDING: f64 = 0.1;
/// What a unit of bending, of the curvature of straight lines, all of them looking bent, and a level of difference at the seam count, next to a unit of
/// anisotropy. Tuned by eye on 37 real pairs, both ways round, and those of lines on 50 more.
const BENDING_WEIGHT: f64 = 5.0;
const LINE_WEIGHT: f64 = 10.0;
const BENT_WEIGHT: f64 = 0.5;
const STEP_WEIGHT: f64 = 0.075;
/// The same of misalignment at the border of the overlap, as a share of the reference's diagonal. Tuned by eye on 54 real pairs: at twice the weight lamps and
/// cars lean, at none what stands on the border is joined badly.
const MISALIGNMENT_WEIGHT: f64 = 18.5;

/// Two photos of which alignments are to be compared.
pub(super) struct Prediction {
    target: Squares,
    reference: Squares,
    /// Straight lines of the target.
    lines: Vec<LineSegment>,
    border: Border,
    /// What the mosaic is shown on.
    picture: Picture,
    /// Of the target: cells a row, rows, and pixels along a cell's side.
    columns: usize,
    rows: usize,
    cell: usize,
    /// The squares of a cell: how many further they are than its first one, and where in it they are, x and y from 0 to 1.
    squares: Vec<(usize, [f64; 2])>,
    /// Share of each cell's bending that is seen.
    texture: Vec<f64>,
}

/// How unnatural a mosaic would look.
#[derive(Clone, Copy)]
pub(super) struct Flaws {
    /// The sum of anisotropy, bending and curvature of straight lines where the target shows, of the difference at the seam and of misalignment, each
    /// with its weight. 0 is perfect.
    pub sum: f64,
    /// At the border of the overlap, as a share of the reference's diagonal.
    pub misalignment: f64,
}

/// Mean colours of a photo's squares of `side` pixels, NaN where one of them is masked.
struct Squares {
    side: usize,
    columns: usize,
    /// And 0.
    colours: Vec<f32x4>,
}

impl Squares {
    fn new(photo: ImageView<'_>, side: usize) -> Result<Self> {
        let (columns, rows) = (photo.width() / side, photo.height() / side);
        let mut colours = Vec::new();
        reserve(&mut colours, columns * rows)?;
        let share = 1.0 / (side * side) as f32;
        for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
            let (mut sum, mut share) = ([0u32; 3], share);
            for row in y * side..(y + 1) * side {
                for pixel @ [r, g, b, _] in &photo.pixels()[row * photo.width() + x * side..][..side] {
                    if !photo.is_there(*pixel) {
                        share = f32::NAN;
                    }
                    sum = [sum[0] + u32::from(*r), sum[1] + u32::from(*g), sum[2] + u32::from(*b)];
                }
            }
            let [r, g, b] = sum.map(|sum| sum as f32 * share);
            colours.push(f32x4::new([r, g, b, 0.0]));
        }
        Ok(Self { side, columns, colours })
    }

    fn rows(&self) -> usize {
        self.colours.len() / self.columns.max(1)
    }

    /// Bilinear at a place counted in squares; `None` within half a square of the photo's border, outside, and next to masked pixels.
    #[inline(always)]
    fn sample(&self, place: [f64; 2]) -> Option<f32x4> {
        let colour = Bilinear::at(place, self.columns, self.rows())?.interpolate(&self.colours);
        is_there(colour).then_some(colour)
    }

    /// A footprint in this photo, its places counted in squares.
    fn footprint(&self, Footprint(corners): &Footprint) -> Footprint {
        Footprint(corners.map(|corner| in_cells(corner, [self.side as f64; 2])))
    }
}

/// Whether a mean colour is one.
fn is_there(colour: f32x4) -> bool {
    !colour.as_array_ref()[0].is_nan()
}

/// Where the corners of a cell land: the upper ones, then the lower ones.
#[derive(Clone, Copy)]
struct Footprint([[f64; 2]; 4]);

impl Footprint {
    /// Where a point of the cell lands, bilinear; x and y from 0 to 1.
    #[inline(always)]
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [a, b, c, d] = self.0;
        [0, 1].map(|k| {
            let (upper, lower) = (a[k] + (b[k] - a[k]) * x, c[k] + (d[k] - c[k]) * x);
            upper + (lower - upper) * y
        })
    }
}

impl Prediction {
    /// Of the `lines` of the target, those are to stay straight that show; what is known near the `border` of the overlap is to be aligned; and how much
    /// things lean and bend is what is seen of it in the `picture`: on the plane whatever is far to the side leans.
    pub fn new(
        [target, reference]: [ImageView<'_>; 2],
        lines: Vec<LineSegment>,
        border: Border,
        picture: Picture,
    ) -> Result<Self> {
        let cell = ((target.width() * target.height()) as f64 / CELLS as f64).sqrt();
        let side = ((SQUARE * cell.sqrt()) as usize).max(1);
        let squares = ((cell / side as f64) as usize).max(1);
        let [target, reference] = [target, reference].map(|photo| Squares::new(photo, side));
        let (target, reference) = (target?, reference?);
        let (columns, rows) = (target.columns / squares, target.rows() / squares);
        let cell = squares * side;
        let within = |i: usize| (i as f64 + 0.5) / squares as f64;
        let square = |i: usize| (i / squares * target.columns + i % squares, [i % squares, i / squares].map(within));
        let squares = (0..squares * squares).map(square).collect();
        let mut found =
            Self { lines, border, picture, cell, squares, target, reference, columns, rows, texture: Vec::new() };
        let cells = 0..columns * rows;
        found.texture = cells.map(|cell| (found.deviation(cell) / TEXTURE).min(1.0)).collect();
        Ok(found)
    }

    /// How unnatural the mosaic would look with this model and the target's inverse depth `depth` at x, y.
    pub fn flaws(&self, model: &Model, depth: &dyn Fn([f64; 2]) -> f64) -> Result<Flaws> {
        let place = |[x, y]: [f64; 2]| model.project(x, y, depth([x, y]));
        let corner =
            |i: usize| place([i % (self.columns + 1), i / (self.columns + 1)].map(|i| (i * self.cell) as f64 - 0.5));
        let corners: Vec<Option<[f64; 2]>> = (0..(self.columns + 1) * (self.rows + 1)).map(corner).collect();
        let footprints = (0..self.columns * self.rows).map(|cell| self.footprint(cell, &corners));
        let footprints: Vec<Option<Footprint>> = footprints.collect();
        let gains = self.gains(&footprints);
        let choices = footprints.iter().enumerate().map(|(cell, print)| self.choice(cell, gains, *print));
        let choices: Vec<Choice> = choices.collect();
        let shown = predict_seam(&choices, self.columns)?;
        let middle =
            |cell: usize| [cell % self.columns, cell / self.columns].map(|i| (i as f64 + 0.5) * self.cell as f64 - 0.5);
        let appears = self.picture.place(model);
        let places = (0..footprints.len()).map(|cell| match self.picture.surface {
            None => Some(footprints[cell].as_ref()?.at([0.5, 0.5])),
            Some(_) => appears(middle(cell), depth(middle(cell))),
        });
        let distortion = self.distortion(&places.collect::<Vec<_>>(), &shown);
        let shows = |point: [f64; 2]| {
            let [x, y] = point.map(|p| (p + 0.5) as usize / self.cell);
            x < self.columns && y < self.rows && shown[y * self.columns + x]
        };
        let lines = straightness(&self.lines, &place, &shows);
        let misalignment = self.border.misalignment(&place);
        let steps = self.steps(&choices, &shown);
        let lines = LINE_WEIGHT * lines.curvature + BENT_WEIGHT * lines.bent;
        Ok(Flaws { sum: distortion + lines + STEP_WEIGHT * steps + MISALIGNMENT_WEIGHT * misalignment, misalignment })
    }

    /// Where a cell lands, by the `corners` of all.
    fn footprint(&self, cell: usize, corners: &[Option<[f64; 2]>]) -> Option<Footprint> {
        let first = cell / self.columns * (self.columns + 1) + cell % self.columns;
        let below = first + self.columns + 1;
        Some(Footprint([corners[first]?, corners[first + 1]?, corners[below]?, corners[below + 1]?]))
    }

    /// The squares of a cell: their colours, and where in it they are.
    fn squares(&self, cell: usize) -> impl Iterator<Item = (f32x4, [f64; 2])> {
        let side = self.cell / self.target.side;
        let first = (cell / self.columns * self.target.columns + cell % self.columns) * side;
        self.squares.iter().map(move |&(further, within)| (self.target.colours[first + further], within))
    }

    /// Standard deviation of a cell's green, in levels.
    fn deviation(&self, cell: usize) -> f64 {
        let values = self.squares(cell).map(|(colour, _)| f64::from(colour.as_array_ref()[1]));
        let (sum, squares) = values.fold((0.0, 0.0), |(sum, squares), v| (sum + v, squares + v * v));
        let count = self.squares.len() as f64;
        (squares / count - sum * sum / (count * count)).max(0.0).sqrt()
    }

    /// The gains that bring the target's colours to the reference's.
    fn gains(&self, footprints: &[Option<Footprint>]) -> f32x4 {
        let mut sums = [[0.0f64; 3]; 2];
        for (cell, footprint) in footprints.iter().enumerate() {
            if let Some((own, within)) = self.squares(cell).nth(self.squares.len() / 2)
                && is_there(own)
                && let Some(print) = footprint.as_ref().map(|print| self.reference.footprint(print))
                && let Some(other) = self.reference.sample(print.at(within))
            {
                for (sum, colour) in sums.iter_mut().zip([own, other]) {
                    sum.iter_mut().zip(colour.to_array()).for_each(|(sum, v)| *sum += f64::from(v));
                }
            }
        }
        let [r, g, b] = [0, 1, 2].map(|c| {
            let gain = sums[1][c] / sums[0][c];
            if gain.is_finite() { gain.clamp(GAINS[0], GAINS[1]) as f32 } else { 1.0 }
        });
        f32x4::new([r, g, b, 0.0])
    }

    /// Which photos are valid in a cell, and how much they differ.
    fn choice(&self, cell: usize, gains: f32x4, footprint: Option<Footprint>) -> Choice {
        let (mut sum, mut count) = (0.0, 0);
        if let Some(footprint) = footprint {
            let footprint = self.reference.footprint(&footprint);
            for (own, within) in self.squares(cell).filter(|(own, _)| is_there(*own)) {
                if let Some(other) = self.reference.sample(footprint.at(within)) {
                    let [r, g, b, _] = (own * gains - other).abs().to_array();
                    sum += r + g + b;
                    count += 1;
                }
            }
        }
        let (x, y) = (cell % self.columns, cell / self.columns);
        // What the target does not show there it does not show at the seam either.
        if self.squares(cell).all(|(own, _)| !is_there(own)) {
            return Choice::Reference;
        }
        let border = x == 0 || y == 0 || x + 1 == self.columns || y + 1 == self.rows;
        match (2 * count > self.squares.len(), border) {
            (false, _) => Choice::Target,
            (true, true) => Choice::Reference,
            (true, false) => Choice::Both(sum / count as f32),
        }
    }

    /// Mean difference along the seam, in levels.
    fn steps(&self, choices: &[Choice], shown: &[bool]) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        let level = |cell: usize| match choices[cell] {
            Choice::Both(apart) => Some(f64::from(apart) / 3.0),
            _ => None,
        };
        for cell in 0..shown.len() {
            let right = (cell + 1) % self.columns != 0;
            for next in [Some(cell + 1).filter(|_| right), Some(cell + self.columns)].into_iter().flatten() {
                if next < shown.len()
                    && shown[cell] != shown[next]
                    && let Some(apart) = level(cell).or(level(next))
                {
                    (sum, count) = (sum + 0.5 * (apart + level(next).unwrap_or(apart)), count + 1);
                }
            }
        }
        if count > 0 { sum / f64::from(count) } else { 0.0 }
    }

    /// Mean anisotropy of the cells that show, and weighted mean bending of their texture.
    fn distortion(&self, places: &[Option<[f64; 2]>], shown: &[bool]) -> f64 {
        let (mut anisotropy, mut cells, mut bending, mut texture) = (0.0, 0, 0.0, 0.0);
        let inner = |i: usize, count: usize| i > 0 && i + 1 < count;
        for (cell, _) in shown.iter().enumerate().filter(|(_, shown)| **shown) {
            if !inner(cell % self.columns, self.columns) || !inner(cell / self.columns, self.rows) {
                continue;
            }
            let around = [cell, cell - 1, cell + 1, cell - self.columns, cell + self.columns].map(|i| places[i]);
            let weight = self.texture[cell];
            let (leaning, bent) = self.local(around).unwrap_or((MOST_ANISOTROPY, MOST_BENDING));
            (anisotropy, cells) = (anisotropy + leaning, cells + 1);
            (bending, texture) = (bending + weight * bent, texture + weight);
        }
        let mean = |sum: f64, count: f64| if count > 0.0 { sum / count } else { 0.0 };
        mean(anisotropy, f64::from(cells)) + BENDING_WEIGHT * mean(bending, texture)
    }

    /// Anisotropy and bending of a cell by where it and its left, right, upper and lower neighbours land. Bending is the length
    /// of the second differences along both axes, in cells.
    fn local(&self, [here, left, right, above, below]: [Option<[f64; 2]>; 5]) -> Option<(f64, f64)> {
        let (here, x, y) = (here?, [left?, right?], [above?, below?]);
        let size = self.cell as f64;
        let slope = |[a, b]: [[f64; 2]; 2], c: usize| 0.5 * (b[c] - a[c]) / size;
        let curve = |[a, b]: [[f64; 2]; 2], c: usize| (a[c] + b[c] - 2.0 * here[c]) / size;
        let leaning = log_singular_value_ratio([slope(x, 0), slope(y, 0), slope(x, 1), slope(y, 1)]);
        let curves = [curve(x, 0), curve(x, 1), curve(y, 0), curve(y, 1)];
        Some((leaning, curves.iter().map(|c| c * c).sum::<f64>().sqrt().min(MOST_BENDING)))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::super::picture::{Placed, Viewer};
    use super::*;
    use crate::Image;
    use crate::warp::Projection;

    /// Noise of 16 levels that is the same in every square of four pixels, a part of a scene from `left` on.
    fn photo(left: usize) -> Image {
        let level = |x: usize, y: usize| 100 + ((x / 4 * 31 + y / 4 * 17) % 16 * 7 % 16) as u8;
        let pixels = (0..240 * 160).flat_map(|i| {
            let level = level(left + i % 240, i / 240);
            [level, level, level, 255]
        });
        Image::new(pixels.collect(), 240, 160).unwrap()
    }

    #[test]
    fn what_differs_leans_or_bends_is_a_flaw() {
        let (target, reference) = (photo(0), photo(80));
        let line = LineSegment { start: [4.0, 80.0], end: [76.0, 80.0], width: 1.0, significance: 1.0 };
        let [prediction, with_line] = [vec![], vec![line]].map(|lines| {
            Prediction::new([target.view(), reference.view()], lines, Border::default(), Picture::plane()).unwrap()
        });
        let shifted = |x: f64| Matrix3::new(1.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        let flaws = |h: Matrix3<f64>, depth: &dyn Fn([f64; 2]) -> f64| {
            let model = Model { h, e: Vector3::new(10.0, 0.0, 0.0) };
            prediction.flaws(&model, depth).unwrap().sum
        };
        let flat = |_: [f64; 2]| 0.0;
        assert!(flaws(shifted(-80.0), &flat) < 0.01, "{}", flaws(shifted(-80.0), &flat));
        // Aligned badly; what only the target shows, the left third, leaning; and bent.
        assert!(flaws(shifted(-74.0), &flat) > 0.1);
        assert!(flaws(shifted(-80.0), &|[x, y]| if x < 80.0 { 0.02 * y } else { 0.0 }) > 0.1);
        let wave = |[x, _]: [f64; 2]| if x < 80.0 { (0.1 * x).sin() } else { 0.0 };
        assert!(flaws(shifted(-80.0), &wave) > 0.1);
        // The same is a larger flaw where it bends a straight line, but for one along the parallax.
        let upwards = Model { h: shifted(-80.0), e: Vector3::new(0.0, 10.0, 0.0) };
        let [without, with] = [&prediction, &with_line].map(|p| p.flaws(&upwards, &wave).unwrap().sum);
        assert!(with > without + 0.1, "{with} {without}");
        let sideways = Model { h: shifted(-80.0), e: Vector3::new(10.0, 0.0, 0.0) };
        let [without, with] = [&prediction, &with_line].map(|p| p.flaws(&sideways, &wave).unwrap().sum);
        assert!((with - without).abs() < 1e-9, "{with} {without}");
    }

    #[test]
    fn a_turned_camera_leans_on_the_plane_but_not_on_a_cylinder() {
        let (target, reference) = (photo(0), photo(0));
        let (viewer, placed) = (Viewer::upright((240, 160), 150.0), Placed::reference((240, 160)));
        let [to_pixels, to_rays] = viewer.calibration;
        let (sin, cos) = libm::sincos(0.8);
        let turn = Matrix3::new(cos, 0.0, -sin, 0.0, 1.0, 0.0, sin, 0.0, cos);
        let model = Model::homography(to_pixels * turn * to_rays);
        let cylinder = Picture::around(Some(Projection::Cylinder), &viewer, &placed, &[placed]).unwrap();
        let [plane, cylinder] = [Picture::plane(), cylinder].map(|picture| {
            let photos = [target.view(), reference.view()];
            let prediction = Prediction::new(photos, Vec::new(), Border::default(), picture).unwrap();
            prediction.flaws(&model, &|_| 0.0).unwrap().sum
        });
        assert!(plane > cylinder + 0.3, "{plane} {cylinder}");
    }
}
