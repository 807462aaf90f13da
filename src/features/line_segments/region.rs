//! Regions of pixels whose level lines point the same way (sections 2.4 to 2.6 and 2.9 of the paper).

use super::level_lines::LevelLines;
use super::rectangle::Rectangle;
use crate::Result;
use crate::image::reserve;

/// Grows one region after the other. No pixel belongs to two.
pub(super) struct Grower<'a> {
    lines: &'a LevelLines,
    tolerance: f64,
    min_density: f64,
    /// What no region may take: pixels without direction, and those of regions.
    used: Vec<u8>,
    /// The region: columns and rows, the seed first.
    pixels: Vec<[u32; 2]>,
    /// Sum of its pixels' directions.
    direction: [f64; 2],
}

impl<'a> Grower<'a> {
    pub fn new(lines: &'a LevelLines, tolerance: f64, min_density: f64) -> Result<Self> {
        let mut pixels = Vec::new();
        reserve(&mut pixels, lines.directions.len())?;
        let mut used = Vec::new();
        reserve(&mut used, lines.directions.len())?;
        used.extend(lines.magnitudes.iter().map(|&magnitude| u8::from(magnitude == 0.0)));
        Ok(Self { lines, tolerance, min_density, used, pixels, direction: [0.0; 2] })
    }

    /// The rectangle around the region that grows from `seed`; none if it is already part of one, or if the region has
    /// fewer than `least` pixels or fills too little of its rectangle.
    pub fn rectangle(&mut self, seed: usize, least: usize) -> Option<Rectangle> {
        if self.used[seed] != 0 {
            return None;
        }
        let seed = [seed % self.lines.width, seed / self.lines.width].map(|v| v as u32);
        self.grow(seed, self.tolerance);
        if self.pixels.len() < least {
            return None;
        }
        let mut rectangle = self.fit();
        if self.density(&rectangle) < self.min_density {
            self.grow_straighter(seed, &rectangle);
            rectangle = self.shrink(seed)?;
        }
        Some(rectangle)
    }

    /// Takes in all connected pixels within `tolerance` of the direction so far.
    fn grow(&mut self, seed: [u32; 2], tolerance: f64) {
        let LevelLines { width, directions, .. } = self.lines;
        let cosine = libm::cos(tolerance);
        let first = self.index(seed);
        self.pixels.clear();
        self.pixels.push(seed);
        self.used[first] = 1;
        let [mut dx, mut dy] = directions[first].map(f64::from);
        // Of the sum's length, squared, what a direction within the tolerance reaches along it.
        let mut least = cosine * cosine;
        let mut next = 0;
        while let Some(&[x, y]) = self.pixels.get(next) {
            next += 1;
            // Nothing in the last row and column has a direction: neighbours beyond the border are used or no pixels.
            let above = self.index([x, y]).wrapping_sub(width + 1);
            for row in 0..3 {
                for column in 0..3 {
                    let i = above.wrapping_add(row * width + column);
                    if self.used.get(i) != Some(&0) {
                        continue;
                    }
                    let [u, v] = directions[i].map(f64::from);
                    let along = u * dx + v * dy;
                    if along > 0.0 && along * along >= least {
                        self.used[i] = 1;
                        self.pixels.push([x + column as u32 - 1, y + row as u32 - 1]);
                        (dx, dy) = (dx + u, dy + v);
                        least = cosine * cosine * (dx * dx + dy * dy);
                    }
                }
            }
        }
        self.direction = [dx, dy];
    }

    /// Grows the region anew with the standard deviation of directions near its seed as tolerance: bent ones fall apart.
    fn grow_straighter(&mut self, seed: [u32; 2], rectangle: &Rectangle) {
        let [u, v] = self.lines.directions[self.index(seed)].map(f64::from);
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for &pixel in &self.pixels {
            let i = self.index(pixel);
            self.used[i] = 0;
            if squared_distance(seed, pixel) < rectangle.width * rectangle.width {
                let [a, b] = self.lines.directions[i].map(f64::from);
                let angle = libm::atan2(u * b - v * a, u * a + v * b);
                (sum, squares, count) = (sum + angle, squares + angle * angle, count + 1.0);
            }
        }
        let mean = sum / count;
        let deviation = (squares / count - mean * mean).max(0.0).sqrt();
        self.grow(seed, (2.0 * deviation).min(self.tolerance));
    }

