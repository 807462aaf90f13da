//! The unknowns of bundle adjustment, and what the slopes of a pair of cameras are by them.

use nalgebra::{DVector, SVector, Vector3};

use super::bundle::FreeParameters;
use super::scene::Scene;
use crate::geometry::epipolar::Motion;

/// Number of slopes of a pair's errors: by turn and shift of the second camera, by the focal length of the first photo and of the second, by
/// the distortion.
pub(super) const SLOPES: usize = 9;
/// Where the focal lengths' begin.
const FOCAL: usize = 6;
/// Most unknowns that a pair depends on: focal length, distortion, and of each photo its pose and its share of the focal length.
const MOST: usize = 2 + 2 * 7;

/// Slopes of the errors of a pair, from the camera of landmarks' anchors to one that sees them: where a landmark appears depends on the motion
/// between the two.
pub(super) type Slopes = SVector<f64, SLOPES>;

/// In their order.
pub(super) fn slopes(turn: Vector3<f64>, shift: Vector3<f64>, [first, second, distortion]: [f64; 3]) -> Slopes {
    Slopes::from([turn.x, turn.y, turn.z, shift.x, shift.y, shift.z, first, second, distortion])
}

/// Which unknown is where: first the focal length, then the distortion, then each photo's pose and its share of the focal length.
pub(super) struct Unknowns {
    pub free: FreeParameters,
    /// The first one of each photo's pose; `None` where it stays.
    pub offsets: Vec<Option<usize>>,
    /// Each photo's share of the focal length; `None` where it stays.
    pub shares: Vec<Option<usize>>,
    pub count: usize,
}

impl Unknowns {
    pub fn of(scene: &Scene, root: usize, free: FreeParameters) -> Self {
        let per_photo = if free.positions { 6 } else { 3 };
        let mut count = if free.distortion { 2 } else { 1 };
        let (mut offsets, mut shares) = (Vec::new(), Vec::new());
        let mut next = |is_unknown: bool, size: usize| {
            count += if is_unknown { size } else { 0 };
            is_unknown.then(|| count - size)
        };
        for (photo, camera) in scene.cameras.iter().enumerate() {
            offsets.push(next(camera.is_some() && photo != root, per_photo));
            shares.push(next(camera.is_some() && scene.estimates[photo].is_some(), 1));
        }
        Self { free, offsets, shares, count }
    }
}

/// Slopes by unknowns, in the order of these.
pub(super) struct Row {
    entries: [(usize, f64); MOST],
    count: usize,
    /// How many of them all who see a landmark have in common: those of the lens and the anchor's photo.
    shared: usize,
}

impl Row {
    /// Of no unknown.
    pub fn empty() -> Self {
        Self { entries: [(0, 0.0); MOST], count: 0, shared: 0 }
    }

    /// Unknown and slope.
    pub fn entries(&self) -> &[(usize, f64)] {
        &self.entries[..self.count]
    }

    /// Adds it to the sum of other rows of one landmark.
    pub fn add_to(&self, sum: &mut Vec<(usize, f64)>) {
        let (shared, own) = self.entries().split_at(self.shared);
        if sum.is_empty() {
            sum.extend(shared);
        } else {
            sum.iter_mut().zip(shared).for_each(|((_, sum), (_, slope))| *sum += slope);
        }
        sum.extend(own);
    }

    fn put(&mut self, at: usize, slopes: &[f64]) {
        for (i, slope) in slopes.iter().enumerate() {
            self.entries[self.count] = (at + i, *slope);
            self.count += 1;
        }
    }
}

impl Unknowns {
    /// The slopes of a pair by the unknowns of both photos, of which the anchor's is the first. The second camera turns and shifts relative to the first one: what
    /// the first one does is the opposite, in its own axes.
    pub fn row(&self, pair: [usize; 2], (rotation, _): &Motion, slopes: &Slopes) -> Row {
        let mut row = Row::empty();
        let [first, second, distortion] = [0, 1, 2].map(|i| slopes[FOCAL + i]);
        row.put(0, &[first + second]);
        if self.free.distortion {
            row.put(1, &[distortion]);
        }
        let motion = [0, 3].map(|at| slopes.fixed_rows::<3>(at).into_owned());
        let opposite = motion.map(|slopes| -rotation.tr_mul(&slopes));
        let [anchor, own] = pair;
        for (photo, [turn, shift], focal) in [(anchor, opposite, first), (own, motion, second)] {
            if let Some(at) = self.offsets[photo] {
                row.put(at, turn.as_slice());
                if self.free.positions {
                    row.put(at + 3, shift.as_slice());
                }
            }
            if let Some(at) = self.shares[photo] {
                row.put(at, &[focal]);
            }
            row.shared = if photo == anchor { row.count } else { row.shared };
        }
        row
    }

    /// The transpose of [`Unknowns::row`].
    pub fn change(&self, [anchor, own]: [usize; 2], (rotation, _): &Motion, step: &DVector<f64>) -> Slopes {
        let three = |at: Option<usize>| at.map_or(Vector3::zeros(), |at| step.fixed_rows::<3>(at).into_owned());
        let [first, second] = [anchor, own].map(|photo| {
            let turn = self.offsets[photo];
            [turn, turn.filter(|_| self.free.positions).map(|at| at + 3)].map(three)
        });
        let [turn, shift] = [0, 1].map(|i| second[i] - rotation * first[i]);
        let focal = |photo: usize| step[0] + self.shares[photo].map_or(0.0, |at| step[at]);
        let distortion = if self.free.distortion { step[1] } else { 0.0 };
        slopes(turn, shift, [focal(anchor), focal(own), distortion])
    }
}
