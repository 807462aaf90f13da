//! Hashes, value noise and a generator of random numbers.

use nalgebra::Vector3;

fn mix(mut h: u32) -> u32 {
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// What a coordinate is multiplied by, for x, y and z.
const FACTORS: [u32; 3] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d];

fn to_unit(h: u32) -> f64 {
    f64::from(h) * (1.0 / 4_294_967_296.0)
}

/// A number from 0 to 1 for a lattice point.
pub fn hash(x: i32, y: i32, z: i32) -> f64 {
    let [x, y, z] = [x, y, z].map(|v| v as u32);
    to_unit(mix(x.wrapping_mul(FACTORS[0]) ^ y.wrapping_mul(FACTORS[1]) ^ z.wrapping_mul(FACTORS[2])))
}

/// `f64::floor` is a function call on processors without an instruction for it, and noise is most of the work.
fn floor(v: f64) -> i32 {
    let towards_zero = v as i32;
    towards_zero - i32::from(f64::from(towards_zero) > v)
}

/// Value noise from 0 to 1, smooth, about one bump per unit.
pub fn noise(p: Vector3<f64>) -> f64 {
    let cell = [floor(p.x), floor(p.y), floor(p.z)];
    let [fx, fy, fz] = [0, 1, 2].map(|i| {
        let t = p[i] - f64::from(cell[i]);
        t * t * (3.0 - 2.0 * t)
    });
    // [`hash`] of the eight corners, side by side so that they are vectorised.
    let [x, y, z] = [0, 1, 2].map(|i| {
        let first = (cell[i] as u32).wrapping_mul(FACTORS[i]);
        [first, first.wrapping_add(FACTORS[i])]
    });
    let [a, b, c, d] = [y[0] ^ z[0], y[1] ^ z[0], y[0] ^ z[1], y[1] ^ z[1]];
    let near = [a, b, c, d].map(|yz| to_unit(mix(x[0] ^ yz)));
    let far = [a, b, c, d].map(|yz| to_unit(mix(x[1] ^ yz)));
    let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let rows: [f64; 4] = std::array::from_fn(|i| lerp(near[i], far[i], fx));
    lerp(lerp(rows[0], rows[1], fy), lerp(rows[2], rows[3], fy), fz)
}

/// Several octaves of [`noise`], from 0 to 1, mean ½.
pub fn fractal(p: Vector3<f64>, octaves: u32) -> f64 {
    let (mut sum, mut weight, mut q) = (0.0, 0.0, p);
    let mut amplitude = 1.0;
    for i in 0..octaves {
        sum += amplitude * noise(q);
        weight += amplitude;
        amplitude *= 0.55;
        // Not quite 2, and shifted, so that the lattices do not line up.
        q = q * 2.03 + Vector3::new(17.3, 5.1, 9.7) * f64::from(i + 1);
    }
    sum / weight
}

/// A small generator (splitmix64).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Normal, mean 0 and deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        radius * libm::cos(2.0 * std::f64::consts::PI * self.uniform())
    }
}
