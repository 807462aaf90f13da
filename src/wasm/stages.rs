//! The exported functions. Their types are in `types.d.ts`.

use std::borrow::Cow;

use js_sys::Object;
use wasm_bindgen::prelude::*;

use super::convert::{get, put, size_from_js};
use super::observer::JsObserver;
use super::photos::{Photos, single_photo};
use super::results::Outputs;
use super::running::Running;
use super::signatures::*;
use super::{inputs, matches, options, results};
use crate::geometry::{self, Frame};
use crate::observer::{Observer, report};
use crate::pipeline::{self, DepthSink, Job, Memory, check_inputs};
use crate::warp::WarpOptions;
use crate::{InverseDepth, Result, Stage};
use crate::{features, metrics, mosaic, warp};

/// The package's version.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// Every option with its default in a mode.
#[wasm_bindgen(js_name = defaultOptions)]
pub fn default_options(mode: &ModeName) -> std::result::Result<FullOptions, JsValue> {
    observed(Stage::Input, &JsValue::UNDEFINED, &mut |_| options::defaults(mode)).map(JsCast::unchecked_into)
}

/// Bytes of wasm memory. It never shrinks, so this is the peak.
#[wasm_bindgen(js_name = peakMemory)]
pub fn peak_memory() -> f64 {
    const PAGE: f64 = 65536.0;
    core::arch::wasm32::memory_size::<0>() as f64 * PAGE
}

/// The whole pipeline, which gives a `StitchResult`. `workers` may take tasks of it.
#[wasm_bindgen]
pub fn stitch(
    target: ImageInput,
    reference: ImageInput,
    inputs: StitchInputs,
    options: PartialOptions,
    on_progress: &OnProgress,
    workers: &OtherWorkers,
) -> Running {
    Running::new(on_progress, workers, async move |observer, workers| {
        let start = observer.now();
        observer.progress(Stage::Input, 0.0);
        let options = options::from_js(&options)?;
        let check = |job: Job| workers.check(&Memory::of(job, &options), job.photos[1]);
        let photos = Photos::read(&target, &reference, &inputs, &check)?;
        let matches = matches::optional(&inputs)?;
        let input_time = observer.now() - start;
        let result = JsValue::from(Object::new());
        let mut put_depth = |side: usize, map: Cow<'_, InverseDepth>| results::put_depth(&result, side, &map);
        let take: Option<&mut DepthSink<'_>> =
            if get(&inputs, "outputDepth").is_truthy() { Some(&mut put_depth) } else { None };
        let views = [photos.target(), photos.reference()];
        let done = pipeline::stitch_with_workers(matches.as_deref(), views, &options, take, workers, observer).await?;
        results::add_geometry(&result, &done.geometry, &done.warnings);
        let outputs = Outputs::of(&inputs);
        results::add_warped(&result, &done.warped, &outputs);
        results::add_mosaic(&result, &done.mosaic, &outputs);
        put(&result, "projection", results::projection(done.projection));
        if let Some(reference) = &done.projected_reference {
            outputs.image(&result, "projectedReference", reference);
        }
        put(&result, "crop", results::crops(&done.crops));
        let mut times = vec![(Stage::Input, input_time)];
        times.extend(done.times);
        put(&result, "matches", results::matches(done.matches.as_deref().or(matches.as_deref()).unwrap_or_default()));
        put(&result, "quality", results::quality(&done.quality));
        put(&result, "times", results::times(&times));
        Ok(result)
    })
}

