//! Shapes and their intersection with rays.

use nalgebra::Vector3;

type V = Vector3<f64>;

/// Origin and direction; the direction need not have unit length.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    pub origin: V,
    pub direction: V,
    /// One over each component of the direction.
    inverse: V,
}

impl Ray {
    pub fn new(origin: V, direction: V) -> Self {
        Self { origin, direction, inverse: direction.map(|d| 1.0 / d) }
    }

    pub fn at(&self, t: f64) -> V {
        self.origin + self.direction * t
    }
}

#[derive(Debug, Clone, Copy)]
pub enum Shape {
    /// An axis-aligned box.
    Box { min: V, max: V },
    /// An ellipsoid with its axes along the world's.
    Ellipsoid { centre: V, radii: V },
    /// The side of an upright cylinder; `y` from top to bottom.
    Cylinder { x: f64, z: f64, radius: f64, y: [f64; 2] },
    /// A box with `count` half circles cut out of its lower edge, all the way along z.
    Arcade { min: V, max: V, radius: f64, first: f64, pitch: f64, count: u32 },
    /// The plane of this y.
    Level { y: f64 },
    /// The plane of this z, below a skyline.
    Backdrop { z: f64, skyline: fn(f64) -> f64 },
}

/// Nearer hits are a shape touching itself.
const NEAREST: f64 = 1e-6;

impl Shape {
    /// Ray parameter and outward normal of the first hit before `limit`.
    pub fn hit(&self, ray: &Ray, limit: f64) -> Option<(f64, V)> {
        let (o, d) = (ray.origin, ray.direction);
        let within = |t: f64| t > NEAREST && t < limit;
        match *self {
            Shape::Box { min, max } => {
                let (near, far, axis) = slabs(ray, min, max)?;
                // A box seen from inside is not there.
                (near <= far && within(near)).then(|| {
                    let mut normal = V::zeros();
                    normal[axis] = -d[axis].signum();
                    (near, normal)
                })
            }
            Shape::Ellipsoid { centre, radii } => {
                let (p, q) = ((o - centre).component_div(&radii), d.component_div(&radii));
                let (a, b, c) = (q.dot(&q), p.dot(&q), p.dot(&p) - 1.0);
                let root = b * b - a * c;
                let t = if root < 0.0 { return None } else { (-b - root.sqrt()) / a };
                within(t).then(|| (t, (p + q * t).component_div(&radii).normalize()))
            }
            Shape::Cylinder { x, z, radius, y } => {
                let (px, pz) = (o.x - x, o.z - z);
                let (a, b) = (d.x * d.x + d.z * d.z, px * d.x + pz * d.z);
                let root = b * b - a * (px * px + pz * pz - radius * radius);
                let t = if root < 0.0 { return None } else { (-b - root.sqrt()) / a };
                let height = o.y + d.y * t;
                (within(t) && height >= y[0] && height <= y[1])
                    .then(|| (t, V::new((px + d.x * t) / radius, 0.0, (pz + d.z * t) / radius)))
            }
            Shape::Arcade { min, max, radius, first, pitch, count } => {
                let (near, far, _) = slabs(ray, min, max)?;
                if near > far || near > limit {
                    return None;
                }
                let centre = |x: f64| first + pitch * ((x - first) / pitch).round().clamp(0.0, f64::from(count - 1));
                let outside_arch = |p: V| {
                    let (dx, dy) = (p.x - centre(p.x), p.y - max.y);
                    dx * dx + dy * dy >= radius * radius
                };
                let mut best: Option<(f64, V)> = None;
                let mut offer = |t: f64, normal: V| {
                    if within(t) && best.is_none_or(|(b, _)| t < b) {
                        best = Some((t, normal));
                    }
                };
                // The faces of the box, where nothing is cut out.
                for axis in 0..3 {
                    let face = if d[axis] > 0.0 { min[axis] } else { max[axis] };
                    let t = (face - o[axis]) / d[axis];
                    let p = ray.at(t);
                    let on_face = (0..3).all(|i| i == axis || (p[i] >= min[i] && p[i] <= max[i]));
                    if on_face && outside_arch(p) {
                        let mut normal = V::zeros();
                        normal[axis] = -d[axis].signum();
                        offer(t, normal);
                    }
                }
                // The insides of the arches.
                for i in 0..count {
                    let (px, py) = (o.x - (first + pitch * f64::from(i)), o.y - max.y);
                    let (a, b) = (d.x * d.x + d.y * d.y, px * d.x + py * d.y);
                    let root = b * b - a * (px * px + py * py - radius * radius);
                    if root >= 0.0 && a > 0.0 {
                        let t = (-b + root.sqrt()) / a;
                        let p = ray.at(t);
                        if p.y <= max.y && p.z >= min.z && p.z <= max.z {
                            offer(t, V::new(-(px + d.x * t) / radius, -(py + d.y * t) / radius, 0.0));
                        }
                    }
                }
                best
            }
            Shape::Level { y } => {
                let t = (y - o.y) / d.y;
                within(t).then(|| (t, V::new(0.0, -d.y.signum(), 0.0)))
            }
            Shape::Backdrop { z, skyline } => {
                let t = (z - o.z) / d.z;
                (within(t) && o.y + d.y * t >= skyline(o.x + d.x * t)).then(|| (t, V::new(0.0, 0.0, -d.z.signum())))
            }
        }
    }

    /// The box around it; planes have none.
    pub fn bounds(&self) -> Option<(V, V)> {
        match *self {
            Shape::Box { min, max } | Shape::Arcade { min, max, .. } => Some((min, max)),
            Shape::Ellipsoid { centre, radii } => Some((centre - radii, centre + radii)),
            Shape::Cylinder { x, z, radius, y } => {
                Some((V::new(x - radius, y[0], z - radius), V::new(x + radius, y[1], z + radius)))
            }
            Shape::Level { .. } | Shape::Backdrop { .. } => None,
        }
    }
}

/// Where a ray enters and leaves a box, and through which axis' face it enters.
pub fn slabs(ray: &Ray, min: V, max: V) -> Option<(f64, f64, usize)> {
    let (mut near, mut far, mut axis) = (f64::NEG_INFINITY, f64::INFINITY, 0);
    // Without branches, which nothing could foresee.
    for i in 0..3 {
        let (a, b) = ((min[i] - ray.origin[i]) * ray.inverse[i], (max[i] - ray.origin[i]) * ray.inverse[i]);
        let (a, b) = if a < b { (a, b) } else { (b, a) };
        axis = if a > near { i } else { axis };
        near = if a > near { a } else { near };
        far = if b < far { b } else { far };
    }
    (far >= 0.0 && near <= far).then_some((near, far, axis))
}
