//! Scenes with one property each.

use nalgebra::Vector3;

use super::camera::{Camera, Pose};
use super::render::Scene;
use super::shape::Shape;
use super::texture::Texture;
use super::views::Views;

type V = Vector3<f64>;

fn sun() -> V {
    V::new(-0.55, -0.65, -0.5)
}

fn poses(baseline: V) -> (Pose, Pose) {
    let target = Pose { centre: V::new(-0.3, -1.5, 0.0), yaw: -0.12, pitch: 0.0, roll: 0.01, focal: 0.82 };
    let reference = Pose { centre: target.centre + baseline, yaw: 0.1, pitch: 0.01, roll: -0.01, ..target };
    (target, reference)
}

/// One wall and nothing else: the map is a homography although the cameras moved.
pub fn plane() -> Scene {
    let (target, reference) = poses(V::new(0.6, 0.0, 0.15));
    let mut scene = Scene::new(target, reference, sun(), 200.0);
    let wall = Shape::Backdrop { z: 5.0, skyline: |_| f64::NEG_INFINITY };
    scene.add(vec![vec![(wall, Texture::Patches { size: 0.4 })]]);
    scene
}

/// The gallery from one place: the cameras only turn.
pub fn rotation() -> Scene {
    let mut scene = super::gallery();
    scene.reference.centre = scene.target.centre;
    scene
}

/// The gallery as somebody sees it who walks past and turns, taking three photos, one above the other, at each step.
pub fn walk(count: usize, width: usize, height: usize) -> Views {
    let scene = super::gallery();
    let first = Pose { centre: V::new(0.0, -1.56, 0.0), yaw: 0.0, ..scene.target };
    let middle = (count.div_ceil(3) as f64 - 1.0) / 2.0;
    let pose = |i: usize| {
        let (step, row) = ((i / 3) as f64 - middle, i % 3);
        let aside = V::new(0.2 * step, 0.04 * row as f64, -0.03 * step);
        let pitch = [0.0, 0.26, -0.24][row];
        Pose { centre: first.centre + aside, yaw: 0.17 * step + 0.01 * row as f64, pitch, ..first }
    };
    scene.views(&(0..count).map(pose).collect::<Vec<_>>(), width, height)
}

/// Near and far things without anything a detector could hold on to.
pub fn textureless() -> Scene {
    let (target, reference) = poses(V::new(0.6, 0.0, 0.15));
    let mut scene = Scene::new(target, reference, sun(), 200.0);
    let wall = Shape::Backdrop { z: 12.0, skyline: |_| f64::NEG_INFINITY };
    scene.add(vec![vec![(wall, Texture::Faint)]]);
    let ball = Shape::Ellipsoid { centre: V::new(0.2, -1.5, 5.0), radii: V::repeat(0.9) };
    scene.add(vec![vec![(ball, Texture::Faint)]]);
    scene
}

/// A room seen from `count` places next to each other: a tiled floor, a boarded white wall ahead and another one to the right, both with
/// a picture or two and hardly any joints.
pub fn room(count: usize, width: usize, height: usize) -> Views {
    let first = Pose { centre: V::new(-0.9, -1.5, 0.0), yaw: 0.1, pitch: -0.05, roll: 0.0, focal: 0.82 };
    let mut scene = Scene::new(first, first, V::new(-0.3, -0.6, -0.7), 400.0);
    let slab =
        |min: [f64; 3], max: [f64; 3], texture: Texture| (Shape::Box { min: min.into(), max: max.into() }, texture);
    let white = Texture::Flat(V::repeat(0.75));
    let board = Texture::Patches { size: 0.12 };
    let mut ahead =
        vec![slab([-8.0, -6.0, 5.0], [3.0, 0.0, 5.2], white), slab([-8.0, -0.35, 4.98], [3.0, 0.0, 5.0], board)];
    let mut right =
        vec![slab([3.0, -6.0, -2.0], [3.2, 0.0, 5.2], white), slab([2.98, -0.35, -2.0], [3.0, 0.0, 5.0], board)];
    for i in 0..4 {
        let at = f64::from(i) * 1.7;
        ahead.push(slab([at - 3.6, -6.0, 4.995], [at - 3.57, 0.0, 5.0], Texture::Flat(V::repeat(0.3))));
        right.push(slab([2.995, -6.0, 4.0 - at], [3.0, 0.0, 4.03 - at], Texture::Flat(V::repeat(0.3))));
    }
    scene.add(vec![vec![(Shape::Level { y: 0.0 }, Texture::Tiles { size: 0.5 })]]);
    scene.add(vec![ahead]);
    scene.add(vec![right]);
    let pose = |i: usize| {
        let step = i as f64;
        Pose {
            centre: first.centre + V::new(0.45 * step, 0.02 * step, 0.1 * step),
            yaw: first.yaw + 0.16 * step,
            ..first
        }
    };
    scene.views(&(0..count).map(pose).collect::<Vec<_>>(), width, height)
}