/// Features of one photo.
#[wasm_bindgen]
pub fn detect(
    image: &ImageInput,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<FeaturesObject, JsValue> {
    observed(Stage::Input, on_progress, &mut |observer| {
        let options = options::from_js(options)?;
        let image = single_photo("image", image, options.warp.max_bytes)?;
        let features = features::detect(image.view(), &options.features.detect, observer)?;
        Ok(results::features(&features))
    })
    .map(JsCast::unchecked_into)
}

/// Matching of features alone.
#[wasm_bindgen(js_name = match)]
pub fn match_features(
    target: &FeaturesObject,
    reference: &FeaturesObject,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<MatchesObject, JsValue> {
    observed(Stage::Input, on_progress, &mut |observer| {
        let options = options::from_js(options)?.features.matching;
        let (target, reference) = (matches::features("target", target)?, matches::features("reference", reference)?);
        let pairs = features::match_features(&target, &reference, &options, observer)?;
        let result = JsValue::from(Object::new());
        results::add_matches(&result, &features::matches_of(&target, &reference, &pairs), &pairs);
        Ok(result)
    })
    .map(JsCast::unchecked_into)
}

/// Features of both photos, and their matches.
#[wasm_bindgen(js_name = matchImages)]
pub fn match_images(
    target: &ImageInput,
    reference: &ImageInput,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<ImageMatches, JsValue> {
    observed(Stage::Input, on_progress, &mut |observer| {
        let options = options::from_js(options)?;
        let read = |name, image| single_photo(name, image, options.warp.max_bytes);
        let photos = [read("target", target)?, read("reference", reference)?];
        let photos = [photos[0].view(), photos[1].view()];
        let features = pipeline::detect_pair(photos, &options.features.detect, observer)?;
        let found = pipeline::match_pair(features, &options.features.matching, observer)?;
        let result = JsValue::from(Object::new());
        results::add_matches(&result, &found.matches, &found.pairs);
        put(&result, "target", results::features(&found.features[0]));
        put(&result, "reference", results::features(&found.features[1]));
        Ok(result)
    })
    .map(JsCast::unchecked_into)
}

/// Robust fit and refinement alone.
#[wasm_bindgen]
pub fn estimate(
    inputs: &EstimateInputs,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<Geometry, JsValue> {
    observed(Stage::Input, on_progress, &mut |observer| {
        let options = options::from_js(options)?;
        let target_size = size_from_js("targetSize", &get(inputs, "targetSize"))?;
        let reference_size = size_from_js("referenceSize", &get(inputs, "referenceSize"))?;
        check_inputs([target_size, reference_size], options.warp.max_bytes)?;
        let matches = matches::required(&get(inputs, "matches"))?;
        let target_depth = inputs::depth("targetDepth", &get(inputs, "targetDepth"), target_size)?;
        let reference_depth = inputs::depth("referenceDepth", &get(inputs, "referenceDepth"), reference_size)?;
        let geometry = geometry::estimate(
            &matches,
            Frame { size: target_size, depth: target_depth.as_ref() },
            Frame { size: reference_size, depth: reference_depth.as_ref() },
            &options.estimate,
            observer,
        )?;
        let result = JsValue::from(Object::new());
        results::add_geometry(&result, &geometry, &geometry.warnings);
        Ok(result)
    })
    .map(JsCast::unchecked_into)
}

/// The first half of the pipeline, which gives an `Alignment`. `workers` may take tasks of it.
#[wasm_bindgen]
pub fn align(
    target: ImageInput,
    reference: ImageInput,
    inputs: StitchInputs,
    options: PartialOptions,
    on_progress: &OnProgress,
    workers: &OtherWorkers,
) -> Running {
    Running::new(on_progress, workers, async move |observer, workers| {
        let options = options::from_js(&options)?;
        let check = |job: Job| workers.check(&Memory::of(job, &options), (0, 0));
        let photos = Photos::read(&target, &reference, &inputs, &check)?;
        let given = matches::optional(&inputs)?;
        let views = [photos.target(), photos.reference()];
        let alignment = pipeline::align_with_workers(given.as_deref(), views, &options, workers, observer).await?;
        let result = JsValue::from(Object::new());
        results::add_geometry(&result, &alignment.geometry, &alignment.geometry.warnings);
        let matches = alignment.matches.as_deref().or(given.as_deref());
        put(&result, "matches", results::matches(matches.unwrap_or_default()));
        for (side, map) in alignment.depth.iter().enumerate() {
            map.iter().for_each(|map| results::put_depth(&result, side, map));
        }
        let void_distance = alignment.void_distance(photos.target().image, options.warp.void_distance);
        put(&result, "voidDistance", void_distance.into());
        put(&result, "reliable", alignment.reliable.as_ref().map_or(JsValue::NULL, results::mask));
        Ok(result)
    })
}

/// Rendering alone.
#[wasm_bindgen]
pub fn warp(
    target: &ImageInput,
    reference: &ImageInput,
    models: &Models,
    depths: &Depths,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<WarpedObject, JsValue> {
    observed(Stage::Input, on_progress, &mut |observer| {
        // The result has no place for the warped depth.
        let options = WarpOptions { depth: false, ..options::from_js(options)?.warp };
        let photos = Photos::read(target, reference, depths, &|job| check_inputs(job.photos, options.max_bytes))?;
        let forward = inputs::model("forward", &get(models, "forward"))?;
        let reverse = inputs::model("reverse", &get(models, "reverse"))?;
        let warped = warp::warp(photos.target(), photos.reference(), &forward, &reverse, &options, observer)?;
        let result = JsValue::from(Object::new());
        results::add_warped(&result, &warped, &Outputs::ALL);
        Ok(result)
    })
    .map(JsCast::unchecked_into)
}

/// Blending alone.
#[wasm_bindgen]
pub fn blend(
    warped: &WarpedObject,
    reference: &ImageInput,
    inputs: &BlendInputs,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<MosaicObject, JsValue> {
    observed(Stage::Blend, on_progress, &mut |observer| {
        observer.progress(Stage::Blend, 0.0);
        let options = options::from_js(options)?.blend;
        let warped = inputs::warped(warped)?;
        let reference = inputs::image("reference", reference)?;
        let reliable = Some(get(inputs, "reliable")).filter(|mask| mask.is_truthy());
        let reliable = reliable.map(|mask| inputs::mask("reliable", &mask)).transpose()?;
        let guide = mosaic::SeamGuide { reliable: reliable.as_ref(), matches: &[] };
        let mosaic = mosaic::blend(&warped, reference.view(), &guide, &options, observer)?;
        let result = JsValue::from(Object::new());
        results::add_mosaic(&result, &mosaic, &Outputs::ALL);
        Ok(result)
    })
    .map(JsCast::unchecked_into)
}

/// Filling alone. `options.fill` plays no part: to call is to ask for it.
#[wasm_bindgen]
pub fn fill(
    mosaic: &ImageInput,
    void_mask: &MaskObject,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<ImageOutput, JsValue> {
    observed(Stage::Fill, on_progress, &mut |observer| {
        observer.progress(Stage::Fill, 0.0);
        let options = options::from_js(options)?.fill.unwrap_or_default();
        let mut image = inputs::image("mosaic", mosaic)?;
        let voids = inputs::mask("voidMask", void_mask)?;
        mosaic::fill(&mut image, &voids, None, &options, observer)?;
        Ok(results::image(&image))
    })
    .map(JsCast::unchecked_into)
}

/// PSNR, SSIM and coverage alone.
#[wasm_bindgen]
pub fn measure(
    warped: &WarpedObject,
    reference: &ImageInput,
    #[wasm_bindgen(unchecked_param_type = "readonly number[] | undefined")] gains: &JsValue,
    on_progress: &OnProgress,
) -> std::result::Result<QualityObject, JsValue> {
    observed(Stage::Measure, on_progress, &mut |observer| {
        report(observer, Stage::Measure, 0.0)?;
        let warped = inputs::warped(warped)?;
        let reference = inputs::image("reference", reference)?;
        let quality = metrics::quality(&warped, reference.view(), gains_from_js(gains)?)?;
        report(observer, Stage::Measure, 1.0)?;
        Ok(results::quality(&quality))
    })
    .map(JsCast::unchecked_into)
}

/// Gains of red, green and blue; 1 where none are given.
fn gains_from_js(value: &JsValue) -> Result<[f64; 3]> {
    let Some(array) = value.dyn_ref::<js_sys::Array>() else { return Ok([1.0; 3]) };
    inputs::check_length("gains", array.length(), 3)?;
    Ok([0, 1, 2].map(|c| array.get(c).as_f64().unwrap_or(f64::NAN)))
}

/// Runs `f`, which starts with `stage`, and turns its error into a JavaScript one that names the stage it came from.
pub(super) fn observed<T>(
    stage: Stage,
    on_progress: &JsValue,
    f: &mut dyn FnMut(&mut JsObserver) -> Result<T>,
) -> std::result::Result<T, JsValue> {
    let mut observer = JsObserver::new(stage, on_progress);
    f(&mut observer).map_err(|error| observer.error(&error))
}
