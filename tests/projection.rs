//! Two photos on a cylinder and on a sphere: every pixel is where its ray belongs.
#![allow(clippy::unwrap_used)]

use depthstitch::geometry::Match;
use depthstitch::pipeline::{Options, Stitched, WithoutDepth, stitch};
use depthstitch::warp::Projection;
use depthstitch::{Image, View};
use nalgebra::Vector3;
use scene::{Camera, MatchOptions, Pair, Photos, Pose, median};
#[cfg(target_arch = "wasm32")]
use wasm_bindgen_test::wasm_bindgen_test as test;

const SIZE: (usize, usize) = (240, 160);
const EXACT: MatchOptions = MatchOptions { count: 300, sigma: 0.0, outliers: 0.0, seed: 1 };

/// In whole pixels from the picture's first one.
type Place = [i64; 2];

fn stitched(photos: &Photos, projection: Option<Projection>, focal: Option<f64>) -> Stitched {
    let mut options = Options { projection, ..Options::default() };
    options.estimate.focal = focal;
    stitch(Some(&photos.matches), photos.target(), photos.reference(), &options, &mut ()).unwrap()
}

/// Where a ray in the reference's axes appears, around an upright axis.
fn unrolled(projection: Projection, focal: f64, ray: Vector3<f64>) -> [f64; 2] {
    let across = libm::sqrt(ray.x * ray.x + ray.z * ray.z);
    let down = if projection == Projection::Sphere { libm::atan2(ray.y, across) } else { ray.y / across };
    [focal * libm::atan2(ray.x, ray.z), focal * down]
}

/// The same around a level one, from left to right.
fn unrolled_transverse(projection: Projection, focal: f64, ray: Vector3<f64>) -> [f64; 2] {
    let [y, x] = unrolled(projection, focal, Vector3::new(ray.y, ray.x, ray.z));
    [x, y]
}

type Unrolled = fn(Projection, f64, Vector3<f64>) -> [f64; 2];

/// Where pixels of the target and of the reference belong in the picture, by the true cameras and depth.
fn true_places<'a>(
    pair: &'a Pair<'_>,
    found: &Stitched,
    unrolled: Unrolled,
) -> [impl Fn(usize, usize) -> Place + 'a; 2] {
    let (camera, projection) = (pair.reference.camera, found.projection);
    let focal = camera.k[(0, 0)];
    let place = move |ray| unrolled(projection, focal, ray);
    let (w, h) = (SIZE.0 as f64 - 1.0, SIZE.1 as f64 - 1.0);
    let border = (0..=100).flat_map(|i| {
        let (x, y) = (w * f64::from(i) / 100.0, h * f64::from(i) / 100.0);
        [[x, 0.0], [x, h], [0.0, y], [w, y]].map(|[x, y]| place(camera.k_inverse() * Vector3::new(x, y, 1.0)))
    });
    let first = border.fold([f64::MAX; 2], |[x, y], [u, v]| [x.min(u), y.min(v)]);
    let (left, top) = (found.warped.offset.0 as f64, found.warped.offset.1 as f64);
    let on_canvas = move |ray: Vector3<f64>| {
        let [u, v] = place(ray);
        [u - first[0].floor() + left, v - first[1].floor() + top].map(|v| v.round() as i64)
    };
    let of = |view: &'a scene::View| {
        move |x: usize, y: usize| {
            let z = view.depth[y * SIZE.0 + x];
            let point = view.camera.centre + view.camera.direction(x as f64, y as f64) * z;
            on_canvas(camera.r * (point - camera.centre))
        }
    };
    [of(&pair.target), of(&pair.reference)]
}

