//! Sets of views as many photos are taken, and how far what was found is from the truth.

use depthstitch::ImageView;
use depthstitch::InverseDepth;
use depthstitch::geometry;
use depthstitch::inverse_depth::DepthKind;
use depthstitch::pipeline::many::{ManyAlignment, Photo};
use nalgebra::Vector3;

use super::camera::{Camera, Pose};
use super::gallery::gallery;
use super::measure::{distance, median};
use super::render::View;
use super::views::Views;

/// Width and height of the photos.
pub const SIZE: (usize, usize) = (320, 240);

/// Photos of which nothing else is known.
pub fn photos(views: &Views) -> Vec<Photo<'_>> {
    let image = |data, width, height| ImageView::new("photo", data, width, height).unwrap();
    views.0.iter().map(|view| Photo::new(image(&view.rgba, view.width, view.height))).collect()
}

/// Cameras in front of the gallery, each at (x, z) in metres and turned by an angle to the right.
pub fn gallery_from(places: &[[f64; 3]]) -> Views {
    gallery_through(places, 0.0)
}

/// As [`gallery_from`], by a lens that distorts.
pub fn gallery_through(places: &[[f64; 3]], distortion: f64) -> Views {
    let scene = gallery();
    let first = scene.target;
    let pose = |&[x, z, yaw]: &[f64; 3]| Pose { centre: first.centre + Vector3::new(x, 0.0, z), yaw, ..first };
    let view = |place| {
        let camera = Camera { distortion, ..Camera::new(&pose(place), SIZE.0, SIZE.1) };
        scene.view(camera, SIZE.0, SIZE.1, true)
    };
    Views(places.iter().map(view).collect())
}

/// The camera that a view was rendered with.
pub fn camera(view: &View) -> geometry::Camera {
    let (rotation, centre) = (view.camera.r, view.camera.centre);
    geometry::Camera { rotation, translation: -(rotation * centre) }
}

/// Photos of which the camera is known, and depth as `of` makes it of the true one.
pub fn with_cameras<'a>(views: &'a Views, depths: &'a [InverseDepth]) -> Vec<Photo<'a>> {
    let known = |(i, photo): (usize, Photo<'a>)| {
        let view = &views.0[i];
        Photo { focal: Some(view.camera.k[(0, 0)]), camera: Some(camera(view)), depth: depths.get(i), ..photo }
    };
    photos(views).into_iter().enumerate().map(known).collect()
}

/// Inverse depth of a view, as `of` makes it of the true one and the index of the pixel.
pub fn depth_map(view: &View, of: impl Fn(f32, usize) -> f32) -> InverseDepth {
    let raw: Vec<f32> = view.inverse_depth().into_iter().enumerate().map(|(i, d)| of(d, i)).collect();
    InverseDepth::new("depth", &raw, SIZE, DepthKind::Inverse, None, SIZE).unwrap()
}

/// What became of each photo.
pub fn codes(found: &ManyAlignment) -> Vec<&'static str> {
    found.codes.iter().map(|code| code.code()).collect()
}

/// The median distance in pixels of where the pixels of all photos land in the reference's view from where they should: of
/// those that some other photo sees, and of the rest.
pub fn landing_errors(found: &ManyAlignment, views: &Views) -> [f64; 2] {
    let (mut seen, mut alone) = (Vec::new(), Vec::new());
    for &photo in found.order.iter().filter(|photo| **photo != found.reference) {
        let (model, depth) = found.map(photo).unwrap();
        for (x, y) in (0..SIZE.1).step_by(7).flat_map(|y| (0..SIZE.0).step_by(7).map(move |x| (x, y))) {
            let d = depth.map_or(0.0, |depth| f64::from(depth.data()[y * SIZE.0 + x]));
            let Some(truth) = views.place([photo, found.reference], [x, y]) else { continue };
            let place = model.project(x as f64, y as f64, d);
            let error = place.map_or(f64::INFINITY, |[u, v]| distance([u, v], truth));
            let inside = |other: usize| {
                let [u, v] = views.place([photo, other], [x, y]).unwrap_or([-1.0; 2]);
                u >= 0.0 && v >= 0.0 && u < SIZE.0 as f64 && v < SIZE.1 as f64
            };
            let others = (0..views.0.len()).filter(|other| *other != photo).any(inside);
            if others { seen.push(error) } else { alone.push(error) }
        }
    }
    // Not a number where there are none, which is below no limit.
    [seen, alone].map(|errors| if errors.is_empty() { f64::NAN } else { median(errors) })
}