    /// Leaves out what is far from the seed until the rest fills enough of its rectangle.
    fn shrink(&mut self, seed: [u32; 2]) -> Option<Rectangle> {
        let mut squared_radius: Option<f64> = None;
        loop {
            if self.pixels.len() < 2 {
                return None;
            }
            let rectangle = self.fit();
            if self.density(&rectangle) >= self.min_density {
                return Some(rectangle);
            }
            let at = seed.map(f64::from);
            let squared = |end: [f64; 2]| (end[0] - at[0]) * (end[0] - at[0]) + (end[1] - at[1]) * (end[1] - at[1]);
            let whole = squared_radius.unwrap_or(squared(rectangle.start).max(squared(rectangle.end)));
            let radius = 0.75 * 0.75 * whole;
            squared_radius = Some(radius);
            let mut pixels = std::mem::take(&mut self.pixels);
            pixels.retain(|&pixel| {
                let near = squared_distance(seed, pixel) <= radius;
                let i = self.index(pixel);
                self.used[i] = u8::from(near);
                near
            });
            self.pixels = pixels;
        }
    }

    fn index(&self, [x, y]: [u32; 2]) -> usize {
        y as usize * self.lines.width + x as usize
    }

    /// Share of the rectangle's area that the region fills.
    fn density(&self, rectangle: &Rectangle) -> f64 {
        self.pixels.len() as f64 / (rectangle.length() * rectangle.width)
    }

    /// The rectangle along the first principal axis of the region, pixels weighted by their gradient.
    fn fit(&self) -> Rectangle {
        let weight = |pixel| f64::from(self.lines.magnitudes[self.index(pixel)]);
        let weighted = || self.pixels.iter().map(|&pixel| (pixel.map(f64::from), weight(pixel)));
        let (mut total, mut x, mut y) = (0.0, 0.0, 0.0);
        for (place, weight) in weighted() {
            (total, x, y) = (total + weight, x + weight * place[0], y + weight * place[1]);
        }
        let centre = [x / total, y / total];
        let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
        for (place, weight) in weighted() {
            let [x, y] = [place[0] - centre[0], place[1] - centre[1]];
            (xx, yy, xy) = (xx + weight * x * x, yy + weight * y * y, xy + weight * x * y);
        }
        // The eigenvector of the larger eigenvalue, from whichever row of the matrix is better conditioned.
        let half = 0.5 * (xx - yy);
        let root = (half * half + xy * xy).sqrt();
        let [u, v] = if half > 0.0 { [half + root, xy] } else { [xy, root - half] };
        let norm = (u * u + v * v).sqrt();
        let [dx, dy] = self.direction;
        let direction = if norm > 0.0 { [u / norm, v / norm] } else { self.unit_direction() };
        // The axis has two directions: the level lines'.
        let direction = if direction[0] * dx + direction[1] * dy < 0.0 { direction.map(|v| -v) } else { direction };
        let (mut along, mut across) = ([0.0f64; 2], [0.0f64; 2]);
        for &pixel in &self.pixels {
            let place = pixel.map(f64::from);
            let [x, y] = [place[0] - centre[0], place[1] - centre[1]];
            let (l, w) = (x * direction[0] + y * direction[1], y * direction[0] - x * direction[1]);
            along = [along[0].min(l), along[1].max(l)];
            across = [across[0].min(w), across[1].max(w)];
        }
        let end = |l: f64| [centre[0] + l * direction[0], centre[1] + l * direction[1]];
        Rectangle {
            start: end(along[0]),
            end: end(along[1]),
            direction,
            width: (across[1] - across[0]).max(1.0),
            probability: self.tolerance / std::f64::consts::PI,
        }
    }

    fn unit_direction(&self) -> [f64; 2] {
        let [x, y] = self.direction;
        let norm = (x * x + y * y).sqrt();
        [x / norm, y / norm]
    }
}

fn squared_distance([ax, ay]: [u32; 2], [bx, by]: [u32; 2]) -> f64 {
    let [x, y] = [ax.abs_diff(bx), ay.abs_diff(by)].map(f64::from);
    x * x + y * y
}
