//! Small linear algebra: dense symmetric equations of any size, and eigenvectors of 3×3 matrices. Of what nalgebra has for either,
//! each instantiation would be several kilobytes of wasm.

use nalgebra::{Matrix3, Vector3};

/// A product: inlined wherever there is one, they would be a tenth of the module's growth each.
#[inline(never)]
pub(super) fn times(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    a * b
}

/// A x = b with a symmetric, positive definite A.
#[derive(Debug, Clone)]
pub(super) struct Equations {
    /// The lower triangle, row by row: of row i what is up to the diagonal.
    matrix: Vec<f64>,
    pub right: Vec<f64>,
}

impl Equations {
    pub fn zeros(count: usize) -> Self {
        Self { matrix: vec![0.0; count * (count + 1) / 2], right: vec![0.0; count] }
    }

    /// Adds to an entry of A, and to the one on the other side of the diagonal.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let (row, column) = if i > j { (i, j) } else { (j, i) };
        self.matrix[row * (row + 1) / 2 + column] += value;
    }

    /// Enlarges the diagonal by a share of itself.
    pub fn damp(&mut self, share: f64) {
        for i in 0..self.right.len() {
            let at = i * (i + 3) / 2;
            self.matrix[at] += share * self.matrix[at].max(1e-9);
        }
    }

    /// x, by Cholesky's factors; `None` unless A is positive definite.
    pub fn solve(mut self) -> Option<Vec<f64>> {
        let count = self.right.len();
        let start = |row: usize| row * (row + 1) / 2;
        for i in 0..count {
            for j in 0..=i {
                let (row, other) = (start(i), start(j));
                let mut sum = self.matrix[row + j];
                for k in 0..j {
                    sum -= self.matrix[row + k] * self.matrix[other + k];
                }
                if i > j {
                    self.matrix[row + j] = sum / self.matrix[other + j];
                } else if sum > 0.0 && sum.is_finite() {
                    self.matrix[row + j] = sum.sqrt();
                } else {
                    return None;
                }
            }
            let row = start(i);
            let known: f64 = (0..i).map(|k| self.matrix[row + k] * self.right[k]).sum();
            self.right[i] = (self.right[i] - known) / self.matrix[row + i];
        }
        for i in (0..count).rev() {
            let known: f64 = (i + 1..count).map(|k| self.matrix[start(k) + i] * self.right[k]).sum();
            self.right[i] = (self.right[i] - known) / self.matrix[start(i) + i];
        }
        self.right.iter().all(|v| v.is_finite()).then_some(self.right)
    }
}

/// Eigenvalues of a symmetric matrix in descending order, with their eigenvectors, by Jacobi's rotations.
pub(super) fn eigen(symmetric: &Matrix3<f64>) -> [(f64, Vector3<f64>); 3] {
    const SWEEPS: usize = 12;
    let (mut a, mut vectors) = (*symmetric, Matrix3::identity());
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[(p, q)].abs() <= 1e-300 {
                continue;
            }
            let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
            let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
            let mut turn = Matrix3::identity();
            (turn[(p, p)], turn[(q, q)]) = (cosine, cosine);
            (turn[(p, q)], turn[(q, p)]) = (tangent * cosine, -tangent * cosine);
            a = times(&turn.transpose(), &times(&a, &turn));
            vectors = times(&vectors, &turn);
        }
    }
    let mut pairs = [0, 1, 2].map(|i| (a[(i, i)], vectors.column(i).into_owned()));
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if pairs[i].0 < pairs[j].0 {
            pairs.swap(i, j);
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn equations_are_solved() {
        let mut equations = Equations::zeros(3);
        for (i, j, value) in [(0, 0, 4.0), (1, 0, 1.0), (1, 1, 3.0), (0, 2, -1.0), (2, 1, 0.5), (2, 2, 2.0)] {
            equations.add(i, j, value);
        }
        // A (1, 2, 3)ᵀ.
        equations.right = vec![3.0, 8.5, 6.0];
        let found = equations.clone().solve().unwrap();
        found.iter().zip([1.0, 2.0, 3.0]).for_each(|(a, b)| assert!((a - b).abs() < 1e-12, "{a} {b}"));
        equations.add(1, 1, -3.0);
        assert_eq!(equations.solve(), None);
    }

    #[test]
    fn eigenvectors_are_those_of_the_matrix() {
        let m = Matrix3::new(2.0, -1.0, 0.3, -1.0, 1.5, 0.2, 0.3, 0.2, -0.7);
        let found = eigen(&m);
        assert!(found[0].0 > found[1].0 && found[1].0 > found[2].0);
        for (value, vector) in found {
            assert!((m * vector - vector * value).norm() < 1e-12 && (vector.norm() - 1.0).abs() < 1e-12);
        }
        assert_eq!(eigen(&Matrix3::identity()).map(|(value, _)| value), [1.0; 3]);
    }
}
