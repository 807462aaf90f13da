//! The sample scene: a look through an arcade onto a garden and hills.

use nalgebra::Vector3;

use super::camera::Pose;
use super::noise::{fractal, hash};
use super::render::{Object, Scene};
use super::shape::Shape;
use super::texture::Texture;

type V = Vector3<f64>;

const LIMESTONE: V = V::new(0.66, 0.58, 0.45);
const PALE: V = V::new(0.72, 0.66, 0.55);

/// An arcade close by, a terrace with crates, balls, bushes and a balustrade, a brick wall with paintings, a meadow,
/// hills and sky. The target looks to the left, the reference stands to its right and looks to the right; about two
/// thirds of either is in the other.
pub fn gallery() -> Scene {
    let target = Pose { centre: V::new(-0.34, -1.58, 0.0), yaw: -0.15, pitch: -0.005, roll: 0.008, focal: 0.82 };
    let reference = Pose { centre: V::new(0.30, -1.55, 0.12), yaw: 0.12, pitch: 0.0, roll: -0.006, focal: 0.82 };
    let mut scene = Scene::new(target, reference, V::new(-0.62, -0.72, -0.42), 150.0);

    scene.add(vec![vec![
        (Shape::Backdrop { z: 54.0, skyline: |_| f64::NEG_INFINITY }, Texture::Sky),
        (Shape::Backdrop { z: 48.0, skyline: |x| ridge(x, 0.07, 14.0, 1.0) }, Texture::Hills(V::new(0.22, 0.30, 0.30))),
        (Shape::Backdrop { z: 38.0, skyline: |x| ridge(x, 0.11, 7.0, 2.0) }, Texture::Hills(V::new(0.16, 0.26, 0.12))),
        (Shape::Backdrop { z: 29.0, skyline: |x| ridge(x, 0.55, 2.2, 3.0) }, Texture::Hills(V::new(0.09, 0.17, 0.05))),
        (Shape::Level { y: 0.9 }, Texture::Grass),
    ]]);
    // The terrace.
    scene.add(vec![vec![block([-40.0, 0.0, -3.0], [40.0, 2.0, 12.2], Texture::Tiles { size: 0.62 })]]);
    scene.add(arcade());
    scene.add(balustrade());
    scene.add(cypresses());
    scene.add(trees());
    scene.add(things());
    scene
}

fn ridge(x: f64, scale: f64, height: f64, seed: f64) -> f64 {
    -height * fractal(V::new(x * scale, seed * 10.0, 0.5), 4) + 0.4
}

fn block(min: [f64; 3], max: [f64; 3], texture: Texture) -> Object {
    (Shape::Box { min: min.into(), max: max.into() }, texture)
}

/// A box on the floor around (x, z), of the given size.
fn crate_at(x: f64, z: f64, [width, height, depth]: [f64; 3], texture: Texture) -> Object {
    block([x - width / 2.0, -height, z - depth / 2.0], [x + width / 2.0, 0.0, z + depth / 2.0], texture)
}

fn ball(x: f64, y: f64, z: f64, radius: f64, texture: Texture) -> Object {
    (Shape::Ellipsoid { centre: V::new(x, y, z), radii: V::repeat(radius) }, texture)
}

fn arcade() -> Vec<Vec<Object>> {
    let mut groups = Vec::new();
    let (z, pitch, spring) = (4.5, 2.3, -2.12);
    let first = -4.6;
    for i in 0..5 {
        let x = first + pitch * f64::from(i);
        let slab = |half: f64, y: [f64; 2], texture: Texture| {
            block([x - half, y[0], z - half], [x + half, y[1], z + half], texture)
        };
        groups.push(vec![
            slab(0.30, [-0.12, 0.0], Texture::Stone(LIMESTONE)),
            slab(0.25, [-0.24, -0.12], Texture::Stone(PALE)),
            (
                Shape::Cylinder { x, z, radius: 0.185, y: [spring + 0.2, -0.24] },
                Texture::Fluted(V::new(0.74, 0.66, 0.52), [x, z]),
            ),
            slab(0.23, [spring + 0.12, spring + 0.2], Texture::Stone(PALE)),
            slab(0.29, [spring, spring + 0.12], Texture::Stone(LIMESTONE)),
        ]);
    }
    groups.push(vec![
        (
            Shape::Arcade {
                min: V::new(-9.0, -3.35, z - 0.2),
                max: V::new(9.0, spring, z + 0.2),
                radius: 0.9,
                first: first - pitch / 2.0,
                pitch,
                count: 6,
            },
            Texture::Bricks,
        ),
        block([-9.0, -3.5, z - 0.3], [9.0, -3.35, z + 0.3], Texture::Stone(PALE)),
        block([-9.0, -4.2, z - 0.2], [9.0, -3.5, z + 0.2], Texture::Bricks),
    ]);
    groups
}

fn balustrade() -> Vec<Vec<Object>> {
    let mut groups = Vec::new();
    let z = 11.8;
    for part in -4..5 {
        let x = f64::from(part) * 3.0;
        let mut objects = vec![crate_at(x, z, [0.42, 1.12, 0.42], Texture::Stone(LIMESTONE))];
        objects.push(block([x + 0.21, -0.98, z - 0.14], [x + 2.79, -0.84, z + 0.14], Texture::Stone(PALE)));
        objects.push(block([x + 0.21, -0.14, z - 0.14], [x + 2.79, 0.0, z + 0.14], Texture::Stone(PALE)));
        for i in 0..8 {
            let x = x + 0.45 + 0.3 * f64::from(i);
            let radii = V::new(0.085, 0.36, 0.085);
            objects.push((Shape::Ellipsoid { centre: V::new(x, -0.49, z), radii }, Texture::Stone(PALE)));
        }
        let ornament =
            if part & 1 == 0 { Texture::Stone(LIMESTONE) } else { Texture::Marble(PALE, V::new(0.3, 0.1, 0.06)) };
        objects.push(ball(x, -1.32, z, 0.2, ornament));
        groups.push(objects);
    }
    groups
}

