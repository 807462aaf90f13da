//! Procedural colours, linear RGB, mostly functions of the point in space: no surface needs coordinates of its own.

use nalgebra::Vector3;

use super::noise::{fractal, hash, noise};

type V = Vector3<f64>;

#[derive(Debug, Clone, Copy)]
pub enum Texture {
    /// The same colour everywhere.
    Flat(V),
    /// Speckled, stained stone.
    Stone(V),
    /// Stone with the flutes of a column around (x, z).
    Fluted(V, [f64; 2]),
    /// Floor tiles, `size` metres wide.
    Tiles { size: f64 },
    /// Bricks and mortar.
    Bricks,
    /// Planks, upright or lying.
    Wood { upright: bool },
    /// Veined marble.
    Marble(V, V),
    /// Bands across a tilted axis.
    Bands(V, V, f64),
    /// Patches of many colours, `size` metres wide.
    Patches { size: f64 },
    /// Foliage.
    Leaves(V),
    /// A meadow.
    Grass,
    /// Hills far away: woods and fields.
    Hills(V),
    /// A blue sky with clouds, behind the hills.
    Sky,
    /// Nothing for a feature detector: a broad shading only.
    Faint,
}

fn rgb(r: f64, g: f64, b: f64) -> V {
    V::new(r, g, b)
}

fn mix(a: V, b: V, t: f64) -> V {
    a + (b - a) * t.clamp(0.0, 1.0)
}

fn step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl Texture {
    /// Colour at a point of the world with this normal.
    pub fn colour(&self, p: V, normal: V) -> V {
        match *self {
            Texture::Flat(colour) => colour,
            Texture::Stone(colour) => stone(colour, p),
            Texture::Fluted(colour, [x, z]) => {
                let angle = libm::atan2(p.z - z, p.x - x);
                let flute = libm::cos(angle * 16.0);
                stone(colour, p) * (0.80 + 0.20 * step(-0.8, 0.3, flute))
            }
            Texture::Tiles { size } => tiles(p, size),
            Texture::Bricks => bricks(p, normal),
            Texture::Wood { upright } => wood(p, normal, upright),
            Texture::Marble(light, vein) => {
                let warp = fractal(p * 3.0, 4);
                let line = 1.0 - (2.0 * fractal(p * 2.2 + V::repeat(3.0 * warp), 4) - 1.0).abs();
                let fine = 1.0 - (2.0 * fractal(p * 9.0 + V::repeat(2.0 * warp), 3) - 1.0).abs();
                mix(light, vein, 0.85 * step(0.86, 0.99, line) + 0.4 * step(0.88, 0.99, fine)) * (0.8 + 0.4 * warp)
            }
            Texture::Bands(a, b, width) => {
                let t = (p.y + 0.35 * p.x + 0.02 * noise(p * 14.0)) / width;
                let edge = step(0.44, 0.5, (t - t.floor() - 0.5).abs() * 2.0 * 0.94);
                mix(a, b, edge) * (0.72 + 0.5 * fractal(p * 22.0, 3))
            }
            Texture::Patches { size } => {
                let q = p / size + V::repeat(0.4) * noise(p / size * 2.0);
                let cell = q.map(|v| v.floor() as i32);
                let pick = hash(cell.x, cell.y, cell.z);
                let palette = [
                    rgb(0.70, 0.16, 0.10),
                    rgb(0.85, 0.52, 0.12),
                    rgb(0.10, 0.30, 0.42),
                    rgb(0.80, 0.72, 0.55),
                    rgb(0.16, 0.38, 0.20),
                ];
                palette[((pick * 5.0) as usize).min(4)] * (0.7 + 0.6 * fractal(p * 18.0, 3))
            }
            Texture::Leaves(colour) => {
                let leaf = fractal(p * 16.0, 3);
                let clump = fractal(p * 3.5, 2);
                colour * (0.25 + 1.5 * step(0.25, 0.8, leaf)) * (0.55 + 0.9 * clump)
            }
            Texture::Grass => {
                let field = fractal(V::new(p.x * 0.35, 0.0, p.z * 0.35), 4);
                let blade = fractal(V::new(p.x * 7.0, 0.0, p.z * 3.0), 3);
                mix(rgb(0.13, 0.22, 0.05), rgb(0.42, 0.40, 0.12), step(0.35, 0.7, field)) * (0.5 + blade)
            }
            Texture::Hills(colour) => {
                let wood = fractal(V::new(p.x * 0.8, p.y * 1.4, p.z), 5);
                let tree = fractal(p * 3.1, 3);
                mix(colour, rgb(0.36, 0.34, 0.15), step(0.48, 0.68, wood)) * (0.30 + 0.9 * tree + 0.5 * (wood - 0.3))
            }
            Texture::Sky => {
                let height = step(0.0, 27.0, -p.y);
                let clear = mix(rgb(0.74, 0.77, 0.78), rgb(0.11, 0.30, 0.68), height);
                let cloud = fractal(V::new(p.x * 0.055 + 4.0, p.y * 0.13, 7.5), 6);
                let wisp = fractal(V::new(p.x * 0.3, p.y * 0.5, 2.5), 4);
                mix(clear, rgb(1.0, 0.96, 0.90), step(0.48, 0.68, cloud + 0.12 * (wisp - 0.5)) * 0.95)
            }
            Texture::Faint => V::repeat(0.45 + 0.1 * noise(p * 0.4)),
        }
    }
}

