//! Which canvas pixels a warped cell covers, and where in the cell each of them lies (paper, section 3.2.1).

use super::grid::{Point, SUBPIXEL_BITS};
use super::raster4::SmallCell;

const PIXEL: i32 = 1 << SUBPIXEL_BITS;

/// First and last pixel whose centre lies in the bounding box of a cell along one axis; empty when first > last.
#[inline(always)]
fn pixel_range(corners: &[Point; 4], axis: usize) -> (i32, i32) {
    let [a, b, c, d] = [corners[0][axis], corners[1][axis], corners[2][axis], corners[3][axis]];
    let (min, max) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
    ((min + (PIXEL - 1)) >> SUBPIXEL_BITS, max >> SUBPIXEL_BITS)
}

/// Calls `draw(x, y, u, v)` for every pixel that belongs to the cell: (u, v) is (0, 0) at the first and (1, 1) at the
/// third corner. `border` says whether the right and the bottom side lie on the grid's border and so own their pixels.
///
/// Parts of a cell that are turned over are not drawn: the back of a fold is never a visible surface.
#[inline(always)]
pub(super) fn rasterise(corners: &[Point; 4], border: [bool; 2], mut draw: impl FnMut(i32, i32, f32, f32)) {
    let ((x_first, x_last), (y_first, y_last)) = (pixel_range(corners, 0), pixel_range(corners, 1));
    if x_first > x_last || y_first > y_last {
        return;
    }
    if let Some(small) = SmallCell::new(corners, border) {
        let mut y = y_first;
        while y <= y_last {
            let mut x = x_first;
            while x <= x_last {
                small.draw_block(x, y, &mut draw);
                x += 2;
            }
            y += 2;
        }
    } else if let Some(cell) = Cell::new(*corners) {
        for y in y_first..=y_last {
            for x in x_first..=x_last {
                if let Some([u, v]) = cell.locate(x, y, border) {
                    draw(x, y, u, v);
                }
            }
        }
    }
}

/// A cell of any size and shape.
struct Cell {
    corners: [Point; 4],
    shape: Shape,
}

enum Shape {
    /// All four corners turn the right way: the bilinear map of the cell can be inverted everywhere inside.
    Convex,
    /// Drawn as the two triangles along the diagonal from the top left, each if it is not turned over.
    Triangles([bool; 2]),
}

/// Twice the signed area of the triangle a, b, p: positive when p lies to the inside of the edge from a to b.
#[inline]
fn edge(a: Point, b: Point, p: Point) -> i64 {
    let d = |i: Point, k: usize| i64::from(i[k] - a[k]);
    d(b, 0) * d(p, 1) - d(b, 1) * d(p, 0)
}

/// Whether a pixel exactly on the edge from a to b belongs to this side of it (the top-left rule).
#[inline(always)]
pub(super) fn owns(a: Point, b: Point) -> bool {
    (b[1] < a[1]) | ((b[1] == a[1]) & (b[0] > a[0]))
}

#[inline]
fn inside(a: Point, b: Point, p: Point, border: bool) -> bool {
    edge(a, b, p) >= i64::from(!(border | owns(a, b)))
}

impl Cell {
    /// `None` when the whole cell is turned over or has no area.
    fn new(corners: [Point; 4]) -> Option<Self> {
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
                if covered { Some(inverse_bilinear([a, b, c, d], p)) } else { None }
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

#[inline]
fn cross(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[1] - a[1] * b[0]
}

/// Solves p = a + u·(b−a) + v·(d−a) + u·v·(a−b+c−d) for p inside a convex cell.
fn inverse_bilinear([a, b, c, d]: [Point; 4], p: Point) -> [f32; 2] {
    let to = |q: Point| [(q[0] - a[0]) as f32, (q[1] - a[1]) as f32];
    let (e, f, h, diagonal) = (to(b), to(d), to(p), to(c));
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
