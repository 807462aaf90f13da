//! How far what is known of the border of the overlap would be from where it belongs: what only the target shows continues it.

use crate::Result;
use crate::depth::{KnownDepth, OtherView, sample_weight};
use crate::geometry::DepthSample;
use crate::image::reserve_more;
use crate::rect::diagonal;

/// Misalignment beyond this share of the reference's diagonal is all the same.
const MOST: f64 = 0.0135;
/// What is less near than this says nothing.
const LEAST_NEARNESS: f64 = 0.01;

/// Where something near the border of the overlap is.
struct Known {
    target: [f64; 2],
    reference: [f64; 2],
    weight: f64,
}

/// What is known near the border of the overlap.
#[derive(Default)]
pub(super) struct Border {
    known: Vec<Known>,
    diagonal: f64,
}

impl Border {
    /// Of a target of this size, by what is `known` of its depth and by its matches.
    pub fn new(
        known: &KnownDepth<'_>,
        matches: &[DepthSample],
        size: (usize, usize),
        other: OtherView<'_>,
    ) -> Result<Self> {
        let mut found = Vec::new();
        let of_map = known.samples()?;
        for (samples, weight) in [(&of_map[..], sample_weight(size)), (matches, 1.0)] {
            for sample in samples {
                let nearness = other.nearness(sample, size);
                let [x, y] = sample.point;
                if nearness >= LEAST_NEARNESS
                    && let Some(reference) = other.model.project(x, y, sample.depth)
                {
                    reserve_more(&mut found, 1)?;
                    found.push(Known { target: sample.point, reference, weight: weight * nearness });
                }
            }
        }
        Ok(Self { known: found, diagonal: diagonal(other.size) })
    }

    /// The mean distance from where it belongs, as a share of the reference's diagonal; `place` says where a point of the target lands.
    pub fn misalignment(&self, place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for Known { target, reference: [u, v], weight } in &self.known {
            let distance = |[x, y]: [f64; 2]| ((x - u) * (x - u) + (y - v) * (y - v)).sqrt() / self.diagonal;
            sum += weight * place(*target).map_or(MOST, distance).min(MOST);
            total += weight;
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;

    #[test]
    fn misalignment_is_the_mean_distance_and_bounded() {
        let known = |x: f64, weight: f64| Known { target: [x, 0.0], reference: [x - 10.0, 5.0], weight };
        let border = Border { known: vec![known(20.0, 1.0), known(30.0, 3.0)], diagonal: 1000.0 };
        let shifted = |by: f64| move |[x, y]: [f64; 2]| Some([x - 10.0 + by, y + 5.0]);
        assert!(border.misalignment(&shifted(0.0)).abs() < 1e-12);
        assert!((border.misalignment(&shifted(4.0)) - 0.004).abs() < 1e-12);
        // The second one, which weighs three times as much, is far off or behind the camera.
        let far = |[x, y]: [f64; 2]| shifted(if x > 25.0 { 500.0 } else { 0.0 })([x, y]);
        let behind = |[x, y]: [f64; 2]| shifted(0.0)([x, y]).filter(|_| x < 25.0);
        assert!((border.misalignment(&far) - 0.75 * MOST).abs() < 1e-12);
        assert!((border.misalignment(&behind) - 0.75 * MOST).abs() < 1e-12);
        assert!(Border::default().misalignment(&behind).abs() < 1e-12);
    }
}