/// Beyond the balustrade, in no regular order.
fn cypresses() -> Vec<Vec<Object>> {
    let mut groups = Vec::new();
    for i in 0..9 {
        let x = -15.0 + 3.6 * f64::from(i) + 2.0 * (hash(i, 1, 0) - 0.5);
        let z = 15.0 + 6.0 * hash(i, 2, 0);
        let height = 1.5 + 1.1 * hash(i, 3, 0);
        let green = V::new(0.08, 0.16 + 0.08 * hash(i, 4, 0), 0.05);
        let radii = V::new(0.48 + 0.2 * hash(i, 5, 0), height, 0.5);
        let crown = (Shape::Ellipsoid { centre: V::new(x, 0.6 - height, z), radii }, Texture::Leaves(green));
        groups.push(vec![crown]);
    }
    groups
}

/// In tubs on the terrace.
fn trees() -> Vec<Vec<Object>> {
    let mut groups = Vec::new();
    for (i, (x, z)) in [(-3.0, 9.4), (-1.2, 10.3), (1.9, 9.7), (4.6, 9.2)].into_iter().enumerate() {
        let green = V::new(0.17, 0.30, 0.06);
        let fruit = if i % 2 == 0 { V::new(0.26, 0.30, 0.05) } else { green };
        groups.push(vec![
            crate_at(x, z, [0.6, 0.55, 0.6], Texture::Wood { upright: true }),
            (Shape::Cylinder { x, z, radius: 0.05, y: [-1.2, -0.55] }, Texture::Wood { upright: true }),
            (Shape::Ellipsoid { centre: V::new(x, -1.62, z), radii: V::new(0.62, 0.56, 0.62) }, Texture::Leaves(fruit)),
        ]);
    }
    groups
}

fn things() -> Vec<Vec<Object>> {
    let mut groups = Vec::new();
    let wood = Texture::Wood { upright: false };
    let ivory = V::new(0.78, 0.72, 0.60);
    // A brick wall on the left with two paintings.
    let painting = |x: f64, y: f64, half: [f64; 2], texture: Texture| {
        let z = 7.28;
        let frame = block(
            [x - half[0] - 0.07, y - half[1] - 0.07, z - 0.05],
            [x + half[0] + 0.07, y + half[1] + 0.07, z + 0.02],
            wood,
        );
        let canvas = block([x - half[0], y - half[1], z - 0.06], [x + half[0], y + half[1], z], texture);
        [frame, canvas]
    };
    let mut wall = vec![
        block([-9.0, -2.7, 7.28], [-3.35, 0.0, 7.7], Texture::Bricks),
        block([-9.0, -2.84, 7.2], [-3.28, -2.7, 7.78], Texture::Stone(PALE)),
    ];
    wall.extend(painting(-4.25, -1.55, [0.55, 0.42], Texture::Patches { size: 0.17 }));
    wall.extend(painting(-5.75, -1.55, [0.42, 0.55], Texture::Bands(V::new(0.10, 0.25, 0.38), ivory, 0.22)));
    groups.push(wall);
    // Near, on the right of the middle: a plinth with a marble ball.
    groups.push(vec![
        crate_at(0.62, 3.75, [0.50, 0.10, 0.50], Texture::Stone(LIMESTONE)),
        crate_at(0.62, 3.75, [0.38, 0.62, 0.38], Texture::Marble(V::new(0.50, 0.20, 0.12), V::new(0.75, 0.66, 0.52))),
        block([0.38, -0.69, 3.51], [0.86, -0.62, 3.99], Texture::Stone(PALE)),
        ball(0.62, -0.91, 3.75, 0.22, Texture::Marble(ivory, V::new(0.12, 0.20, 0.22))),
    ]);
    // Crates and balls between the arcade and the balustrade.
    groups.push(vec![
        crate_at(-1.75, 6.5, [0.9, 0.62, 0.7], wood),
        block([-2.05, -1.06, 6.25], [-1.5, -0.62, 6.75], Texture::Wood { upright: true }),
        ball(-1.05, -0.25, 6.1, 0.25, Texture::Bands(V::new(0.62, 0.12, 0.08), ivory, 0.16)),
    ]);
    groups.push(vec![
        ball(0.15, -0.42, 7.6, 0.42, Texture::Patches { size: 0.2 }),
        ball(-0.65, -0.2, 7.0, 0.2, Texture::Marble(V::new(0.12, 0.28, 0.30), ivory)),
        ball(1.05, -0.3, 6.3, 0.3, Texture::Bands(V::new(0.08, 0.24, 0.36), ivory, 0.2)),
    ]);
    groups.push(vec![
        crate_at(2.75, 6.6, [1.0, 0.75, 0.8], Texture::Wood { upright: true }),
        ball(2.62, -1.03, 6.55, 0.28, Texture::Patches { size: 0.13 }),
        crate_at(3.75, 7.0, [0.7, 0.5, 0.7], wood),
        ball(3.75, -0.72, 7.0, 0.22, Texture::Bands(V::new(0.75, 0.45, 0.08), V::new(0.30, 0.08, 0.05), 0.13)),
    ]);
    groups
}