/// A near wall and, beside it and far behind, a house, seen by somebody who walks so many metres to the left and as many ahead, and turns to
/// the right by an angle: from the beginning, the middle and the end.
pub fn court(way: f64, turn: f64, (width, height): (usize, usize)) -> Views {
    let first = Pose { centre: V::new(0.0, -1.5, 0.0), yaw: 0.0, pitch: 0.0, roll: 0.0, focal: 0.9 };
    let mut scene = Scene::new(first, first, V::new(-0.3, -0.6, -0.7), 400.0);
    let slab = |min: [f64; 3], max: [f64; 3], size: f64| {
        (Shape::Box { min: min.into(), max: max.into() }, Texture::Patches { size })
    };
    scene.add(vec![vec![slab([-20.0, -20.0, 5.0], [1.5, 0.0, 5.2], 0.15)]]);
    scene.add(vec![vec![slab([-20.0, -40.0, 30.0], [90.0, 0.0, 30.2], 0.6)]]);
    scene.add(vec![vec![(Shape::Level { y: 0.0 }, Texture::Tiles { size: 0.5 })]]);
    let pose = |share: f64| Pose { centre: first.centre + V::new(-way, 0.0, way) * share, yaw: share * turn, ..first };
    scene.views(&[0.0, 0.5, 1.0].map(pose), width, height)
}

/// A square with a wall on each side, six to eleven metres away, in a full turn of `count` photos to the right by somebody who holds the
/// camera at arm's length, through a lens that distorts.
pub fn square(count: usize, distortion: f64, (width, height): (usize, usize)) -> Views {
    let first = Pose { centre: V::new(0.0, -1.5, 0.0), yaw: 0.0, pitch: 0.03, roll: 0.01, focal: 0.85 };
    let mut scene = Scene::new(first, first, V::new(-0.3, -0.6, -0.7), 400.0);
    let slab = |min: [f64; 3], max: [f64; 3]| {
        (Shape::Box { min: min.into(), max: max.into() }, Texture::Patches { size: 0.25 })
    };
    scene.add(vec![
        vec![slab([-12.0, -12.0, 9.0], [12.0, 0.0, 9.2])],
        vec![slab([7.0, -12.0, -12.0], [7.2, 0.0, 12.0])],
    ]);
    scene.add(vec![
        vec![slab([-12.0, -12.0, -6.2], [12.0, 0.0, -6.0])],
        vec![slab([-11.2, -12.0, -12.0], [-11.0, 0.0, 12.0])],
    ]);
    scene.add(vec![vec![(Shape::Level { y: 0.0 }, Texture::Tiles { size: 0.5 })]]);
    let view = |i: usize| {
        let yaw = std::f64::consts::TAU * i as f64 / count as f64;
        let held = V::new(libm::sin(yaw), 0.05 * libm::sin(3.0 * yaw), libm::cos(yaw)) * 0.3;
        let camera = Camera::new(&Pose { centre: first.centre + held, yaw, ..first }, width, height);
        scene.view(Camera { distortion, ..camera }, width, height, true)
    };
    Views((0..count).map(view).collect())
}