fn stone(colour: V, p: V) -> V {
    let stain = fractal(p * 2.4, 4);
    let grain = fractal(p * 26.0, 3);
    let pit = step(0.60, 0.85, fractal(p * 17.0 + V::repeat(1.7 * stain), 2));
    colour * (0.55 + 0.6 * stain + 0.5 * (grain - 0.5)) * (1.0 - 0.4 * pit)
}

fn tiles(p: V, size: f64) -> V {
    let (u, v) = (p.x / size, p.z / size);
    let (i, j) = (u.floor(), v.floor());
    let (fu, fv) = (u - i, v - j);
    let edge = fu.min(1.0 - fu).min(fv.min(1.0 - fv));
    let (i, j) = (i as i32, j as i32);
    let tint = hash(i, j, 3);
    // Each tile is cut from another piece of stone.
    let q = p * 4.0 + V::new(hash(i, j, 5), hash(i, j, 6), hash(i, j, 7)) * 40.0;
    let vein = 1.0 - (2.0 * fractal(q, 4) - 1.0).abs();
    let grain = fractal(p * 24.0, 2);
    let base = if (i + j) & 1 == 0 { rgb(0.66, 0.56, 0.42) } else { rgb(0.47, 0.20, 0.11) };
    // A small dark diamond in every corner of a light tile.
    let corner = fu.min(1.0 - fu) + fv.min(1.0 - fv);
    let face = base * (0.72 + 0.35 * tint) * (1.0 - 0.35 * step(0.84, 0.99, vein)) * (0.8 + 0.4 * grain);
    let inlaid = mix(rgb(0.07, 0.10, 0.12) * (0.6 + 0.8 * grain), face, step(0.145, 0.16, corner));
    mix(rgb(0.30, 0.27, 0.22), inlaid, step(0.010, 0.020, edge))
}

fn bricks(p: V, normal: V) -> V {
    let along = if normal.x.abs() > 0.5 { p.z } else { p.x };
    let (width, height) = (0.30, 0.105);
    let row = (p.y / height).floor();
    let u = along / width + 0.5 * (row - 2.0 * (row * 0.5).floor());
    let (fu, fv) = ((u - u.floor()) * width, (p.y / height - row) * height);
    let edge = fu.min(width - fu).min(fv).min(height - fv);
    let id = hash(u.floor() as i32, row as i32, 11);
    let tone = hash(u.floor() as i32, row as i32, 12);
    let clay = mix(rgb(0.46, 0.17, 0.09), rgb(0.62, 0.36, 0.20), id) * (0.65 + 0.5 * tone);
    let face = clay * (0.6 + 0.8 * fractal(p * 18.0, 3));
    let joint = rgb(0.55, 0.50, 0.42) * (0.7 + 0.5 * noise(p * 40.0));
    mix(joint, face, step(0.006, 0.012, edge + 0.004 * noise(p * 30.0)))
}

fn wood(p: V, normal: V, upright: bool) -> V {
    let side = if normal.x.abs() > 0.5 { p.z } else { p.x };
    let (across, along) = if upright { (side, p.y) } else { (if normal.y.abs() > 0.5 { p.z } else { p.y }, side) };
    let width = 0.13;
    let plank = (across / width).floor();
    let edge = (across / width - plank).min(plank + 1.0 - across / width) * width;
    let tone = hash(plank as i32, 21, 0);
    let wave = fractal(V::new(across * 5.0, along * 1.6, tone * 30.0), 3);
    let ring = (across * 34.0 + wave * 13.0).fract().abs();
    let grain = noise(V::new(across * 160.0, along * 9.0, tone * 50.0));
    let face = mix(rgb(0.56, 0.33, 0.15), rgb(0.28, 0.14, 0.055), 0.7 * ring + 0.3 * grain) * (0.75 + 0.5 * tone);
    mix(rgb(0.05, 0.03, 0.02), face, step(0.002, 0.007, edge))
}
