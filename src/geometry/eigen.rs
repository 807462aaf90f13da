//! Eigenvectors of small positive semidefinite matrices.

use nalgebra::{Matrix4, SMatrix, SVector, SymmetricEigen};

/// Most iterations of the solver, which needs about two per row.
const ITERATIONS: usize = 100;

/// The eigenvalues of a positive semidefinite matrix of at most four rows, in descending order, with their eigenvectors. `None`
/// if the solver does not converge.
pub(crate) fn eigenpairs<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Option<[(f64, SVector<f64, N>); N]> {
    // One solver serves all sizes. The rows that are missing get an eigenvalue that is larger than all others.
    let mut padded = Matrix4::from_diagonal_element(2.0 * matrix.trace() + f64::MIN_POSITIVE);
    padded.fixed_view_mut::<N, N>(0, 0).copy_from(matrix);
    let eigen = SymmetricEigen::try_new(padded, f64::EPSILON, ITERATIONS)?;
    let mut order = [0, 1, 2, 3];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    Some(std::array::from_fn(|i| {
        let column = order[4 - N + i];
        (eigen.eigenvalues[column], eigen.eigenvectors.fixed_view::<N, 1>(0, column).into_owned())
    }))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn eigenvectors_are_those_of_the_matrix() {
        let m = Matrix3::new(2.0, -1.0, 0.3, -1.0, 1.5, 0.2, 0.3, 0.2, 0.7);
        let found = eigenpairs(&m).unwrap();
        assert!(found[0].0 > found[1].0 && found[1].0 > found[2].0);
        for (value, vector) in found {
            assert!((m * vector - vector * value).norm() < 1e-12 && (vector.norm() - 1.0).abs() < 1e-12);
        }
        assert_eq!(eigenpairs(&Matrix3::identity()).unwrap().map(|(value, _)| value), [1.0; 3]);
        assert_eq!(eigenpairs(&Matrix3::zeros()).unwrap().map(|(value, _)| value), [0.0; 3]);
    }
}
