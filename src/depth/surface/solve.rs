//! The reweighted equations, by preconditioned conjugate gradients.

use super::lines::Line;
use super::mesh::{Mesh, Term};
use super::{ROBUST, robust};
use crate::Result;
use crate::depth::banded::{Banded, Factor, add_scaled, dot};

/// Steps of the conjugate gradients at most, and the share of the residual they leave: that of a change, which is small in the end.
const STEPS: usize = 12;
const TOLERANCE: f64 = 1e-2;

/// One reweighted solution of several kinds of terms, each with a factor.
pub(super) fn reweighted(
    mesh: &Mesh,
    terms: &[(&[Term], f64)],
    lines: &mut [Line],
    start: &[f64],
    pass: usize,
) -> Result<Option<Vec<f64>>> {
    let mut matrix = Banded::new(mesh.len(), 2 * mesh.columns.min(mesh.rows))?;
    let mut right = vec![0.0; mesh.len()];
    let mut gather = |term: &Term, weight: f64| {
        for (i, (&n, &a)) in term.nodes.iter().zip(&term.coefficients).enumerate() {
            let a = weight * a;
            if a != 0.0 {
                right[n] += a * term.target;
                for (&m, &b) in term.nodes[..=i].iter().zip(&term.coefficients) {
                    matrix.add(n, m, a * b);
                }
            }
        }
    };
    for (terms, factor) in terms {
        for term in *terms {
            let residual = term.residual(start) * term.inverse_scale;
            let share = if pass == 0 || term.inverse_scale == 0.0 { 1.0 } else { robust(residual, pass >= ROBUST) };
            gather(term, factor * term.weight * share);
        }
    }
    for line in lines.iter_mut() {
        line.reweight(start, pass);
        line.terms.iter().zip(&line.weights).for_each(|(term, w)| gather(term, *w));
    }
    lines.iter().for_each(|line| line.release_targets(&mut right));
    let Some(factor) = matrix.clone().cholesky() else { return Ok(None) };
    Ok(Some(conjugate_gradients(&matrix, &factor, lines, right, start)))
}

/// The matrix has the lines pull to 0 rather than to be affine: it only preconditions.
fn conjugate_gradients(matrix: &Banded, factor: &Factor, lines: &[Line], right: Vec<f64>, start: &[f64]) -> Vec<f64> {
    let apply = |x: &[f64]| {
        let mut out = matrix.multiply(x);
        lines.iter().for_each(|line| line.release(x, &mut out));
        out
    };
    let mut x = start.to_vec();
    let mut residual = right;
    add_scaled(&mut residual, &apply(&x), -1.0);
    let precondition = |residual: &[f64]| {
        let mut z = residual.to_vec();
        factor.solve(&mut z);
        z
    };
    let mut z = precondition(&residual);
    let mut direction = z.clone();
    let mut product = dot(&residual, &z);
    let enough = TOLERANCE * TOLERANCE * product;
    for _ in 0..STEPS {
        if product.is_nan() || product <= enough || product <= 0.0 {
            break;
        }
        let applied = apply(&direction);
        let step = product / dot(&direction, &applied);
        add_scaled(&mut x, &direction, step);
        add_scaled(&mut residual, &applied, -step);
        z = precondition(&residual);
        let next = dot(&residual, &z);
        let share = next / product;
        direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + share * *d);
        product = next;
    }
    x
}
