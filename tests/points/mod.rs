//! Random clouds of points seen by two cameras, with the truth: what the tests of the robust fit are made from.

#![allow(dead_code)]

use depthstitch::geometry::{Estimate, EstimateOptions, Frame, Match, Model, Threshold, estimate};
use depthstitch::inverse_depth::DepthKind;
use depthstitch::report::Warning;
use depthstitch::{Error, InverseDepth};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

pub const WIDTH: usize = 320;
pub const HEIGHT: usize = 240;

/// The same cases on every run and every machine.
pub fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// Numbers that look random: splitmix64.
pub struct Noise(pub u64);

impl Noise {
    /// Even between -1 and 1.
    pub fn even(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Close to normal, with standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        (0..3).map(|_| self.even()).sum()
    }
}

/// Two photos of a cloud of points.
#[derive(Debug, Clone)]
pub struct Scene {
    pub truth: Model,
    pub matches: Vec<Match>,
    /// Inverse depth at the matches' pixels of the target, and around their places in the reference.
    pub depth: [Vec<f32>; 2],
}

/// Inverse depth of the point seen at (x, y).
pub type Surface = fn(x: f64, y: f64, noise: &mut Noise) -> f64;

pub fn cloud(_: f64, _: f64, noise: &mut Noise) -> f64 {
    0.3 + 0.2 * noise.even()
}

pub fn plane(x: f64, y: f64, _: &mut Noise) -> f64 {
    0.2 + 0.0005 * x + 0.0003 * y
}

pub fn constant(_: f64, _: f64, _: &mut Noise) -> f64 {
    0.25
}

impl Scene {
    /// Points on a grid of the target, seen after a turn by `angles` and a step by `translation`.
    pub fn new(angles: [f64; 3], translation: [f64; 3], focal: f64, surface: Surface, seed: u64) -> Self {
        let k = Matrix3::new(focal, 0.0, 159.5, 0.0, focal, 119.5, 0.0, 0.0, 1.0);
        let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let inverse = k.try_inverse().unwrap();
        let truth = Model { h: k * rotation.matrix() * inverse, e: k * Vector3::from(translation) };
        let mut noise = Noise(seed);
        let mut depth = [vec![f32::NAN; WIDTH * HEIGHT], vec![f32::NAN; WIDTH * HEIGHT]];
        let mut matches = Vec::new();
        for j in 0..14 {
            for i in 0..18 {
                let x = (10 + 17 * i) as f64 + (8.0 * noise.even()).round();
                let y = (10 + 16 * j) as f64 + (7.0 * noise.even()).round();
                let d = surface(x, y, &mut noise) as f32;
                let Some([u, v]) = truth.project(x, y, f64::from(d)) else { continue };
                if !(u >= 1.0 && v >= 1.0 && u < WIDTH as f64 - 4.0 && v < HEIGHT as f64 - 4.0) {
                    continue;
                }
                // Depth along the reference's axis: the third coordinate is the ratio of both depths.
                let seen = f64::from(d) / truth.transform(x, y, f64::from(d))[2];
                let corner = v as usize * WIDTH + u as usize;
                let around = [corner, corner + 1, corner + WIDTH, corner + WIDTH + 1];
                if around.iter().any(|&at| depth[1][at].is_finite()) {
                    continue;
                }
                around.iter().for_each(|&at| depth[1][at] = seen as f32);
                depth[0][y as usize * WIDTH + x as usize] = d;
                matches.push(Match { target: [x, y], reference: [u, v] });
            }
        }
        Self { truth, matches, depth }
    }

    /// Moves the reference points by normal noise of `sigma` pixels and replaces the share `wrong` by random ones.
    pub fn disturbed(mut self, sigma: f64, wrong: f64, seed: u64) -> Self {
        let mut noise = Noise(seed);
        for m in &mut self.matches {
            let [u, v] = m.reference;
            let moved = if 0.5 + 0.5 * noise.even() < wrong {
                [160.0 + 150.0 * noise.even(), 120.0 + 110.0 * noise.even()]
            } else {
                [u + sigma * noise.normal(), v + sigma * noise.normal()]
            };
            // Its depth moves with it.
            let d = self.depth[1][v as usize * WIDTH + u as usize];
            let corner = moved[1].clamp(0.0, 237.0) as usize * WIDTH + moved[0].clamp(0.0, 317.0) as usize;
            [corner, corner + 1, corner + WIDTH, corner + WIDTH + 1].iter().for_each(|&at| self.depth[1][at] = d);
            m.reference = moved;
        }
        self
    }

    pub fn fit(&self, options: &EstimateOptions) -> Result<Estimate, Error> {
        fit(&self.matches, Some([&self.depth[0], &self.depth[1]]), options)
    }

    /// Largest distance between the fitted and the true image of the points, in pixels.
    pub fn error(&self, model: &Model) -> f64 {
        let pixels = self.depth[0].iter().enumerate().filter(|(_, d)| d.is_finite());
        pixels
            .map(|(at, &d)| {
                let (x, y, d) = ((at % WIDTH) as f64, (at / WIDTH) as f64, f64::from(d));
                let ([a, b], [u, v]) = (model.project(x, y, d).unwrap(), self.truth.project(x, y, d).unwrap());
                ((a - u) * (a - u) + (b - v) * (b - v)).sqrt()
            })
            .fold(0.0, f64::max)
    }
}

pub fn fit(matches: &[Match], depth: Option<[&[f32]; 2]>, options: &EstimateOptions) -> Result<Estimate, Error> {
    let size = (WIDTH, HEIGHT);
    let map = |raw: &[f32]| InverseDepth::new("depth", raw, size, DepthKind::Inverse, None, size).unwrap();
    let maps = depth.map(|[a, b]| [map(a), map(b)]);
    let frame = |i: usize| Frame { size, depth: maps.as_ref().map(|m| &m[i]) };
    estimate(matches, frame(0), frame(1), options, &mut ()).map_err(|error| *error)
}

pub fn both_thresholds() -> [EstimateOptions; 2] {
    [Threshold::Pixels(3.0), Threshold::PAPER].map(|threshold| EstimateOptions { threshold, ..Default::default() })
}

pub fn codes(estimate: &Estimate) -> Vec<&'static str> {
    estimate.warnings.iter().map(Warning::code).collect()
}
