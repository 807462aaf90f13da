//! The flat options object of JavaScript. Names, ranges and choices are those of `js/options.ts`; defaults are the core's.

use js_sys::Object;
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, invalid, put};
use super::specs::{self, Spec};
use crate::depth::Holes;
use crate::geometry::{Calibration, RobustFit, Threshold};
use crate::mosaic::{Blending, Exposure, FillMethod, FillOptions, Seam};
use crate::pipeline::{Mode, Options, WithoutDepth};
use crate::warp::{Projection, WarpMode};
use crate::{Error, Result};

/// Options from a JavaScript object. Absent and undefined ones have their defaults.
///
/// # Errors
/// `invalid-argument` for an unknown name or a value out of range.
pub(super) fn from_js(object: &JsValue) -> Result<Options> {
    let none = JsValue::from(Object::new());
    let object = if object.is_undefined() || object.is_null() { &none } else { object };
    let (options, all) = completed(object)?;
    let [known, keys] = [&all, object].map(|object| Object::keys(object.unchecked_ref::<Object>()));
    for key in (0..keys.length()).map(|i| keys.get(i)) {
        if !known.includes(&key, 0) {
            return Err(Error::UnknownOption { name: key.as_string().unwrap_or_default() }.into());
        }
    }
    Ok(options)
}

/// The defaults of a mode (`"default"` when undefined) as a JavaScript object.
///
/// # Errors
/// `invalid-argument` for an unknown mode.
pub(super) fn defaults(mode: &JsValue) -> Result<JsValue> {
    let given = JsValue::from(Object::new());
    put(&given, "mode", mode.clone());
    Ok(completed(&given)?.1)
}

/// The options that are `given` and the defaults of all others, for the core and as a JavaScript object.
fn completed(given: &JsValue) -> Result<(Options, JsValue)> {
    let mut reader = Reader { given, all: Object::new().into(), refused: None };
    let mut mode = Mode::default();
    reader.choice(&specs::MODE, &mut mode, &[Mode::Default, Mode::Paper]);
    let mut options = Options::of(mode);
    reader.visit(&mut options);
    match reader.refused {
        Some(error) => Err(error),
        None => Ok((options, reader.all)),
    }
}

/// Reads the options given, one by one.
struct Reader<'a> {
    given: &'a JsValue,
    /// The values given, and the defaults of all others.
    all: JsValue,
    /// The error of the first value out of range.
    refused: Option<Box<Error>>,
}

