//! A scene, and what a camera sees of it.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Mutex;

use nalgebra::Vector3;

use super::camera::{Camera, Pose};
use super::pair::Pair;
use super::shape::{Ray, Shape, slabs};
use super::texture::Texture;

type V = Vector3<f64>;

/// A shape and its colour.
pub type Object = (Shape, Texture);

/// Things with a box around all of them, if they have one: rays that miss the box pass all of them by at once.
#[derive(Debug, Clone)]
struct Bundle<T> {
    bounds: Option<(V, V)>,
    items: Vec<T>,
}

impl<T> Bundle<T> {
    fn new(items: Vec<T>, bounds: impl Fn(&T) -> Option<(V, V)>) -> Self {
        let join = |a: Option<(V, V)>, b: Option<(V, V)>| Some((a?.0.inf(&b?.0), a?.1.sup(&b?.1)));
        Self { bounds: items.iter().map(bounds).reduce(join).flatten(), items }
    }

    /// Whether the ray comes near before `limit`.
    fn meets(&self, ray: &Ray, limit: f64) -> bool {
        self.bounds.is_none_or(|(min, max)| slabs(ray, min, max).is_some_and(|(near, _, _)| near < limit))
    }
}

/// Textured shapes under one sun, and the two places they are seen from.
#[derive(Debug, Clone)]
pub struct Scene {
    clusters: Vec<Bundle<Bundle<Object>>>,
    /// Unit vector to the sun.
    sun: V,
    /// Depth at which haze has taken about two thirds of the colour.
    haze: f64,
    pub target: Pose,
    pub reference: Pose,
}

/// What one camera sees.
#[derive(Debug, Clone)]
pub struct View {
    pub camera: Camera,
    /// 4·width·height bytes, opaque.
    pub rgba: Vec<u8>,
    /// Distance along the optical axis of what the ray through the pixel's centre meets, in metres.
    pub depth: Vec<f64>,
    pub width: usize,
    pub height: usize,
}

impl View {
    /// 1/depth.
    pub fn inverse_depth(&self) -> Vec<f32> {
        self.depth.iter().map(|z| (1.0 / z) as f32).collect()
    }

    /// Red, green and blue of a pixel.
    pub fn rgb(&self, x: usize, y: usize) -> [u8; 3] {
        let i = 4 * (y * self.width + x);
        [self.rgba[i], self.rgba[i + 1], self.rgba[i + 2]]
    }
}

struct Hit {
    t: f64,
    normal: V,
    texture: Texture,
}

/// Side of the grid of colour samples in a pixel.
const SAMPLES: usize = 3;

impl Scene {
    pub fn new(target: Pose, reference: Pose, sun: V, haze: f64) -> Self {
        Self { clusters: Vec::new(), sun: sun.normalize(), haze, target, reference }
    }

    /// Adds groups of shapes; best those of a group are close together, and the groups of one call too.
    pub fn add(&mut self, groups: Vec<Vec<Object>>) {
        let bundle = |objects| Bundle::new(objects, |(shape, _): &Object| shape.bounds());
        self.clusters.push(Bundle::new(groups.into_iter().map(bundle).collect(), |group| group.bounds));
    }

