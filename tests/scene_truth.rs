//! The synthetic scenes agree with themselves: what the other tests take for the truth is true.
#![allow(clippy::unwrap_used, clippy::panic)]

mod fingerprint;

use depthstitch::geometry::Model;
use fingerprint::fingerprint;
use scene::{Camera, MatchOptions, Pair, Random, Scene, View, distance};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (120, 80);

fn render(scene: &Scene) -> Pair<'_> {
    scene.render(SIZE.0, SIZE.1)
}

fn share(flags: &[bool]) -> f64 {
    flags.iter().filter(|&&f| f).count() as f64 / flags.len() as f64
}

/// The pixels of a view with their index.
fn pixels(view: &View) -> impl Iterator<Item = (usize, usize, usize)> {
    let width = view.width;
    (0..view.depth.len()).map(move |i| (i, i % width, i / width))
}

#[test]
fn map_is_the_projection_of_the_points_in_space() {
    let scene = scene::gallery();
    let pair = scene.survey(SIZE.0, SIZE.1);
    let directions = [
        (&pair.target, &pair.reference.camera, pair.map()),
        (&pair.reference, &pair.target.camera, pair.reverse_map()),
    ];
    for (view, other, map) in directions {
        for (i, x, y) in pixels(view) {
            let z = view.depth[i];
            assert!(z.is_finite() && z > 1.0, "depth {z}");
            let point = view.camera.centre + view.camera.direction(x as f64, y as f64) * z;
            let (place, _) = other.project(point).unwrap();
            assert!(distance(place, map[i].unwrap()) < 1e-8, "at {x}, {y}");
        }
    }
}

#[test]
fn survey_has_the_depth_of_the_rendering() {
    let scene = scene::textureless();
    let (full, quick) = (render(&scene), scene.survey(SIZE.0, SIZE.1));
    assert_eq!((&full.target.depth, &full.reference.depth), (&quick.target.depth, &quick.reference.depth));
    assert_eq!((full.forward, full.reverse), (quick.forward, quick.reverse));
    assert!(full.target.rgba != quick.target.rgba);
}

#[test]
fn depth_is_measured_along_the_optical_axis() {
    let scene = scene::plane();
    let camera = Camera::new(&scene.target, SIZE.0, SIZE.1);
    let axis = camera.r.transpose().column(2).into_owned();
    for (x, y) in [(0.0, 0.0), (119.0, 0.0), (60.2, 41.7), (119.0, 79.0)] {
        let z = scene.depth(&camera, x, y);
        let point = camera.centre + camera.direction(x, y) * z;
        assert!((point.z - 5.0).abs() < 1e-9, "the wall stands at z = 5, not {}", point.z);
        assert!(((point - camera.centre).dot(&axis) - z).abs() < 1e-9);
    }
}

#[test]
fn back_and_forth_is_where_it_began_and_visibility_is_mutual() {
    let scene = scene::gallery();
    let pair = scene.survey(SIZE.0, SIZE.1);
    let visible = pair.visible_in_reference();
    for (i, x, y) in pixels(&pair.target).filter(|p| visible[p.0]) {
        let there = pair.forward.project(x as f64, y as f64, 1.0 / pair.target.depth[i]).unwrap();
        let z = scene.depth(&pair.reference.camera, there[0], there[1]);
        let back = pair.reverse.project(there[0], there[1], 1.0 / z).unwrap();
        assert!(distance(back, [x as f64, y as f64]) < 1e-3, "{x}, {y} came back as {back:?}");
    }
}

