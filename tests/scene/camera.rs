//! The pinhole camera, with a lens that may distort.

use nalgebra::{Matrix3, Vector3};

/// Where a camera stands and looks, and its focal length; size comes with rendering.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    pub centre: Vector3<f64>,
    /// To the right, in radians.
    pub yaw: f64,
    /// Upwards, in radians.
    pub pitch: f64,
    /// Of the camera, clockwise, in radians.
    pub roll: f64,
    /// In picture widths.
    pub focal: f64,
}

/// A pinhole camera: x ~ K R (X − C), where nothing distorts.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    pub k: Matrix3<f64>,
    /// World to camera.
    pub r: Matrix3<f64>,
    pub centre: Vector3<f64>,
    /// k of the division model, for radii in diagonals of the picture.
    pub distortion: f64,
}

impl Camera {
    /// The camera at `pose` that takes pictures of `width`×`height` pixels, its principal point in the middle.
    pub fn new(pose: &Pose, width: usize, height: usize) -> Self {
        let f = pose.focal * width as f64;
        let (cx, cy) = ((width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0);
        let k = Matrix3::new(f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0);
        let (s, c) = (libm::sin(pose.yaw), libm::cos(pose.yaw));
        let yaw = Matrix3::new(c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c);
        let (s, c) = (libm::sin(pose.pitch), libm::cos(pose.pitch));
        let pitch = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, s, 0.0, -s, c);
        let (s, c) = (libm::sin(pose.roll), libm::cos(pose.roll));
        let roll = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        Self { k, r: roll * pitch * yaw, centre: pose.centre, distortion: 0.0 }
    }

    /// Inverse of K.
    pub fn k_inverse(&self) -> Matrix3<f64> {
        let (f, cx, cy) = (self.k[(0, 0)], self.k[(0, 2)], self.k[(1, 2)]);
        Matrix3::new(1.0 / f, 0.0, -cx / f, 0.0, 1.0 / f, -cy / f, 0.0, 0.0, 1.0)
    }

    /// World direction of the ray through (x, y), its component along the optical axis 1: the ray's parameter is depth.
    pub fn direction(&self, x: f64, y: f64) -> Vector3<f64> {
        let [x, y] = self.undistorted([x, y]);
        self.r.transpose() * (self.k_inverse() * Vector3::new(x, y, 1.0))
    }

    /// Pixel and depth of a point of the world, or `None` behind the camera.
    pub fn project(&self, point: Vector3<f64>) -> Option<([f64; 2], f64)> {
        let p = self.k * (self.r * (point - self.centre));
        (p.z > 0.0).then(|| (self.distorted([p.x / p.z, p.y / p.z]), p.z))
    }

    /// Where a pixel would be without distortion.
    pub fn undistorted(&self, pixel: [f64; 2]) -> [f64; 2] {
        self.scaled(pixel, |square| 1.0 / (1.0 + self.distortion * square))
    }

    fn distorted(&self, pixel: [f64; 2]) -> [f64; 2] {
        self.scaled(pixel, |square| 2.0 / (1.0 + (1.0 - 4.0 * self.distortion * square).sqrt()))
    }

    /// Moves a pixel from or to the middle, by a factor that its squared distance has.
    fn scaled(&self, pixel: [f64; 2], factor: impl Fn(f64) -> f64) -> [f64; 2] {
        if self.distortion == 0.0 {
            return pixel;
        }
        let middle = [self.k[(0, 2)], self.k[(1, 2)]];
        let [dx, dy] = [0, 1].map(|i| pixel[i] - middle[i]);
        let [width, height] = middle.map(|m| 2.0 * m + 1.0);
        let factor = factor((dx * dx + dy * dy) / (width * width + height * height));
        [middle[0] + dx * factor, middle[1] + dy * factor]
    }
}
