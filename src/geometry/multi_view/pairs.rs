//! Normal equations of bundle adjustment, summed pair by pair: a pair of cameras has nine slopes, whatever the number of unknowns.

use nalgebra::DVector;

use super::jacobian::{Row, SLOPES, Slopes, Unknowns};
use super::least_squares::Equations;
use super::scene::{Camera, Scene};
use crate::geometry::epipolar::Motion;
use crate::geometry::levenberg_marquardt::NormalEquations;

/// R and t from each camera to each other.
pub(super) struct Motions {
    cameras: usize,
    motions: Vec<Option<Motion>>,
}

impl Motions {
    pub fn of(scene: &Scene) -> Self {
        let cameras = &scene.cameras;
        let from = |from: &Option<Camera>| cameras.iter().map(|to| Some((*from)?.motion_to(to.as_ref()?))).collect();
        Self { cameras: cameras.len(), motions: cameras.iter().flat_map(|camera| -> Vec<_> { from(camera) }).collect() }
    }

    pub fn between(&self, pair: [usize; 2]) -> Option<&Motion> {
        self.motions[self.index(pair)].as_ref()
    }

    /// Where something of a pair is among that of all.
    pub fn index(&self, [from, to]: [usize; 2]) -> usize {
        from * self.cameras + to
    }

    /// The pair that has an index.
    fn photos(&self, index: usize) -> [usize; 2] {
        [index / self.cameras, index % self.cameras]
    }

    /// Every pair with a motion, by its index.
    fn pairs(&self) -> impl Iterator<Item = (usize, [usize; 2], &Motion)> {
        let pair = |(i, motion): (usize, _)| Some((i, self.photos(i), Option::as_ref(motion)?));
        self.motions.iter().enumerate().filter_map(pair)
    }

    /// Slopes by the unknowns of those of a pair, by its index; none without a motion.
    pub fn row(&self, unknowns: &Unknowns, pair: usize, slopes: &Slopes) -> Row {
        let row = |motion: &Motion| unknowns.row(self.photos(pair), motion, slopes);
        self.motions[pair].as_ref().map_or_else(Row::empty, row)
    }

    /// By each pair's slopes, how much its errors change with the unknowns; 0 where there is no motion.
    pub fn changes(&self, unknowns: &Unknowns, step: &DVector<f64>) -> Vec<Slopes> {
        let mut changes = vec![Slopes::zeros(); self.motions.len()];
        self.pairs().for_each(|(i, pair, motion)| changes[i] = unknowns.change(pair, motion, step));
        changes
    }
}

/// Normal equations of each pair of cameras by its own slopes.
pub(super) struct PairEquations(Vec<Option<NormalEquations<SLOPES>>>);

impl PairEquations {
    /// Of no residual.
    pub fn zeros(motions: &Motions) -> Self {
        Self(motions.motions.iter().map(|_| None).collect())
    }

    /// Those of a pair, by its index.
    pub fn of(&mut self, pair: usize) -> &mut NormalEquations<SLOPES> {
        self.0[pair].get_or_insert_with(NormalEquations::zeros)
    }

    /// Adds them to those of the unknowns; the cost is up to the caller.
    pub fn add_to(&self, equations: &mut Equations, unknowns: &Unknowns, motions: &Motions) {
        for (i, pair, motion) in motions.pairs() {
            let Some(own) = &self.0[i] else { continue };
            let row = |slopes: &Slopes| unknowns.row(pair, motion, slopes);
            row(&own.gradient).entries().iter().for_each(|(at, value)| equations.gradient[*at] += value);
            let mut matrix = own.matrix;
            matrix.fill_upper_triangle_with_lower_triangle();
            let columns: Vec<Row> = (0..SLOPES).map(|i| row(&matrix.column(i).into_owned())).collect();
            for (a, (at, _)) in columns[0].entries().iter().enumerate() {
                let row = row(&Slopes::from_fn(|i, _| columns[i].entries()[a].1));
                row.entries()[..=a].iter().for_each(|(other, value)| equations.add(*at, *other, *value));
            }
        }
    }
}