impl Reader<'_> {
    /// Every option, with its place in the core's options.
    fn visit(&mut self, options: &mut Options) {
        let detect = &mut options.features.detect;
        self.count(&specs::MATCH_SIZE, &mut detect.max_size);
        self.count(&specs::MAX_KEYPOINTS, &mut detect.max_keypoints);
        self.number(&specs::CONTRAST_THRESHOLD, &mut detect.contrast_threshold);
        self.number(&specs::EDGE_THRESHOLD, &mut detect.edge_threshold);
        self.flag(&specs::ADAPTIVE_CONTRAST, &mut detect.adaptive);
        self.flag(&specs::UPSAMPLE, &mut detect.upsample);
        self.flag(&specs::ROOT_SIFT, &mut detect.root);
        let matching = &mut options.features.matching;
        self.number(&specs::MATCH_RATIO, &mut matching.ratio);
        self.flag(&specs::MUTUAL, &mut matching.mutual);
        self.flag(&specs::GUIDED_MATCHING, &mut options.features.guided);

        let without_depth = [WithoutDepth::TwoView, WithoutDepth::Homography];
        self.choice(&specs::WITHOUT_DEPTH, &mut options.without_depth, &without_depth);
        let estimate = &mut options.estimate;
        self.choice(
            &specs::ROBUST_FIT,
            &mut estimate.robust_fit,
            &[RobustFit::Depth, RobustFit::Homography, RobustFit::MultiHomography],
        );
        self.threshold(&specs::THRESHOLD, &mut estimate.threshold);
        self.number(&specs::CONFIDENCE, &mut estimate.confidence);
        self.whole(&specs::MAX_TRIALS, &mut estimate.max_trials);
        self.whole(&specs::SEED, &mut estimate.seed);
        let calibration = [Calibration::Auto, Calibration::Always, Calibration::Off];
        self.choice(&specs::CALIBRATION, &mut estimate.calibration, &calibration);
        self.optional(&specs::FOCAL_LENGTH, &mut estimate.focal);

        let mut refined = options.refine.is_some();
        let mut refine = options.refine.take().unwrap_or_default();
        self.choice(&specs::REFINEMENT, &mut refined, &[true, false]);
        self.optional(&specs::REFINEMENT_RANGE, &mut refine.range);
        options.refine = refined.then_some(refine);

        let warp = &mut options.warp;
        self.choice(
            &specs::WARP_MODE,
            &mut warp.mode,
            &[WarpMode::Forward, WarpMode::Backward, WarpMode::BackwardVoid, WarpMode::Optimal, WarpMode::Soft],
        );
        self.whole(&specs::GRID_COLUMNS, &mut warp.grid.0);
        self.whole(&specs::GRID_ROWS, &mut warp.grid.1);
        self.choice(&specs::HOLES, &mut warp.holes, &[Holes::Nearest, Holes::Drop]);
        self.number(&specs::VOID_DISTANCE, &mut warp.void_distance);
        self.number(&specs::STRETCH_LIMIT, &mut warp.stretch_limit);
        self.number(&specs::CANVAS_LIMIT, &mut warp.canvas_limit);

        let projections = [None, Some(Projection::Plane), Some(Projection::Cylinder), Some(Projection::Sphere)];
        self.choice(&specs::PROJECTION, &mut options.projection, &projections);

        let blend = &mut options.blend;
        let exposure = [Exposure::Field, Exposure::Gain, Exposure::Off];
        self.choice(&specs::EXPOSURE, &mut blend.exposure, &exposure);
        self.choice(&specs::SEAM, &mut blend.seam, &[Seam::Aligned, Seam::Cut, Seam::Off]);
        let blending = [Blending::Multiband, Blending::Feather, Blending::Average];
        self.choice(&specs::BLENDING, &mut blend.blending, &blending);
        self.whole(&specs::FEATHER, &mut blend.feather);
        self.whole(&specs::BANDS, &mut blend.bands);

        let mut method = options.fill.as_ref().map(|fill| fill.method);
        let mut fill = options.fill.take().unwrap_or_default();
        let methods = [Some(FillMethod::Exemplar), Some(FillMethod::Smooth), None];
        self.choice(&specs::FILL, &mut method, &methods);
        self.whole(&specs::FILL_RADIUS, &mut fill.radius);
        self.number(&specs::FILL_MAX_WIDTH, &mut fill.max_width);
        options.fill = method.map(|method| FillOptions { method, ..fill });

        let mut bytes = warp.max_bytes as f64;
        self.number(&specs::MAX_BYTES, &mut bytes);
        warp.max_bytes = bytes as u64;
        options.features.detect.max_bytes = warp.max_bytes;
    }

    /// The value given; undefined if there is none.
    fn given(&self, spec: &Spec) -> JsValue {
        get(self.given, spec.name)
    }

    fn refuse(&mut self, spec: &Spec, given: &JsValue) {
        self.refused.get_or_insert_with(|| invalid(spec.name, spec.expected, given));
    }

    /// A number within the range of the option.
    fn number(&mut self, spec: &Spec, value: &mut f64) {
        let given = self.given(spec);
        match given.as_f64() {
            Some(number) if spec.min <= number && number <= spec.max => *value = number,
            _ if given.is_undefined() => {}
            _ => self.refuse(spec, &given),
        }
        put(&self.all, spec.name, (*value).into());
    }

    /// A number where 0 stands for none.
    fn optional(&mut self, spec: &Spec, value: &mut Option<f64>) {
        let mut number = value.unwrap_or(0.0);
        self.number(spec, &mut number);
        *value = Some(number).filter(|number| *number > 0.0);
    }

    fn whole(&mut self, spec: &Spec, value: &mut u32) {
        let mut number = f64::from(*value);
        self.number(spec, &mut number);
        if number.floor() != number {
            self.refuse(spec, &number.into());
        }
        *value = number as u32;
    }

    fn count(&mut self, spec: &Spec, value: &mut usize) {
        let mut number = *value as u32;
        self.whole(spec, &mut number);
        *value = number as usize;
    }

    fn flag(&mut self, spec: &Spec, value: &mut bool) {
        let given = self.given(spec);
        match given.as_bool() {
            Some(flag) => *value = flag,
            None if given.is_undefined() => {}
            None => self.refuse(spec, &given),
        }
        put(&self.all, spec.name, (*value).into());
    }

    /// One of `values`, which are in the order of the option's choices.
    fn choice<T: Copy + PartialEq>(&mut self, spec: &Spec, value: &mut T, values: &[T]) {
        let default = values.iter().position(|known| known == value).unwrap_or(0);
        if let Some(&chosen) = values.get(self.chosen(spec, default)) {
            *value = chosen;
        }
    }

    /// Which of the option's choices is given, or the default one.
    fn chosen(&mut self, spec: &Spec, default: usize) -> usize {
        let given = self.given(spec);
        let mut chosen = default;
        if !given.is_undefined() {
            let name = given.as_string();
            match spec.choices.iter().position(|choice| Some(*choice) == name.as_deref()) {
                Some(at) => chosen = at,
                None => self.refuse(spec, &given),
            }
        }
        put(&self.all, spec.name, spec.choices.get(chosen).copied().into());
        chosen
    }

    fn threshold(&mut self, spec: &Spec, value: &mut Threshold) {
        let paper = JsValue::from_str("paper");
        if self.given(spec) == paper {
            *value = Threshold::PAPER;
        } else {
            let mut pixels = match *value {
                Threshold::Pixels(pixels) => pixels,
                Threshold::Normalised(_) => 0.0,
            };
            self.number(spec, &mut pixels);
            if pixels > 0.0 {
                *value = Threshold::Pixels(pixels);
            }
        }
        if let Threshold::Normalised(_) = value {
            put(&self.all, spec.name, paper);
        }
    }
}