    /// Both views, of the same size.
    pub fn render(&self, width: usize, height: usize) -> Pair<'_> {
        let view = |pose: &Pose| self.view(Camera::new(pose, width, height), width, height, true);
        Pair::new(self, view(&self.target), view(&self.reference))
    }

    /// As [`Scene::render`] but with all colours black, for tests of geometry alone: much faster.
    pub fn survey(&self, width: usize, height: usize) -> Pair<'_> {
        let view = |pose: &Pose| self.view(Camera::new(pose, width, height), width, height, false);
        Pair::new(self, view(&self.target), view(&self.reference))
    }

    /// Depth of the first thing on the ray through (x, y); infinite where there is none.
    pub fn depth(&self, camera: &Camera, x: f64, y: f64) -> f64 {
        let ray = Ray::new(camera.centre, camera.direction(x, y));
        self.trace(&ray, f64::INFINITY).map_or(f64::INFINITY, |hit| hit.t)
    }

    /// Whether nothing stands between the camera and the point.
    pub fn sees(&self, camera: &Camera, point: V) -> bool {
        let ray = Ray::new(camera.centre, point - camera.centre);
        self.trace(&ray, 1.0 - 1e-6).is_none()
    }

    /// What a camera sees; without colour only the depth is worked out. Tests look at the same things again and again, so it is kept.
    pub fn view(&self, camera: Camera, width: usize, height: usize, coloured: bool) -> View {
        static SEEN: Mutex<BTreeMap<u64, View>> = Mutex::new(BTreeMap::new());
        let mut hash = DefaultHasher::new();
        format!("{:?}", (&self.clusters, self.sun, self.haze, camera, width, height, coloured)).hash(&mut hash);
        let key = hash.finish();
        if let Some(view) = SEEN.lock().unwrap().get(&key) {
            return view.clone();
        }
        let view = self.seen(camera, width, height, coloured);
        SEEN.lock().unwrap().insert(key, view.clone());
        view
    }

    fn seen(&self, camera: Camera, width: usize, height: usize, coloured: bool) -> View {
        let mut rgba = vec![255; 4 * width * height];
        let mut depth = vec![0.0; width * height];
        let rows = |first: usize, rgba: &mut [u8], depth: &mut [f64]| {
            for (i, (pixel, z)) in rgba.chunks_exact_mut(4).zip(depth).enumerate() {
                let (x, y) = ((i % width) as f64, (first + i / width) as f64);
                *z = self.depth(&camera, x, y);
                pixel[..3].copy_from_slice(&if coloured { self.pixel(&camera, x, y) } else { [0; 3] });
            }
        };
        #[cfg(target_arch = "wasm32")]
        rows(0, &mut rgba, &mut depth);
        #[cfg(not(target_arch = "wasm32"))]
        std::thread::scope(|scope| {
            let parts = std::thread::available_parallelism().map_or(1, usize::from);
            let count = height.div_ceil(parts).max(1);
            let bands = rgba.chunks_mut(4 * width * count).zip(depth.chunks_mut(width * count));
            for (i, (rgba, depth)) in bands.enumerate() {
                scope.spawn(move || rows(i * count, rgba, depth));
            }
        });
        View { camera, rgba, depth, width, height }
    }

    /// Colour of the pixel at (x, y), which may lie outside the camera's picture.
    pub fn pixel(&self, camera: &Camera, x: f64, y: f64) -> [u8; 3] {
        let mut sum = V::zeros();
        for i in 0..SAMPLES * SAMPLES {
            let offset = |k: usize| (k as f64 + 0.5) / SAMPLES as f64 - 0.5;
            let direction = camera.direction(x + offset(i % SAMPLES), y + offset(i / SAMPLES));
            sum += self.colour(&Ray::new(camera.centre, direction), i).map(|v| v.min(1.4));
        }
        let mean = sum / (SAMPLES * SAMPLES) as f64;
        let encode = |v: f64| {
            let v = libm::pow((v * 1.12 / (1.0 + 0.22 * v)).clamp(0.0, 1.0), 1.0 / 2.2);
            // A little more contrast.
            ((0.6 * v + 0.4 * v * v * (3.0 - 2.0 * v)) * 255.0).round() as u8
        };
        [encode(mean.x), encode(mean.y), encode(mean.z)]
    }

    /// Linear colour along a ray. `sample` picks the direction in which sunlight and ambient light are looked for: over
    /// the samples of a pixel that makes soft shadows without noise.
    fn colour(&self, ray: &Ray, sample: usize) -> V {
        let horizon = V::new(0.74, 0.76, 0.76);
        let Some(hit) = self.trace(ray, f64::INFINITY) else { return horizon };
        let point = ray.at(hit.t);
        let surface = hit.texture.colour(point, hit.normal);
        if matches!(hit.texture, Texture::Sky | Texture::Faint) {
            return surface;
        }
        let start = point + hit.normal * 1e-4;
        let near = hit.t < 25.0;

        let offsets = [-0.02, 0.0, 0.02];
        let towards = self.sun + V::new(offsets[sample % 3], 0.0, offsets[sample / 3 % 3]);
        let facing = hit.normal.dot(&self.sun).max(0.0);
        let lit = facing > 0.0 && !(near && self.blocked(&Ray::new(start, towards)));
        let sun = if lit { V::new(1.55, 1.27, 0.93) * facing } else { V::zeros() };

        let up = 0.5 - 0.5 * hit.normal.y;
        let sky = V::new(0.36, 0.46, 0.62) * (0.35 + 0.65 * up) + V::new(0.30, 0.23, 0.15) * (1.0 - up);
        let open = if near { self.openness(start, hit.normal, sample) } else { 1.0 };
        let colour = surface.component_mul(&(sun + sky * open));
        colour + (horizon - colour) * (1.0 - libm::exp(-hit.t / self.haze))
    }

    fn trace(&self, ray: &Ray, limit: f64) -> Option<Hit> {
        let (mut t, mut best) = (limit, None);
        for cluster in self.clusters.iter().filter(|c| c.meets(ray, limit)) {
            for group in &cluster.items {
                if !group.meets(ray, t) {
                    continue;
                }
                for (shape, texture) in &group.items {
                    if let Some((nearer, normal)) = shape.hit(ray, t) {
                        t = nearer;
                        best = Some(Hit { t, normal, texture: *texture });
                    }
                }
            }
        }
        best
    }

    /// Planes cast no shadow.
    fn blocked(&self, ray: &Ray) -> bool {
        let far = f64::INFINITY;
        let clusters = self.clusters.iter().filter(|c| c.bounds.is_some() && c.meets(ray, far));
        let groups = clusters.flat_map(|c| &c.items).filter(|g| g.meets(ray, far));
        groups.flat_map(|g| &g.items).any(|(shape, _)| shape.hit(ray, far).is_some())
    }

    /// How much of the sky's light arrives: 0 in a corner, 1 in the open.
    fn openness(&self, origin: V, normal: V, sample: usize) -> f64 {
        const REACH: f64 = 1.2;
        // Eight directions around and one straight up, about cosine-weighted.
        const TURN: [(f64, f64); 8] =
            [(1.0, 0.0), (0.7, 0.7), (0.0, 1.0), (-0.7, 0.7), (-1.0, 0.0), (-0.7, -0.7), (0.0, -1.0), (0.7, -0.7)];
        let other = if normal.y.abs() < 0.9 { V::new(0.0, 1.0, 0.0) } else { V::new(1.0, 0.0, 0.0) };
        let side = normal.cross(&other).normalize();
        let (a, b) = TURN.get(sample).copied().unwrap_or_default();
        let lean = if sample.is_multiple_of(2) { 0.9 } else { 1.6 };
        let direction = (normal + (side * a + normal.cross(&side) * b) * lean).normalize();
        match self.trace(&Ray::new(origin, direction), REACH) {
            Some(hit) => 0.1 + 0.9 * (hit.t / REACH).sqrt(),
            None => 1.0,
        }
    }
}