/// How much colours differ at the median from those `below` where they belong, and of how many pixels that show.
fn differing(pair: &Pair<'_>, photos: &Photos, found: &Stitched, below: i64, unrolled: Unrolled) -> (f64, usize) {
    let (mosaic, mut errors) = (&found.mosaic, Vec::new());
    let width = mosaic.image.width();
    let own = [photos.target().image, photos.reference().image];
    for (side, place) in true_places(pair, found, unrolled).iter().enumerate() {
        for (x, y) in (6..SIZE.1 - 6).step_by(3).flat_map(|y| (6..SIZE.0 - 6).step_by(3).map(move |x| (x, y))) {
            let [u, v] = place(x, y);
            if u < 0 || u as usize >= width || v + below < 0 {
                continue;
            }
            let at = (v + below) as usize * width + u as usize;
            if mosaic.seam.data().get(at) == Some(&(side as u8 + 1)) {
                let (a, b) = (own[side].pixel(x, y), mosaic.image.pixels()[at]);
                errors.push((0..3).map(|c| f64::from(a[c].abs_diff(b[c]))).sum::<f64>() / 3.0);
            }
        }
    }
    let count = errors.len();
    (median(errors), count)
}

/// Pixels have the colours that belong there, rather than those some pixels below.
fn assert_in_place(pair: &Pair<'_>, photos: &Photos, found: &Stitched, unrolled: Unrolled) {
    let [(here, count), (there, _)] = [0, 8].map(|below| differing(pair, photos, found, below, unrolled));
    assert!(count > 3000, "{count} pixels");
    assert!(here < 0.5 * there, "{:?}: colours differ by {here} levels, elsewhere by {there}", found.projection);
}

#[test]
fn pixels_are_where_their_rays_belong() {
    let scene = scene::gallery();
    let pair = scene.render(SIZE.0, SIZE.1);
    let photos = Photos::of(&pair, &EXACT);
    let plane = stitched(&photos, None, None);
    assert_eq!(plane.projection, Projection::Plane);
    assert!(plane.projected_reference.is_none());
    for projection in [Projection::Cylinder, Projection::Sphere] {
        let found = stitched(&photos, Some(projection), Some(pair.reference.camera.k[(0, 0)]));
        assert_eq!(found.projection, projection);
        assert_in_place(&pair, &photos, &found, unrolled);
        // As well aligned as on the plane, of which both are almost a copy here.
        let (own, other) = (found.quality, plane.quality);
        assert!(
            own.psnr_mask > other.psnr_mask - 1.0 && (own.coverage - other.coverage).abs() < 0.1,
            "{own:?} {other:?}"
        );
        // The reference is transparent where the projection surface leaves its frame.
        let reference = found.projected_reference.as_ref().unwrap();
        let shown = reference.pixels().iter().filter(|pixel| pixel[3] == 255).count();
        assert!(shown < reference.pixels().len() && shown * 10 > reference.pixels().len() * 9);
    }
}

/// The plane is left where it would stretch the target very much, and only there.
#[test]
fn wide_pairs_are_not_shown_on_the_plane() {
    let mut scene = scene::gallery();
    scene.target.yaw = -0.65;
    let pair = scene.render(SIZE.0, SIZE.1);
    let photos = Photos::of(&pair, &EXACT);
    let focal = Some(pair.reference.camera.k[(0, 0)]);
    let [found, plane] = [None, Some(Projection::Plane)].map(|projection| stitched(&photos, projection, focal));
    assert_eq!(found.projection, Projection::Cylinder);
    let [width, on_plane] = [&found, &plane].map(|stitched| stitched.mosaic.image.width());
    assert!(width * 3 < on_plane * 2, "{width} instead of {on_plane} px");
    assert_in_place(&pair, &photos, &found, unrolled);
}

/// Looking up, the axis of the cylinder is level: what is far above is not stretched either.
#[test]
fn tall_pairs_are_shown_around_a_level_axis() {
    let mut scene = scene::gallery();
    scene.target = Pose { pitch: 0.6, ..scene.reference };
    scene.target.centre.y -= 0.35;
    let pair = scene.render(SIZE.0, SIZE.1);
    let photos = Photos::of(&pair, &EXACT);
    let focal = Some(pair.reference.camera.k[(0, 0)]);
    let found = stitched(&photos, Some(Projection::Cylinder), focal);
    assert_in_place(&pair, &photos, &found, unrolled_transverse);
}

