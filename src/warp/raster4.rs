//! The rasteriser's fast way for the cells that a grid of one vertex per pixel is made of: small and convex. Four
//! pixels, a block of two by two, are tested and located at once.

use wide::{CmpGt, f32x4, i32x4};

use super::grid::{Point, SUBPIXEL_BITS};
use super::raster::owns;

/// Longest extent, in fixed point, for which edge functions fit 32 bit: 2·2¹⁴·2¹⁵ with a block's overhang.
const LONGEST: u32 = 14 << SUBPIXEL_BITS;

/// A convex cell of a few pixels, relative to its first corner.
pub(super) struct SmallCell {
    origin: Point,
    /// Corners two to four.
    b: Point,
    c: Point,
    d: Point,
    /// Least edge function of a pixel that belongs to the cell, less one, for the sides ab, bc, cd, da.
    least: [i32; 4],
}

impl SmallCell {
    /// `None` for a cell that is large or not strictly convex.
    #[inline(always)]
    pub fn new(corners: &[Point; 4], border: [bool; 2]) -> Option<Self> {
        let origin = corners[0];
        let to = |q: Point| [q[0].wrapping_sub(origin[0]), q[1].wrapping_sub(origin[1])];
        let (b, c, d) = (to(corners[1]), to(corners[2]), to(corners[3]));
        let small = |q: Point| (q[0].unsigned_abs() < LONGEST) & (q[1].unsigned_abs() < LONGEST);
        if !(small(b) & small(c) & small(d)) {
            return None;
        }
        let cross = |p: Point, q: Point| p[0] * q[1] - p[1] * q[0];
        let minus = |p: Point, q: Point| [p[0] - q[0], p[1] - q[1]];
        let convex = (cross(b, c) > 0) & (cross(c, d) > 0) & (cross(b, d) > 0) & (cross(minus(c, b), minus(d, b)) > 0);
        if !convex {
            return None;
        }
        let least = [
            -i32::from(owns([0, 0], b)),
            -i32::from(border[0] | owns(b, c)),
            -i32::from(border[1] | owns(c, d)),
            -i32::from(owns(d, [0, 0])),
        ];
        Some(Self { origin, b, c, d, least })
    }

    /// Calls `draw(x, y, u, v)` for those of the pixels (x, y) to (x + 1, y + 1) that belong to the cell.
    #[inline(always)]
    pub fn draw_block(&self, x: i32, y: i32, draw: &mut impl FnMut(i32, i32, f32, f32)) {
        const ONE: i32 = 1 << SUBPIXEL_BITS;
        let px = i32x4::splat((x << SUBPIXEL_BITS) - self.origin[0]) + i32x4::new([0, ONE, 0, ONE]);
        let py = i32x4::splat((y << SUBPIXEL_BITS) - self.origin[1]) + i32x4::new([0, 0, ONE, ONE]);
        let edge = |from: Point, to: Point, least: i32| {
            let (dx, dy) = (i32x4::splat(to[0] - from[0]), i32x4::splat(to[1] - from[1]));
            let e = dx * (py - i32x4::splat(from[1])) - dy * (px - i32x4::splat(from[0]));
            e.cmp_gt(i32x4::splat(least))
        };
        let covered = edge([0, 0], self.b, self.least[0])
            & edge(self.b, self.c, self.least[1])
            & edge(self.c, self.d, self.least[2])
            & edge(self.d, [0, 0], self.least[3]);
        let mut covered = covered.move_mask();
        if covered == 0 {
            return;
        }
        let [u, v] = self.inverse_bilinear(f32x4::from_i32x4(px), f32x4::from_i32x4(py));
        let (u, v) = (u.to_array(), v.to_array());
        while covered != 0 {
            let lane = covered.trailing_zeros();
            covered &= covered - 1;
            let k = lane as usize & 3;
            draw(x + (lane & 1) as i32, y + (lane >> 1) as i32, u[k], v[k]);
        }
    }

    /// As in [`super::raster`], for four places at once.
    #[inline(always)]
    fn inverse_bilinear(&self, hx: f32x4, hy: f32x4) -> [f32x4; 2] {
        let float = |q: Point| [q[0] as f32, q[1] as f32];
        let (e, c, f) = (float(self.b), float(self.c), float(self.d));
        let g = [c[0] - e[0] - f[0], c[1] - e[1] - f[1]];
        let splat = |q: [f32; 2]| [f32x4::splat(q[0]), f32x4::splat(q[1])];
        let k2 = f32x4::splat(g[0] * f[1] - g[1] * f[0]);
        let area = f32x4::splat(e[0] * f[1] - e[1] * f[0]);
        let (e, f, g) = (splat(e), splat(f), splat(g));
        let (zero, one) = (f32x4::splat(0.0), f32x4::splat(1.0));
        let k1 = area + (hx * g[1] - hy * g[0]);
        let k0 = hx * e[1] - hy * e[0];
        let root = (k1 * k1 - f32x4::splat(4.0) * k2 * k0).fast_max(zero).sqrt();
        let v = (f32x4::splat(-2.0) * k0 / (k1 + root)).fast_max(zero).fast_min(one);
        let across = [e[0] + v * g[0], e[1] + v * g[1]];
        let along = [hx - v * f[0], hy - v * f[1]];
        let square = across[0] * across[0] + across[1] * across[1];
        let u = ((along[0] * across[0] + along[1] * across[1]) / square).fast_max(zero).fast_min(one);
        [u, v]
    }
}
