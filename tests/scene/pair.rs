//! Two views of a scene and the truth between them.

use depthstitch::geometry::{Match, Model};

use super::camera::Camera;
use super::noise::Random;
use super::render::{Scene, View};

/// Both views, and x' ~ H∞ x̃ + e'·(1/z) both ways, z in metres.
#[derive(Debug, Clone)]
pub struct Pair<'a> {
    scene: &'a Scene,
    pub target: View,
    pub reference: View,
    /// Target to reference.
    pub forward: Model,
    /// Reference to target.
    pub reverse: Model,
}

/// What [`Pair::matches`] draws.
#[derive(Debug, Clone, Copy)]
pub struct MatchOptions {
    pub count: usize,
    /// Standard deviation of the noise on each coordinate in both views, in pixels.
    pub sigma: f64,
    /// Share of matches whose reference point is anywhere.
    pub outliers: f64,
    pub seed: u64,
}

/// Matches, and which of them are true.
#[derive(Debug, Clone)]
pub struct SampledMatches {
    pub matches: Vec<Match>,
    pub inliers: Vec<bool>,
}

impl<'a> Pair<'a> {
    pub(super) fn new(scene: &'a Scene, target: View, reference: View) -> Self {
        let forward = model(&target.camera, &reference.camera);
        let reverse = model(&reference.camera, &target.camera);
        Self { scene, target, reference, forward, reverse }
    }

    /// True place in the reference of every target pixel; `None` behind the reference's camera. It may lie outside the
    /// frame, or be hidden: see [`Pair::visible_in_reference`].
    pub fn map(&self) -> Vec<Option<[f64; 2]>> {
        true_map(&self.target, &self.forward)
    }

    /// True place in the target of every reference pixel.
    pub fn reverse_map(&self) -> Vec<Option<[f64; 2]>> {
        true_map(&self.reference, &self.reverse)
    }

    /// For every target pixel whether the reference shows what it shows: in the frame, with nothing in front.
    pub fn visible_in_reference(&self) -> Vec<bool> {
        self.visibility(&self.target, &self.reference)
    }

    /// For every reference pixel whether the target shows what it shows.
    pub fn visible_in_target(&self) -> Vec<bool> {
        self.visibility(&self.reference, &self.target)
    }

    fn visibility(&self, from: &View, to: &View) -> Vec<bool> {
        (0..from.depth.len()).map(|i| self.visible(from, to, i % from.width, i / from.width)).collect()
    }

    fn visible(&self, from: &View, to: &View, x: usize, y: usize) -> bool {
        let z = from.depth[y * from.width + x];
        let point = from.camera.centre + from.camera.direction(x as f64, y as f64) * z;
        let Some(([u, v], _)) = to.camera.project(point) else { return false };
        let inside = u >= 0.0 && v >= 0.0 && u <= (to.width - 1) as f64 && v <= (to.height - 1) as f64;
        inside && self.scene.sees(&to.camera, point)
    }

    /// Matches at target pixels that both views show, spread evenly, away from depth edges as a detector's are. Fewer
    /// than asked for when there is hardly any overlap.
    pub fn matches(&self, options: &MatchOptions) -> SampledMatches {
        let (w, h) = (self.target.width, self.target.height);
        let mut random = Random::new(options.seed);
        let (mut u, mut v) = (random.uniform(), random.uniform());
        let mut out = SampledMatches { matches: Vec::new(), inliers: Vec::new() };
        for _ in 0..options.count * 30 {
            if out.matches.len() == options.count {
                break;
            }
            // The R2 sequence: even for any count. Its steps are powers of the plastic number's inverse.
            (u, v) = ((u + 0.754_877_666_246_692_7).fract(), (v + 0.569_840_290_998_053_2).fract());
            let (x, y) = ((u * w as f64) as usize, (v * h as f64) as usize);
            if !self.smooth(x, y) || !self.visible(&self.target, &self.reference, x, y) {
                continue;
            }
            let inverse_depth = 1.0 / self.target.depth[y * w + x];
            let Some(place) = self.forward.project(x as f64, y as f64, inverse_depth) else { continue };
            let inlier = random.uniform() >= options.outliers;
            let size = [self.reference.width as f64 - 1.0, self.reference.height as f64 - 1.0];
            let mut noisy = |p: f64, most: f64| (p + options.sigma * random.normal()).clamp(0.0, most);
            let target = [noisy(x as f64, w as f64 - 1.0), noisy(y as f64, h as f64 - 1.0)];
            let mut reference = [noisy(place[0], size[0]), noisy(place[1], size[1])];
            if !inlier {
                reference = [random.uniform() * size[0], random.uniform() * size[1]];
            }
            out.matches.push(Match { target, reference });
            out.inliers.push(inlier);
        }
        out
    }

    /// Whether no depth edge runs through the 5×5 pixels around a target pixel.
    fn smooth(&self, x: usize, y: usize) -> bool {
        let view = &self.target;
        if x < 2 || y < 2 || x + 2 >= view.width || y + 2 >= view.height {
            return false;
        }
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for row in y - 2..=y + 2 {
            for z in &view.depth[row * view.width + x - 2..=row * view.width + x + 2] {
                (least, most) = (least.min(*z), most.max(*z));
            }
        }
        most < 1.1 * least
    }
}

/// H∞ = K' R' Rᵀ K⁻¹ and e' = K' R' (C − C').
pub(super) fn model(from: &Camera, to: &Camera) -> Model {
    let turn = to.r * from.r.transpose();
    Model { h: to.k * turn * from.k_inverse(), e: to.k * (to.r * (from.centre - to.centre)) }
}

fn true_map(view: &View, model: &Model) -> Vec<Option<[f64; 2]>> {
    let place = |(i, z): (usize, &f64)| model.project((i % view.width) as f64, (i / view.width) as f64, 1.0 / z);
    view.depth.iter().enumerate().map(place).collect()
}
