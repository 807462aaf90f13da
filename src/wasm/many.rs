//! `stitchMany`: photos in, one picture and what became of every photo out.

use js_sys::{Array, Float64Array, Object};
use nalgebra::{Matrix3, Vector3};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::*;

use super::convert::{get, invalid, put, size_from_js, whole};
use super::running::Running;
use super::signatures::{ManyInputs, OnProgress, OtherWorkers, PartialOptions, PhotoInputs};
use super::workers::JsWorkers;
use super::{inputs, options, results};
use crate::geometry::{Camera, MultiViewKind};
use crate::observer::Observer;
use crate::pipeline::many::{self, ManyOptions, Photo, PhotoReport, StitchedMany};
use crate::{Error, Image, InverseDepth, Result, Stage};

/// Any number of photos, which give a `StitchManyResult`. `workers` may take tasks of it.
#[wasm_bindgen(js_name = stitchMany)]
pub fn stitch_many(
    photos: PhotoInputs,
    inputs: ManyInputs,
    options: PartialOptions,
    on_progress: &OnProgress,
    workers: &OtherWorkers,
) -> Running {
    Running::new(on_progress, workers, async move |observer, workers| {
        let start = observer.now();
        observer.progress(Stage::Input, 0.0);
        let options = many_options(&inputs, &options)?;
        let owned = Photos::read(&photos, &options, workers)?;
        let input_time = observer.now() - start;
        let done = many::stitch_many_with_workers(&owned.photos(), &options, workers, observer).await?;
        drop(owned);
        Ok(result(&done, input_time))
    })
}

/// Something of every photo; an error says of which.
fn each<T>(photos: &Array, read: impl Fn(&JsValue) -> Result<T>) -> Result<Vec<T>> {
    photos.iter().enumerate().map(|(i, photo)| read(&photo).map_err(Error::of_photo(i))).collect()
}

fn many_options(given: &JsValue, stages: &JsValue) -> Result<ManyOptions> {
    let reference = Some(get(given, "reference")).filter(inputs::is_given);
    let reference = reference.map(|index| whole(&index, 0.0, "reference", "the index of a photo")).transpose()?;
    let distortion = Some(get(given, "distortion")).filter(inputs::is_given);
    let distortion =
        distortion.map(|known| known.as_f64().ok_or_else(|| invalid("distortion", "a number", &known))).transpose()?;
    let mut options = ManyOptions { stages: options::from_js(stages)?, reference, distortion };
    options.stages.output_depth = get(given, "outputDepth").is_truthy();
    Ok(options)
}

/// The photos, owned by the core for the length of the call.
struct Photos {
    images: Vec<Image>,
    focals: Vec<Option<f64>>,
    cameras: Vec<Option<Camera>>,
    depths: Vec<Option<InverseDepth>>,
}

impl Photos {
    /// Copies the photos, unless they are too many, too few, or too large.
    fn read(photos: &JsValue, options: &ManyOptions, workers: &JsWorkers) -> Result<Self> {
        let Some(photos) = photos.dyn_ref::<Array>() else {
            return Err(invalid("photos", "an array of images", photos));
        };
        many::check_count(photos.length() as usize)?;
        let size = |photo: &JsValue| size_from_js("photo", photo);
        let sizes = each(photos, size)?;
        workers.limit(many::check_sizes(&sizes, options)?.times());
        let focal = |photo: &JsValue| {
            let given = get(photo, "focalLength");
            let expected = "a positive number";
            match given.as_f64() {
                None if inputs::is_given(&given) => Err(invalid("focalLength", expected, &given)),
                focal => Ok(focal),
            }
        };
        Ok(Self {
            cameras: each(photos, |photo| given_camera(&get(photo, "camera")))?,
            depths: each(photos, |photo| inputs::depth("depth", &get(photo, "depth"), size(photo)?))?,
            images: each(photos, |photo| inputs::image("photo", photo))?,
            focals: each(photos, focal)?,
        })
    }

