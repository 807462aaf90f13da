//! Least squares on the Sampson distances, within the matrices of rank 2.

use super::fundamental::Fundamental;
use crate::geometry::levenberg_marquardt::{LeastSquares, NUMBERS, Normal, minimise};
use crate::geometry::points::Points;
use crate::geometry::vectors::{add, added, apply, cofactors, dot, product, scale, transposed};

/// The entries of F row by row, and two that count for nothing.
type Entries = [f64; NUMBERS];

/// The squared Sampson distances of the points.
struct Distances<'a>(&'a Points);

impl LeastSquares for Distances<'_> {
    type State = Fundamental;

    /// Steps lead along the matrices of rank 2 and norm 1: across them there is no slope.
    fn normal(&self, f: &Fundamental) -> Normal {
        let (points, back) = (self.0, transposed(f));
        let across = [unit(f), unit(&cofactors(f))].map(flat);
        let mut normal = Normal::empty();
        for p in points.iter() {
            let (m, a) = ([p.x, p.y, 1.0], [p.u, p.v, 1.0]);
            let (mut l, mut k) = (apply(f, m), apply(&back, a));
            let s = dot(a, l);
            (l[2], k[2]) = (0.0, 0.0);
            let square = dot(l, l) + dot(k, k);
            let (inverse, q) = (1.0 / square.sqrt(), s / square);
            let inner = added(m, k, -q);
            let mut slope = [0.0; NUMBERS];
            for (i, slope) in slope.iter_mut().take(9).enumerate() {
                let (r, c) = (i / 3, i % 3);
                *slope = inverse * (a[r] * inner[c] - q * l[r] * m[c]);
            }
            for normal in &across {
                let along = product(&slope, normal);
                add(&mut slope, -along, normal);
            }
            let distance = s * inverse;
            normal.cost += 0.5 * distance * distance;
            normal.gather(&slope, distance, 1.0);
        }
        normal
    }

    fn moved(&self, f: &Fundamental, step: &Entries) -> Fundamental {
        let mut moved = *f;
        add(moved.as_flattened_mut(), 1.0, step);
        retracted(moved)
    }
}

fn flat(m: Fundamental) -> Entries {
    let mut entries = [0.0; NUMBERS];
    entries[..9].copy_from_slice(m.as_flattened());
    entries
}

fn square(m: &Fundamental) -> f64 {
    product(m.as_flattened(), m.as_flattened())
}

fn unit(m: &Fundamental) -> Fundamental {
    let norm = square(m).sqrt().max(f64::MIN_POSITIVE);
    let mut unit = *m;
    scale(unit.as_flattened_mut(), 1.0 / norm);
    unit
}

/// A matrix of rank 2 and norm 1 next to `f`, by Newton's method along the gradient of the determinant.
#[inline(never)]
fn retracted(mut f: Fundamental) -> Fundamental {
    for _ in 0..3 {
        let c = cofactors(&f);
        let share = dot(c[0], f[0]) / square(&c).max(f64::MIN_POSITIVE);
        add(f.as_flattened_mut(), -share, c.as_flattened());
    }
    unit(&f)
}

/// Minimises the sum of squared Sampson distances over all of `points`, from `start`; never worse. Stops when a step gains
/// less than the share `tolerance`.
#[inline(never)]
pub(super) fn refine(points: &Points, start: &Fundamental, tolerance: f64) -> Fundamental {
    minimise(&Distances(points), retracted(*start), tolerance, 50).0
}
