//! Which canvas pixels a warped cell covers, and where in the cell each of them lies (paper, section 3.2.1).

/// A warped cell: its corners in turn from the top left, in canvas pixels.
pub(super) struct Cell {
    corners: [[f64; 2]; 4],
    shape: Shape,
}

enum Shape {
    /// All four corners turn the right way: the bilinear map of the cell can be inverted everywhere inside.
    Convex,
    /// Drawn as the two triangles along the diagonal from the top left, each if it is not turned over.
    Triangles([bool; 2]),
}

/// Twice the signed area of the triangle a, b, p: positive when p lies to the inside of the edge from a to b. Exact,
/// as corners lie on a subpixel grid.
#[inline(always)]
fn edge(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

/// Whether a pixel exactly on the edge from a to b belongs to this side of it (the top-left rule).
#[inline(always)]
fn owns(a: [f64; 2], b: [f64; 2]) -> bool {
    b[1] < a[1] || (b[1] == a[1] && b[0] > a[0])
}

#[inline(always)]
fn inside(a: [f64; 2], b: [f64; 2], p: [f64; 2], border: bool) -> bool {
    let e = edge(a, b, p);
    e > 0.0 || (e == 0.0 && (border || owns(a, b)))
}

impl Cell {
    /// `None` when the whole cell is turned over or has no area: the back of a fold is never a visible surface.
    #[inline(always)]
    pub fn new(corners: [[f64; 2]; 4]) -> Option<Self> {
        let [a, b, c, d] = corners;
        let (abc, acd) = (edge(a, b, c) > 0.0, edge(a, c, d) > 0.0);
        if abc && acd && edge(a, b, d) > 0.0 && edge(b, c, d) > 0.0 {
            Some(Self { corners, shape: Shape::Convex })
        } else if abc || acd {
            Some(Self { corners, shape: Shape::Triangles([abc, acd]) })
        } else {
            None
        }
    }

    /// Position of pixel p in the cell, (0, 0) at the first and (1, 1) at the third corner, or `None` outside.
    /// `border` says which of the right and bottom side lie on the grid's border and so own their pixels: there is
    /// no next cell to do it.
    #[inline(always)]
    pub fn locate(&self, p: [f64; 2], border: [bool; 2]) -> Option<[f64; 2]> {
        let [a, b, c, d] = self.corners;
        match self.shape {
            Shape::Convex => {
                let covered = inside(a, b, p, false)
                    && inside(b, c, p, border[0])
                    && inside(c, d, p, border[1])
                    && inside(d, a, p, false);
                covered.then(|| inverse_bilinear([a, b, c, d], p))
            }
            Shape::Triangles([abc, acd]) => {
                if abc && inside(a, b, p, false) && inside(b, c, p, border[0]) && inside(c, a, p, false) {
                    let area = edge(a, b, c);
                    let (wb, wc) = (edge(c, a, p) / area, edge(a, b, p) / area);
                    return Some([wb + wc, wc]);
                }
                if acd && inside(a, c, p, false) && inside(c, d, p, border[1]) && inside(d, a, p, false) {
                    let area = edge(a, c, d);
                    let (wc, wd) = (edge(d, a, p) / area, edge(a, c, p) / area);
                    return Some([wc, wc + wd]);
                }
                None
            }
        }
    }
}

#[inline(always)]
fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Solves p = a + u·(b−a) + v·(d−a) + u·v·(a−b+c−d) for p inside a convex cell.
#[inline(always)]
fn inverse_bilinear([a, b, c, d]: [[f64; 2]; 4], p: [f64; 2]) -> [f64; 2] {
    let e = [b[0] - a[0], b[1] - a[1]];
    let f = [d[0] - a[0], d[1] - a[1]];
    let g = [a[0] - b[0] + c[0] - d[0], a[1] - b[1] + c[1] - d[1]];
    let h = [p[0] - a[0], p[1] - a[1]];
    let (k2, k1, k0) = (cross(g, f), cross(e, f) + cross(h, g), cross(h, e));
    // Inside, the root of the discriminant is the map's Jacobian, which is positive; this form of the solution stays
    // exact when the cell is a parallelogram (k2 = 0).
    let root = (k1 * k1 - 4.0 * k2 * k0).max(0.0).sqrt();
    let v = (-2.0 * k0 / (k1 + root)).clamp(0.0, 1.0);
    let across = [e[0] + v * g[0], e[1] + v * g[1]];
    let along = [h[0] - v * f[0], h[1] - v * f[1]];
    let square = across[0] * across[0] + across[1] * across[1];
    [((along[0] * across[0] + along[1] * across[1]) / square).clamp(0.0, 1.0), v]
}