    fn photos(&self) -> Vec<Photo<'_>> {
        let mut photos: Vec<Photo<'_>> = self.images.iter().map(|image| Photo::new(image.view())).collect();
        for (i, photo) in photos.iter_mut().enumerate() {
            (photo.focal, photo.camera, photo.depth) = (self.focals[i], self.cameras[i], self.depths[i].as_ref());
        }
        photos
    }
}

/// A `StitchManyResult`.
fn result(done: &StitchedMany, input_time: f64) -> JsValue {
    let result = Object::new().into();
    put(&result, "mosaic", results::image(&done.image));
    put(&result, "labels", results::mask(&done.labels));
    put(&result, "voidMask", results::mask(&done.voids));
    let offset = [("x", done.offset.0 as f64), ("y", done.offset.1 as f64)];
    put(&result, "offset", results::numbers(&offset));
    put(&result, "scale", done.scale.into());
    put(&result, "reference", (done.reference as f64).into());
    let geometry = match done.geometry {
        MultiViewKind::Cameras => "cameras",
        MultiViewKind::Rotations => "rotations",
        MultiViewKind::Homographies => "homographies",
    };
    put(&result, "geometry", geometry.into());
    put(&result, "distortion", done.distortion.into());
    put(&result, "projection", results::projection(done.projection));
    put(&result, "photos", done.photos.iter().map(photo).collect::<Array>().into());
    let pairs = done.pairs.iter().map(|pair| {
        let object = results::numbers(&[("matches", pair.matches as f64), ("inliers", pair.inliers as f64)]);
        put(&object, "photos", results::list(&pair.photos.map(|photo| photo as f64)));
        put(&object, "linked", pair.linked.into());
        object
    });
    put(&result, "pairs", pairs.collect::<Array>().into());
    put(&result, "crop", results::crops(&done.crops));
    put(&result, "warnings", results::warnings(&done.warnings));
    let mut times = vec![(Stage::Input, input_time)];
    times.extend_from_slice(&done.times);
    put(&result, "times", results::times(&times));
    result
}

/// A `PhotoReport`.
fn photo(report: &PhotoReport) -> JsValue {
    let object = Object::new().into();
    let number = |value: Option<f64>| value.map_or(JsValue::NULL, JsValue::from);
    put(&object, "used", (report.code == many::PhotoCode::Used).into());
    put(&object, "code", report.code.code().into());
    put(&object, "camera", report.camera.as_ref().map_or(JsValue::NULL, camera));
    put(&object, "focalLength", number(report.focal));
    put(&object, "error", number(report.error));
    put(&object, "gains", results::list(&report.gains));
    let rectangle = |[x, y, width, height]: [i64; 4]| {
        let sides = [("x", x), ("y", y), ("width", width), ("height", height)];
        results::numbers(&sides.map(|(name, side)| (name, side as f64)))
    };
    put(&object, "extent", report.extent.map_or(JsValue::NULL, rectangle));
    if let Some(map) = &report.map {
        put(&object, "forward", results::model(&map.forward));
        put(&object, "reverse", results::model(&map.reverse));
        if let Some(depth) = &map.depth {
            put(&object, "inverseDepth", results::depth(depth));
        }
        if let Some(image) = &map.undistorted {
            put(&object, "undistorted", results::image(image));
        }
    }
    object
}

/// A camera as results have it; `None` where there is none.
fn given_camera(value: &JsValue) -> Result<Option<Camera>> {
    if !inputs::is_given(value) {
        return Ok(None);
    }
    let (mut rotation, mut translation) = ([0.0; 9], [0.0; 3]);
    inputs::numbers("camera", value, "rotation", &mut rotation)?;
    inputs::numbers("camera", value, "translation", &mut translation)?;
    Ok(Some(Camera { rotation: Matrix3::from_row_slice(&rotation), translation: Vector3::from(translation) }))
}

fn camera(camera: &Camera) -> JsValue {
    let object = Object::new().into();
    // The matrix is stored column by column.
    put(&object, "rotation", Float64Array::from(camera.rotation.transpose().as_slice()).into());
    put(&object, "translation", Float64Array::from(camera.translation.as_slice()).into());
    object
}
