//! Rotation averaging: all rotations from those of pairs, first along a spanning tree of the pairs with most matches, then by
//! robust least squares over all of them (after Chatterjee & Govindu, *Efficient and Robust Large-Scale Rotation Averaging*,
//! 2013).

use nalgebra::{Matrix3, Vector3};

use super::least_squares::Equations;
use super::relative_pose::RelativePose;
use super::spanning_tree::spanning_tree;
use crate::geometry::calibrated::small_rotation;

const ROUNDS: usize = 30;
/// What counts as noise of a pair's rotation, in radians: beyond it a pair loses weight.
const NOISE: f64 = 0.01;
/// What looks farther apart than this, in radians, cannot be shown on one plane.
const WIDE: f64 = 1.1;

/// The rotations of all photos that the pairs connect with `root`, whose own is the identity.
pub(super) fn average(poses: &[RelativePose], photos: usize, root: usize) -> Vec<Option<Matrix3<f64>>> {
    let mut rotations = along_tree(poses, photos, root);
    for _ in 0..ROUNDS {
        let Some(largest) = improve(&mut rotations, poses, root) else { break };
        if largest < 1e-9 {
            break;
        }
    }
    rotations
}

/// The angle in radians by which a pair's rotation contradicts those of its photos.
pub(super) fn contradiction(pose: &RelativePose, rotations: &[Option<Matrix3<f64>>]) -> Option<f64> {
    let [from, to] = pose.photos.map(|photo| rotations[photo]);
    Some(logarithm(&((to? * from?.transpose()) * pose.rotation.transpose())).norm())
}

fn along_tree(poses: &[RelativePose], photos: usize, root: usize) -> Vec<Option<Matrix3<f64>>> {
    let pairs: Vec<_> = poses.iter().map(|pose| (pose.photos, pose.weight)).collect();
    let mut rotations: Vec<Option<Matrix3<f64>>> = vec![None; photos];
    rotations[root] = Some(Matrix3::identity());
    for (pair, added) in spanning_tree(&pairs, photos, root) {
        let RelativePose { photos, rotation, .. } = &poses[pair];
        let step = if added == 1 { *rotation } else { rotation.transpose() };
        rotations[photos[added]] = rotations[photos[1 - added]].map(|known| step * known);
    }
    rotations
}

/// Whether every camera looks another way than some other one by more than [`WIDE`], so that none shows on a plane what all do.
pub(super) fn are_wide(rotations: &[Option<Matrix3<f64>>]) -> bool {
    let axes: Vec<_> = rotations.iter().flatten().map(|rotation| rotation.row(2).into_owned()).collect();
    axes.iter().all(|one| axes.iter().any(|other| one.dot(other) < libm::cos(WIDE)))
}

/// One round of reweighted least squares; the largest turn.
fn improve(rotations: &mut [Option<Matrix3<f64>>], poses: &[RelativePose], root: usize) -> Option<f64> {
    let mut count = 0;
    let numbers: Vec<Option<usize>> = rotations
        .iter()
        .enumerate()
        .map(|(photo, rotation)| {
            (rotation.is_some() && photo != root).then(|| {
                count += 1;
                count - 1
            })
        })
        .collect();
    // The same matrix for each axis.
    let mut axes = [0, 1, 2].map(|_| Equations::zeros(count));
    for pose in poses {
        let [a, b] = pose.photos;
        let (Some(from), Some(to)) = (rotations[a], rotations[b]) else { continue };
        // In the world's axes: what the turn of b less that of a should be.
        let error = to.tr_mul(&logarithm(&((pose.rotation * from) * to.transpose())));
        let angle = error.norm();
        let weight = pose.weight.sqrt() / (1.0 + (angle / NOISE) * (angle / NOISE));
        for (axis, error) in axes.iter_mut().zip(error.iter()) {
            for (photo, sign) in [(numbers[a], -1.0), (numbers[b], 1.0)] {
                let Some(i) = photo else { continue };
                axis.add(i, i, weight);
                axis.gradient[i] -= sign * weight * error;
            }
            if let (Some(i), Some(j)) = (numbers[a], numbers[b]) {
                axis.add(i, j, -weight);
            }
        }
    }
    let [x, y, z] = axes.map(Equations::solve);
    let turns = [x?, y?, z?];
    let mut largest = 0.0f64;
    for (rotation, number) in rotations.iter_mut().zip(&numbers) {
        if let (Some(rotation), Some(i)) = (rotation, *number) {
            let turn = Vector3::new(turns[0][i], turns[1][i], turns[2][i]);
            largest = largest.max(turn.norm());
            *rotation *= small_rotation(turn);
        }
    }
    Some(largest)
}

/// The rotation vector of a rotation.
fn logarithm(r: &Matrix3<f64>) -> Vector3<f64> {
    let axis = Vector3::new(r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]);
    let (sine, cosine) = (0.5 * axis.norm(), 0.5 * (r.trace() - 1.0));
    let angle = libm::atan2(sine, cosine);
    if sine < 1e-12 { axis * 0.5 } else { axis * (0.5 * angle / sine) }
}
