//! Any number of views of a scene and the truth between them.

use depthstitch::geometry::Model;

use super::camera::{Camera, Pose};
use super::pair::model;
use super::render::{Scene, View};

/// Views of the same size.
#[derive(Debug, Clone)]
pub struct Views(pub Vec<View>);

impl Scene {
    /// What cameras at these poses see.
    pub fn views(&self, poses: &[Pose], width: usize, height: usize) -> Views {
        Views(poses.iter().map(|pose| self.view(Camera::new(pose, width, height), width, height, true)).collect())
    }
}

impl Views {
    /// x' ~ H∞ x̃ + e'·(1/z) from one view to another.
    pub fn model(&self, [from, to]: [usize; 2]) -> Model {
        model(&self.0[from].camera, &self.0[to].camera)
    }

    /// The true place in another view of a pixel of one; `None` behind the camera.
    pub fn place(&self, [from, to]: [usize; 2], [x, y]: [usize; 2]) -> Option<[f64; 2]> {
        let view = &self.0[from];
        self.model([from, to]).project(x as f64, y as f64, 1.0 / view.depth[y * view.width + x])
    }
}
