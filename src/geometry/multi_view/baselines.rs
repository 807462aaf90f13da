//! Pairs of cameras whose distance hardly anything determines: those that see landmarks together, but none with a third camera.

use super::scene::Scene;

/// The standard deviation of the distance between two such cameras, in median depths: a wide baseline explains the narrow strip that both see
/// about as well as a short one does.
pub(super) const BASELINE_PRIOR: f64 = 0.1;
/// Fewer shared landmarks than this say little.
const MIN_SHARED: usize = 8;

/// The pairs of cameras that share enough landmarks, but hardly any with a third camera.
pub(super) fn two_view_pairs(scene: &Scene) -> Vec<[usize; 2]> {
    let count = scene.cameras.len();
    // Landmarks that no third camera sees, and those that one does.
    let mut shared = vec![[0; 2]; count * count];
    for landmark in &scene.landmarks {
        let photos = || std::iter::once(&landmark.anchor).chain(landmark.seen.iter()).map(|o| o.photo);
        for (i, from) in photos().enumerate() {
            for to in photos().skip(i + 1) {
                shared[from * count + to][usize::from(landmark.seen.len() > 1)] += 1;
            }
        }
    }
    let is_chosen = |at: &usize| shared[*at][0] >= MIN_SHARED && shared[*at][1] < MIN_SHARED;
    (0..count * count).filter(is_chosen).map(|at| [at / count, at % count]).collect()
}
