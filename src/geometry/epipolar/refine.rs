//! Sampson refinement: least squares on the Sampson distances, or a robust cost of them, within the matrices of rank 2.

use nalgebra::{Matrix3, SVector, Vector3};

use super::fundamental::{Fundamental, cofactors};
use crate::geometry::correspondences::Correspondences;
use crate::geometry::levenberg_marquardt::{LeastSquares, NormalEquations, minimise};

/// Most iterations.
const ITERATIONS: usize = 50;

/// The entries of F, column by column.
type Entries = SVector<f64, 9>;

/// Tukey's biweight of the Sampson distances of the points, to which all distances beyond its `support` are the same.
struct SampsonDistances<'a> {
    points: &'a Correspondences,
    support: f64,
}

impl LeastSquares for SampsonDistances<'_> {
    type State = Fundamental;
    type Equations = NormalEquations<9>;

    /// Steps lead along the matrices of rank 2 and norm 1: the gradient is projected onto their tangent space.
    fn normal_equations(&self, Fundamental(f): &Fundamental) -> NormalEquations<9> {
        let normals = [unit(*f), unit(cofactors(f))];
        let mut equations = NormalEquations::zeros();
        for p in self.points.iter() {
            let (distance, mut derivative) =
                sampson_distance(f, &Vector3::new(p.x, p.y, 1.0), &Vector3::new(p.u, p.v, 1.0));
            for normal in &normals {
                derivative -= normal * derivative.dot(normal);
            }
            // s²/6 (1 − (1 − r²/s²)³), expanded: ½r² where the support s is infinite.
            let share = (distance * distance / (self.support * self.support)).min(1.0);
            let bounded = (distance * distance).min(self.support * self.support);
            equations.cost += 0.5 * bounded * (1.0 - share + share * share / 3.0);
            let weight = (1.0 - share) * (1.0 - share);
            equations.add(&Entries::from_column_slice(derivative.as_slice()), distance, weight);
        }
        equations
    }

    fn moved(&self, f: &Fundamental, step: &Entries) -> Fundamental {
        retract(f.0 + Matrix3::from_column_slice(step.as_slice()))
    }
}

/// The Sampson distance of a match x, u, third coordinates 1, and its derivative by F: of s/√(|l|² + |k|²), l and k being the first two
/// coordinates of both epipolar lines.
pub(super) fn sampson_distance(f: &Matrix3<f64>, x: &Vector3<f64>, u: &Vector3<f64>) -> (f64, Matrix3<f64>) {
    let (mut line, mut back) = (f * x, f.tr_mul(u));
    let s = u.dot(&line);
    (line[2], back[2]) = (0.0, 0.0);
    let square = line.norm_squared() + back.norm_squared();
    let (inverse, q) = (1.0 / square.sqrt(), s / square);
    (s * inverse, (u * (x - back * q).transpose() - line * x.transpose() * q) * inverse)
}

fn unit(m: Matrix3<f64>) -> Matrix3<f64> {
    m / m.norm().max(f64::MIN_POSITIVE)
}

/// A matrix of rank 2 and norm 1 next to `f`, by Newton's method along the gradient of the determinant.
fn retract(mut f: Matrix3<f64>) -> Fundamental {
    // It converges quadratically, from a determinant that is small already.
    for _ in 0..3 {
        let gradient = cofactors(&f);
        f -= gradient * (f.determinant() / gradient.norm_squared().max(f64::MIN_POSITIVE));
    }
    Fundamental(unit(f))
}

/// Minimises the sum of squared Sampson distances over all of `points`, from `start`; never worse. Stops when a step
/// reduces the cost by less than the fraction `tolerance`.
pub(super) fn refine(points: &Correspondences, start: &Fundamental, tolerance: f64) -> Fundamental {
    refine_robustly(points, start, f64::INFINITY, tolerance)
}

/// As [`refine`], but of Tukey's biweight of the distances.
pub(super) fn refine_robustly(
    points: &Correspondences,
    start: &Fundamental,
    support: f64,
    tolerance: f64,
) -> Fundamental {
    minimise(&SampsonDistances { points, support }, retract(start.0), tolerance, ITERATIONS).0
}