#[test]
fn hidden_pixels_are_behind_something_nearer() {
    let scene = scene::gallery();
    let pair = scene.survey(SIZE.0, SIZE.1);
    let (map, visible) = (pair.map(), pair.visible_in_reference());
    let inside = |p: [f64; 2]| (0.0..=119.0).contains(&p[0]) && (0.0..=79.0).contains(&p[1]);
    let mut hidden = 0;
    for (i, x, y) in pixels(&pair.target).filter(|p| !visible[p.0]) {
        let place = map[i].unwrap();
        if inside(place) {
            let point =
                pair.target.camera.centre + pair.target.camera.direction(x as f64, y as f64) * pair.target.depth[i];
            let (_, own) = pair.reference.camera.project(point).unwrap();
            let seen = scene.depth(&pair.reference.camera, place[0], place[1]);
            assert!(seen < own, "at {x}, {y}: the reference sees to {seen}, the point lies at {own}");
            hidden += 1;
        }
    }
    assert!(hidden > 300, "{hidden} hidden pixels");
    // Overlap and extent of the sample: about two thirds of the target fall into the reference's frame, and a good part
    // of the rest beyond its left edge.
    let framed = map.iter().flatten().filter(|p| inside(**p)).count() as f64 / map.len() as f64;
    assert!((0.55..0.75).contains(&framed), "{framed}");
    let left = map.iter().flatten().filter(|p| p[0] < 0.0).count() as f64 / map.len() as f64;
    assert!(left > 0.25, "{left}");
}

#[test]
fn colours_of_what_both_see_agree() {
    let scene = scene::gallery();
    let pair = scene.render(240, 160);
    let (map, visible) = (pair.map(), pair.visible_in_reference());
    let mut differences = Vec::new();
    let mut shuffled = Vec::new();
    for (i, x, y) in pixels(&pair.target).filter(|p| visible[p.0]) {
        let [u, v] = map[i].unwrap();
        let here = pair.target.rgb(x, y);
        let difference = |u: f64, v: f64| {
            let there = bilinear(&pair.reference, u, v);
            here.iter().zip(there).map(|(&a, b)| (f64::from(a) - b).abs()).sum::<f64>() / 3.0
        };
        differences.push(difference(u, v));
        shuffled.push(difference((u + 97.0) % 239.0, v));
    }
    let median = |v: &mut Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    let (true_pairs, wrong_pairs) = (median(&mut differences), median(&mut shuffled));
    assert!(true_pairs < 6.0 && wrong_pairs > 3.0 * true_pairs, "{true_pairs} against {wrong_pairs}");
}

fn bilinear(view: &View, x: f64, y: f64) -> [f64; 3] {
    let (x0, y0) = ((x as usize).min(view.width - 2), (y as usize).min(view.height - 2));
    let (fx, fy) = (x - x0 as f64, y - y0 as f64);
    let at = |dx: usize, dy: usize| view.rgb(x0 + dx, y0 + dy).map(f64::from);
    let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
    std::array::from_fn(|k| (a[k] * (1.0 - fx) + b[k] * fx) * (1.0 - fy) + (c[k] * (1.0 - fx) + d[k] * fx) * fy)
}

#[test]
fn matches_have_the_noise_and_the_outliers_asked_for() {
    let scene = scene::gallery();
    let pair = scene.survey(240, 160);
    let exact = MatchOptions { count: 300, sigma: 0.0, outliers: 0.0, seed: 5 };
    let sampled = pair.matches(&exact);
    assert_eq!((sampled.matches.len(), share(&sampled.inliers)), (300, 1.0));
    let error = |model: &Model, m: &depthstitch::geometry::Match| {
        let [x, y] = m.target;
        let z = pair.target.depth[y.round() as usize * 240 + x.round() as usize];
        distance(model.project(x, y, 1.0 / z).unwrap(), m.reference)
    };
    assert!(sampled.matches.iter().all(|m| error(&pair.forward, m) < 1e-9));
    // Spread: no quarter of the overlap is empty.
    let left = sampled.matches.iter().map(|m| m.reference[0]).filter(|&x| x < 80.0).count();
    let low = sampled.matches.iter().filter(|m| m.target[1] > 80.0).count();
    assert!((75..225).contains(&left) && (75..225).contains(&low), "{left} left, {low} low");

    let noisy = pair.matches(&MatchOptions { sigma: 0.5, outliers: 0.3, ..exact });
    let outliers = 1.0 - share(&noisy.inliers);
    assert!((outliers - 0.3).abs() < 0.08, "{outliers}");
    // Noise on both sides: the squared error is about 4σ² (2 views of 2 coordinates), as the map is nearly a shift.
    let squares: Vec<f64> = noisy
        .matches
        .iter()
        .zip(&noisy.inliers)
        .filter(|(_, inlier)| **inlier)
        .map(|(m, _)| error(&pair.forward, m).powi(2))
        .collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((0.6..1.6).contains(&mean), "{mean}");
    // The same seed gives the same matches, another gives others.
    assert_eq!(noisy.matches, pair.matches(&MatchOptions { sigma: 0.5, outliers: 0.3, ..exact }).matches);
    assert_ne!(sampled.matches, pair.matches(&MatchOptions { seed: 6, ..exact }).matches);
}

