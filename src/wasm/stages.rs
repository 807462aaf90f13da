//! The exported functions. Their types are in `types.d.ts`.

use js_sys::Object;
use wasm_bindgen::prelude::*;

use super::convert::{get, set, size_from_js};
use super::observer::JsObserver;
use super::{inputs, options, results};
use crate::geometry::{self, Frame};
use crate::observer::Observer;
use crate::pipeline::{self, check_input_sizes};
use crate::warp::View;
use crate::{Image, InverseDepth, Result, Stage};
use crate::{metrics, mosaic, warp};

#[wasm_bindgen(start)]
fn start() {
    console_error_panic_hook::set_once();
}

#[wasm_bindgen]
extern "C" {
    /// `ImageInput`.
    #[wasm_bindgen(typescript_type = "ImageInput")]
    pub type ImageInput;
    /// `Options`, each optional.
    #[wasm_bindgen(typescript_type = "Partial<Options> | undefined")]
    pub type PartialOptions;
    /// `Options`.
    #[wasm_bindgen(typescript_type = "Options")]
    pub type FullOptions;
    /// Progress callback.
    #[wasm_bindgen(typescript_type = "((stage: Stage, fraction: number) => boolean | void) | undefined")]
    pub type OnProgress;
    /// What `stitch` takes besides the photos.
    #[wasm_bindgen(typescript_type = "StitchInputs")]
    pub type StitchInputs;
    /// What `estimate` takes.
    #[wasm_bindgen(typescript_type = "EstimateInputs")]
    pub type EstimateInputs;
    /// Both models.
    #[wasm_bindgen(typescript_type = "Models")]
    pub type Models;
    /// Both depth maps.
    #[wasm_bindgen(typescript_type = "Depths")]
    pub type Depths;
    /// `Geometry`.
    #[wasm_bindgen(typescript_type = "Geometry")]
    pub type Geometry;
    /// `Warped`.
    #[wasm_bindgen(typescript_type = "Warped")]
    pub type WarpedObject;
    /// `Mosaic`.
    #[wasm_bindgen(typescript_type = "Mosaic")]
    pub type MosaicObject;
    /// `Mask`.
    #[wasm_bindgen(typescript_type = "Mask")]
    pub type MaskObject;
    /// `ImageOutput`.
    #[wasm_bindgen(typescript_type = "ImageOutput")]
    pub type ImageOutput;
    /// `Quality`.
    #[wasm_bindgen(typescript_type = "Quality")]
    pub type QualityObject;
    /// `StitchResult`.
    #[wasm_bindgen(typescript_type = "StitchResult")]
    pub type StitchResult;
}

/// The package's version.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// Every option with its default.
#[wasm_bindgen(js_name = defaultOptions)]
pub fn default_options() -> FullOptions {
    options::to_js(Default::default()).unchecked_into()
}

/// Bytes of wasm memory. It never shrinks, so this is the peak.
#[wasm_bindgen(js_name = peakMemory)]
pub fn peak_memory() -> f64 {
    const PAGE: f64 = 65536.0;
    core::arch::wasm32::memory_size::<0>() as f64 * PAGE
}

