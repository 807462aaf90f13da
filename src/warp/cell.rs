//! A warped cell of any size and shape: which canvas pixels it covers, and the inverse bilinear map of each of them (paper,
//! section 3.2.1).

use super::grid::{PIXEL, Point, SUBPIXEL_BITS};

/// A cell that is not wholly turned over (of reversed orientation): the back of a fold is never a visible surface.
pub(super) struct Cell {
    /// In turn from the top left.
    corners: [Point; 4],
    shape: Shape,
}

enum Shape {
    /// All four corners turn the right way: the bilinear map of the cell can be inverted everywhere inside.
    Convex,
    /// Drawn as the two triangles along the diagonal from the top left, each if it is not turned over.
    Triangles([bool; 2]),
}

/// First and last pixel whose centre lies in the bounding box of a cell along one axis; empty when first > last.
fn pixel_range(corners: &[Point; 4], axis: usize) -> (i32, i32) {
    let [a, b, c, d] = [corners[0][axis], corners[1][axis], corners[2][axis], corners[3][axis]];
    let (min, max) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
    ((min + (PIXEL - 1)) >> SUBPIXEL_BITS, max >> SUBPIXEL_BITS)
}

/// Twice the signed area of the triangle a, b, p: positive when p lies to the inside of the edge from a to b.
fn edge(a: Point, b: Point, p: Point) -> i64 {
    let d = |i: Point, k: usize| i64::from(i[k] - a[k]);
    d(b, 0) * d(p, 1) - d(b, 1) * d(p, 0)
}

/// Whether p is inside the edge from a to b. A pixel exactly on the edge belongs to this side of it by the top-left
/// rule, or because the edge is the grid's border and there is no cell beyond.
fn inside(a: Point, b: Point, p: Point, border: bool) -> bool {
    let owns = border || b[1] < a[1] || (b[1] == a[1] && b[0] > a[0]);
    edge(a, b, p) >= i64::from(!owns)
}

impl Cell {
    /// `None` when the whole cell is turned over or has no area.
    pub fn new(corners: [Point; 4]) -> Option<Self> {
        let [a, b, c, d] = corners;
        let (abc, acd) = (edge(a, b, c) > 0, edge(a, c, d) > 0);
        if abc && acd && edge(a, b, d) > 0 && edge(b, c, d) > 0 {
            Some(Self { corners, shape: Shape::Convex })
        } else if abc || acd {
            Some(Self { corners, shape: Shape::Triangles([abc, acd]) })
        } else {
            None
        }
    }

    /// Calls `draw(x, y, u, v)` for every pixel that belongs to the cell: (u, v) is (0, 0) at the first and (1, 1) at
    /// the third corner. `border` says whether the right and the bottom side lie on the grid's border.
    pub fn draw(&self, border: [bool; 2], mut draw: impl FnMut(i32, i32, f32, f32)) {
        let ((x_first, x_last), (y_first, y_last)) = (pixel_range(&self.corners, 0), pixel_range(&self.corners, 1));
        for y in y_first..=y_last {
            for x in x_first..=x_last {
                if let Some([u, v]) = self.locate(x, y, border) {
                    draw(x, y, u, v);
                }
            }
        }
    }

    /// Position of pixel (x, y) in the cell, or `None` outside.
    fn locate(&self, x: i32, y: i32, border: [bool; 2]) -> Option<[f32; 2]> {
        let [a, b, c, d] = self.corners;
        let p = [x << SUBPIXEL_BITS, y << SUBPIXEL_BITS];
        match self.shape {
            Shape::Convex => {
                let covered = inside(a, b, p, false)
                    && inside(b, c, p, border[0])
                    && inside(c, d, p, border[1])
                    && inside(d, a, p, false);
                if covered { Some(inverse_bilinear(&self.corners, x, y)) } else { None }
            }
            Shape::Triangles([abc, acd]) => {
                let share = |part: i64, whole: i64| part as f32 / whole as f32;
                if abc && inside(a, b, p, false) && inside(b, c, p, border[0]) && inside(c, a, p, false) {
                    let (area, wc) = (edge(a, b, c), edge(a, b, p));
                    return Some([share(edge(c, a, p) + wc, area), share(wc, area)]);
                }
                if acd && inside(a, c, p, false) && inside(c, d, p, border[1]) && inside(d, a, p, false) {
                    let (area, wc) = (edge(a, c, d), edge(d, a, p));
                    return Some([share(wc, area), share(wc + edge(a, c, p), area)]);
                }
                None
            }
        }
    }
}

fn cross(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[1] - a[1] * b[0]
}

/// Solves p = a + u·(b−a) + v·(d−a) + u·v·(a−b+c−d) for the pixel p = (x, y) inside a convex cell.
fn inverse_bilinear(&[a, b, c, d]: &[Point; 4], x: i32, y: i32) -> [f32; 2] {
    let to = |q: Point| [(q[0] - a[0]) as f32, (q[1] - a[1]) as f32];
    let (e, f, h, diagonal) = (to(b), to(d), to([x << SUBPIXEL_BITS, y << SUBPIXEL_BITS]), to(c));
    let g = [diagonal[0] - e[0] - f[0], diagonal[1] - e[1] - f[1]];
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