/// Without a focal length it is found by self-calibration: what is far to the side is not stretched.
#[test]
fn focal_length_need_not_be_known() {
    let scene = scene::gallery();
    let photos = Photos::of(&scene.render(SIZE.0, SIZE.1), &EXACT);
    let [plane, cylinder] = [Projection::Plane, Projection::Cylinder].map(|p| stitched(&photos, Some(p), None));
    assert_eq!(cylinder.projection, Projection::Cylinder);
    assert!(cylinder.mosaic.image.width() < plane.mosaic.image.width());
}

/// A wall that the reference's camera stands next to, seen as a whole by the target's: it is stretched most where it is nearest, and
/// stays in one piece.
#[test]
fn a_wall_beside_the_camera_is_not_torn() {
    let (focal, middle) = (200.0, [119.5, 79.5]);
    let (centre, wall) = (Vector3::new(1.0, 0.0, -1.5), -0.1);
    let turned = nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), -0.6);
    let matches = (0..SIZE.0 * SIZE.1).step_by(97).filter_map(|i| {
        let target = [i % SIZE.0, i / SIZE.0].map(|v| v as f64);
        let ray = turned * Vector3::new((target[0] - middle[0]) / focal, (target[1] - middle[1]) / focal, 1.0);
        let point = centre + ray * ((wall - centre.x) / ray.x);
        let reference = [point.x, point.y].map(|v| v / point.z * focal);
        let reference = [reference[0] + middle[0], reference[1] + middle[1]];
        let inside = reference.iter().zip([239.0, 159.0]).all(|(v, last)| (0.0..=last).contains(v));
        (ray.x < 0.0 && point.z > 0.0 && inside).then_some(Match { target, reference })
    });
    let matches: Vec<_> = matches.collect();
    assert!(matches.len() > 20, "{} matches", matches.len());
    let photo = Image::new([90, 120, 150, 255].repeat(SIZE.0 * SIZE.1), SIZE.0, SIZE.1).unwrap();
    let view = View { image: photo.view(), depth: None };
    let mut options = Options { projection: Some(Projection::Cylinder), ..Options::default() };
    options.without_depth = WithoutDepth::Homography;
    options.estimate.focal = Some(focal);
    let found = stitch(Some(&matches), view, view, &options, &mut ()).unwrap();
    let warped = &found.warped.image;
    let mut columns: Vec<_> = warped
        .pixels()
        .iter()
        .enumerate()
        .filter(|(_, pixel)| pixel[3] != 0)
        .map(|(i, _)| i % warped.width())
        .collect();
    columns.sort_unstable();
    columns.dedup();
    let (first, last) = (columns[0], columns[columns.len() - 1]);
    assert!(last - first > 400, "{first} to {last}");
    assert_eq!(columns.len(), last - first + 1);
}

/// A focal length is given for the target: that of a larger reference is as much longer.
#[test]
fn focal_length_is_the_same_share_of_both_diagonals() {
    let scene = scene::gallery();
    let pair = scene.render(SIZE.0, SIZE.1);
    let focal = pair.target.camera.k[(0, 0)];
    let size = (2 * SIZE.0, 2 * SIZE.1);
    let large = scene.view(Camera::new(&scene.reference, size.0, size.1), size.0, size.1, true);
    let mut photos = Photos::of(&pair, &EXACT);
    photos.reference = Image::new(large.rgba, size.0, size.1).unwrap();
    (photos.target_depth, photos.reference_depth) = (None, None);
    photos.matches.iter_mut().for_each(|m| m.reference = m.reference.map(|at| 2.0 * at + 0.5));
    let found = stitched(&photos, Some(Projection::Cylinder), Some(focal));
    let width = found.projected_reference.unwrap().width() as f64;
    let half = libm::atan((size.0 as f64 - 1.0) / 2.0 / (2.0 * focal));
    assert!((width - 4.0 * focal * half).abs() < 4.0, "{width} instead of {} px", 4.0 * focal * half);
}