/// The whole way.
#[wasm_bindgen]
pub fn stitch(
    target: &ImageInput,
    reference: &ImageInput,
    inputs: &StitchInputs,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<StitchResult, JsValue> {
    observed(on_progress, |observer| {
        let start = observer.now();
        observer.progress(Stage::Input, 0.0);
        let options = options::from_js(options)?;
        let photos = Photos::read(target, reference, inputs, options.warp.max_bytes)?;
        let matches = inputs::matches(&get(inputs, "matches"))?;
        let input_time = observer.now() - start;
        let done = pipeline::stitch(&matches, photos.target(), photos.reference(), &options, observer)?;
        let result = JsValue::from(Object::new());
        results::add_geometry(&result, &done.geometry, &done.warnings);
        results::add_warped(&result, &done.warped);
        results::add_mosaic(&result, &done.mosaic);
        let mut times = vec![(Stage::Input, input_time)];
        times.extend(done.times);
        set(&result, "quality", &results::quality(&done.quality));
        set(&result, "times", &results::times(&times));
        Ok(result)
    })
}

/// Robust fit and refinement alone.
#[wasm_bindgen]
pub fn estimate(
    inputs: &EstimateInputs,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<Geometry, JsValue> {
    observed(on_progress, |observer| {
        let options = options::from_js(options)?;
        let target_size = size_from_js("targetSize", &get(inputs, "targetSize"))?;
        let reference_size = size_from_js("referenceSize", &get(inputs, "referenceSize"))?;
        check_input_sizes(target_size, reference_size, options.warp.max_bytes)?;
        let matches = inputs::matches(&get(inputs, "matches"))?;
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
    observed(on_progress, |observer| {
        let options = options::from_js(options)?.warp;
        let photos = Photos::read(target, reference, depths, options.max_bytes)?;
        let forward = inputs::model("forward", &get(models, "forward"))?;
        let reverse = inputs::model("reverse", &get(models, "reverse"))?;
        let warped = warp::warp(photos.target(), photos.reference(), &forward, &reverse, &options, observer)?;
        let result = JsValue::from(Object::new());
        results::add_warped(&result, &warped);
        Ok(result)
    })
}

/// Blending alone.
#[wasm_bindgen]
pub fn blend(warped: &WarpedObject, reference: &ImageInput) -> std::result::Result<MosaicObject, JsValue> {
    observed(&JsValue::UNDEFINED, |observer| {
        observer.progress(Stage::Blend, 0.0);
        let warped = inputs::warped(warped)?;
        let reference = inputs::image("reference", reference)?;
        let result = JsValue::from(Object::new());
        results::add_mosaic(&result, &mosaic::blend(&warped, reference.view())?);
        Ok(result)
    })
}

/// Filling alone. `options.fill` plays no part: to call is to ask for it.
#[wasm_bindgen]
pub fn fill(
    mosaic: &ImageInput,
    void_mask: &MaskObject,
    options: &PartialOptions,
    on_progress: &OnProgress,
) -> std::result::Result<ImageOutput, JsValue> {
    observed(on_progress, |observer| {
        observer.progress(Stage::Fill, 0.0);
        let options = options::from_js(options)?.fill.unwrap_or_default();
        let mut image = inputs::image("mosaic", mosaic)?;
        let voids = inputs::mask("voidMask", void_mask)?;
        mosaic::fill(&mut image, &voids, &options, observer)?;
        Ok(results::image(&image))
    })
}

/// PSNR, SSIM and coverage alone.
#[wasm_bindgen]
pub fn measure(warped: &WarpedObject, reference: &ImageInput) -> std::result::Result<QualityObject, JsValue> {
    observed(&JsValue::UNDEFINED, |observer| {
        observer.progress(Stage::Measure, 0.0);
        let warped = inputs::warped(warped)?;
        let reference = inputs::image("reference", reference)?;
        Ok(results::quality(&metrics::quality(&warped, reference.view())?))
    })
}

/// Runs `f` and turns its error into a JavaScript one that names the stage it came from.
fn observed<T: JsCast>(
    on_progress: &JsValue,
    f: impl FnOnce(&mut JsObserver) -> Result<JsValue>,
) -> std::result::Result<T, JsValue> {
    let mut observer = JsObserver::new(on_progress);
    f(&mut observer).map(JsCast::unchecked_into).map_err(|error| observer.error(&error))
}

/// Both photos and their depth, owned for the length of a call.
struct Photos {
    target: Image,
    reference: Image,
    target_depth: Option<InverseDepth>,
    reference_depth: Option<InverseDepth>,
}

impl Photos {
    fn read(target: &JsValue, reference: &JsValue, depths: &JsValue, max_bytes: u64) -> Result<Self> {
        let target_size = size_from_js("target", target)?;
        let reference_size = size_from_js("reference", reference)?;
        check_input_sizes(target_size, reference_size, max_bytes)?;
        Ok(Self {
            target: inputs::image("target", target)?,
            reference: inputs::image("reference", reference)?,
            target_depth: inputs::depth("targetDepth", &get(depths, "targetDepth"), target_size)?,
            reference_depth: inputs::depth("referenceDepth", &get(depths, "referenceDepth"), reference_size)?,
        })
    }

    fn target(&self) -> View<'_> {
        View { image: self.target.view(), depth: self.target_depth.as_ref() }
    }

    fn reference(&self) -> View<'_> {
        View { image: self.reference.view(), depth: self.reference_depth.as_ref() }
    }
}