#[test]
fn plane_is_a_homography() {
    let scene = scene::plane();
    let pair = scene.survey(SIZE.0, SIZE.1);
    assert!(pair.forward.e.norm() > 10.0, "the cameras moved");
    // Inverse depth is linear in the pixel: d = g·(x, y, 1), so H = H∞ + e'·g maps every pixel.
    let d = |x: usize, y: usize| 1.0 / pair.target.depth[y * SIZE.0 + x];
    let g = nalgebra::RowVector3::new(d(1, 0) - d(0, 0), d(0, 1) - d(0, 0), d(0, 0));
    let homography = Model::homography(pair.forward.h + pair.forward.e * g);
    for ((_, x, y), place) in pixels(&pair.target).zip(pair.map()) {
        let there = homography.project(x as f64, y as f64, 0.0).unwrap();
        assert!(distance(there, place.unwrap()) < 1e-6, "at {x}, {y}");
    }
}

#[test]
fn rotation_has_no_parallax() {
    let scene = scene::rotation();
    let pair = scene.survey(SIZE.0, SIZE.1);
    assert_eq!((pair.forward.e.norm(), pair.reverse.e.norm()), (0.0, 0.0));
    let depth = &pair.target.depth;
    assert!(depth.iter().any(|&z| z < 5.0) && depth.iter().any(|&z| z > 25.0));
    // Nothing hides behind anything: what maps into the frame is visible.
    for (place, visible) in pair.map().iter().zip(pair.visible_in_reference()) {
        let [x, y] = place.unwrap();
        let margin = 1e-9;
        let inside = x > margin && y > margin && x < 119.0 - margin && y < 79.0 - margin;
        assert!(visible || !inside, "{x}, {y}");
    }
}

#[test]
fn textureless_has_hardly_any_contrast() {
    let (faint, rich) = (scene::textureless(), scene::gallery());
    let gradient = |view: &View| {
        let inner = pixels(view).filter(|&(_, x, _)| x + 1 < SIZE.0);
        inner.map(|(_, x, y)| f64::from(view.rgb(x, y)[1].abs_diff(view.rgb(x + 1, y)[1]))).sum::<f64>()
            / view.depth.len() as f64
    };
    let (faint, rich) = (gradient(&render(&faint).target), gradient(&render(&rich).target));
    assert!(faint < 0.5 && rich > 5.0, "{faint}, {rich}");
}

#[test]
fn camera_projects_its_own_rays_back() {
    let scene = scene::gallery();
    let mut random = Random::new(3);
    let camera = Camera::new(&scene.reference, 640, 480);
    for _ in 0..100 {
        let (x, y, z) = (random.uniform() * 640.0, random.uniform() * 480.0, 1.0 + random.uniform() * 9.0);
        let (place, depth) = camera.project(camera.centre + camera.direction(x, y) * z).unwrap();
        assert!(distance(place, [x, y]) < 1e-9 && (depth - z).abs() < 1e-9);
        assert!(camera.project(camera.centre - camera.direction(x, y) * z).is_none());
    }
}

/// The constant is what the native build gave: wasm has to give the same.
#[test]
fn bytes_are_the_same_on_every_platform() {
    let scene = scene::gallery();
    let pair = scene.render(96, 64);
    let mut bytes = Vec::new();
    for view in [&pair.target, &pair.reference] {
        bytes.extend(&view.rgba);
        bytes.extend(view.depth.iter().flat_map(|z| z.to_le_bytes()));
    }
    for m in pair.matches(&MatchOptions { count: 100, sigma: 0.3, outliers: 0.1, seed: 1 }).matches {
        bytes.extend(m.target.iter().chain(&m.reference).flat_map(|v| v.to_le_bytes()));
    }
    let hash = fingerprint(bytes.into_iter().map(u64::from));
    assert_eq!(hash, 0x367f_8f15_ea68_59c6, "{hash:#018x}");
}
