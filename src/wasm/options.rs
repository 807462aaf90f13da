//! The flat options object of JavaScript. One table serves reading and writing, so names and defaults cannot drift.

use js_sys::Object;
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, put};
use crate::depth::Holes;
use crate::geometry::{Calibration, RobustFit, Threshold};
use crate::mosaic::{Blending, Exposure, FillMethod, FillOptions, Seam};
use crate::pipeline::{Mode, Options, WithoutDepth};
use crate::warp::WarpMode;
use crate::{Error, Result};

/// Options from a JavaScript object; what is absent or undefined keeps its default.
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
    let mut table = Table { given, all: Object::new().into(), refused: None };
    let mut mode = Mode::default();
    table.choice("mode", "'default' or 'paper'", &mut mode, &[Mode::Default, Mode::Paper]);
    let mut options = Options::of(mode);
    table.visit(&mut options);
    match table.refused {
        Some(error) => Err(error),
        None => Ok((options, table.all)),
    }
}

/// The smallest number above 0, and the largest below 1.
const ABOVE_ZERO: f64 = f64::from_bits(1);
const BELOW_ONE: f64 = 1.0f64.next_down();

struct Table<'a> {
    given: &'a JsValue,
    /// What was read, and the defaults of what was not given.
    all: JsValue,
    /// The first value that was.
    refused: Option<Box<Error>>,
}

impl Table<'_> {
    /// The table: every option's name, place and range.
    fn visit(&mut self, options: &mut Options) {
        let detect = &mut options.features.detect;
        self.count("matchSize", "a whole number from 0 to 65535", &[0.0, 65535.0], &mut detect.max_size);
        self.count("maxKeypoints", "a whole number from 1 to 100000", &[1.0, 1e5], &mut detect.max_keypoints);
        self.number("contrastThreshold", "a number from 0 to 1", &[0.0, 1.0], &mut detect.contrast_threshold);
        self.number("edgeThreshold", "a number of at least 1", &[1.0, f64::MAX], &mut detect.edge_threshold);
        self.flag("adaptiveContrast", &mut detect.adaptive);
        self.flag("upsample", &mut detect.upsample);
        self.flag("rootSift", &mut detect.root);
        let matching = &mut options.features.matching;
        self.number("matchRatio", "above 0, at most 1", &[ABOVE_ZERO, 1.0], &mut matching.ratio);
        self.flag("mutual", &mut matching.mutual);
        self.flag("guidedMatching", &mut options.features.guided);

        let without_depth = [WithoutDepth::TwoView, WithoutDepth::Homography];
        self.choice("withoutDepth", "'two-view' or 'homography'", &mut options.without_depth, &without_depth);
        let estimate = &mut options.estimate;
        self.choice(
            "robustFit",
            "'depth', 'homography' or 'multi-homography'",
            &mut estimate.robust_fit,
            &[RobustFit::Depth, RobustFit::Homography, RobustFit::MultiHomography],
        );
        self.threshold("threshold", "a number of pixels above 0, or 'paper'", &mut estimate.threshold);
        self.number("confidence", "between 0 and 1", &[ABOVE_ZERO, BELOW_ONE], &mut estimate.confidence);
        self.whole("maxTrials", "a whole number from 1 to 1000000", &[1.0, 1e6], &mut estimate.max_trials);
        self.whole("seed", "a whole number from 0 to 4294967295", &[0.0, 4_294_967_295.0], &mut estimate.seed);
        let calibration = [Calibration::Auto, Calibration::Always, Calibration::Off];
        self.choice("calibration", "'auto', 'always' or 'off'", &mut estimate.calibration, &calibration);
        self.optional("focalLength", "a number of at least 0", &mut estimate.focal);

        let mut refined = options.refine.is_some();
        let mut refine = options.refine.take().unwrap_or_default();
        self.choice("refinement", "'epipolar' or 'none'", &mut refined, &[true, false]);
        self.optional("refinementRange", "a number of at least 0", &mut refine.range);
        options.refine = refined.then_some(refine);

        let warp = &mut options.warp;
        self.choice(
            "warpMode",
            "'forward', 'backward', 'backward+void' or 'optimal'",
            &mut warp.mode,
            &[WarpMode::Forward, WarpMode::Backward, WarpMode::BackwardVoid, WarpMode::Optimal],
        );
        self.whole("gridColumns", "a whole number from 0 to 65535", &[0.0, 65535.0], &mut warp.grid.0);
        self.whole("gridRows", "a whole number from 0 to 65535", &[0.0, 65535.0], &mut warp.grid.1);
        self.choice("holes", "'nearest' or 'drop'", &mut warp.holes, &[Holes::Nearest, Holes::Drop]);
        self.number("voidDistance", "a number above 0", &[ABOVE_ZERO, f64::MAX], &mut warp.void_distance);
        self.number("stretchLimit", "a number above 0", &[ABOVE_ZERO, f64::MAX], &mut warp.stretch_limit);
        self.number("canvasLimit", "a number from 0 to 100", &[0.0, 100.0], &mut warp.canvas_limit);

        let blend = &mut options.blend;
        let exposure = [Exposure::Field, Exposure::Gain, Exposure::Off];
        self.choice("exposure", "'field', 'gain' or 'none'", &mut blend.exposure, &exposure);
        self.choice("seam", "'cut' or 'none'", &mut blend.seam, &[Seam::Cut, Seam::Off]);
        let blending = [Blending::Multiband, Blending::Feather, Blending::Average];
        self.choice("blending", "'multiband', 'feather' or 'average'", &mut blend.blending, &blending);
        self.whole("feather", "a whole number from 0 to 1000", &[0.0, 1000.0], &mut blend.feather);
        self.whole("bands", "a whole number from 0 to 10", &[0.0, 10.0], &mut blend.bands);

        let mut method = options.fill.as_ref().map(|fill| fill.method);
        let mut fill = options.fill.take().unwrap_or_default();
        let methods = [Some(FillMethod::Exemplar), Some(FillMethod::Smooth), None];
        self.choice("fill", "'exemplar', 'smooth' or 'none'", &mut method, &methods);
        self.whole("fillRadius", "a whole number from 1 to 64", &[1.0, 64.0], &mut fill.radius);
        self.number("fillMaxWidth", "a number from 0 to 100", &[0.0, 100.0], &mut fill.max_width);
        options.fill = method.map(|method| FillOptions { method, ..fill });

        let mut bytes = warp.max_bytes as f64;
        let expected = "a number from 1 to 4294967296, all that wasm can address";
        self.number("maxBytes", expected, &[1.0, 4_294_967_296.0], &mut bytes);
        warp.max_bytes = bytes as u64;
        options.features.detect.max_bytes = warp.max_bytes;
    }

    /// The value given, undefined where there is none.
    fn given(&self, name: &str) -> JsValue {
        get(self.given, name)
    }

    fn refuse(&mut self, name: &'static str, expected: &'static str, given: &JsValue) {
        let value = given.as_f64().unwrap_or(f64::NAN);
        self.refused.get_or_insert_with(|| Error::InvalidArgument { name, expected, value }.into());
    }

    /// A number from `range[0]` to `range[1]`.
    fn number(&mut self, name: &'static str, expected: &'static str, range: &[f64; 2], value: &mut f64) {
        let given = self.given(name);
        match given.as_f64() {
            Some(number) if range[0] <= number && number <= range[1] => *value = number,
            _ if given.is_undefined() => {}
            _ => self.refuse(name, expected, &given),
        }
        put(&self.all, name, (*value).into());
    }

    /// A number for which 0 says that there is none.
    fn optional(&mut self, name: &'static str, expected: &'static str, value: &mut Option<f64>) {
        let mut number = value.unwrap_or(0.0);
        self.number(name, expected, &[0.0, f64::MAX], &mut number);
        *value = Some(number).filter(|number| *number > 0.0);
    }

    fn whole(&mut self, name: &'static str, expected: &'static str, range: &[f64; 2], value: &mut u32) {
        let mut number = f64::from(*value);
        self.number(name, expected, range, &mut number);
        if number.floor() != number {
            self.refuse(name, expected, &number.into());
        }
        *value = number as u32;
    }

    fn count(&mut self, name: &'static str, expected: &'static str, range: &[f64; 2], value: &mut usize) {
        let mut number = *value as u32;
        self.whole(name, expected, range, &mut number);
        *value = number as usize;
    }

    fn flag(&mut self, name: &'static str, value: &mut bool) {
        let given = self.given(name);
        match given.as_bool() {
            Some(flag) => *value = flag,
            None if given.is_undefined() => {}
            None => self.refuse(name, "true or false", &given),
        }
        put(&self.all, name, (*value).into());
    }

    /// One of `values`, whose names are those that `expected` quotes.
    fn choice<T: Copy + PartialEq>(&mut self, name: &'static str, expected: &'static str, value: &mut T, values: &[T]) {
        let at = values.iter().position(|known| known == value).unwrap_or(0);
        if let Some(chosen) = values.get(self.chosen(name, expected, at)) {
            *value = *chosen;
        }
    }

    /// The place among the names that `expected` quotes of the one that is given, `default` where none is.
    fn chosen(&mut self, name: &'static str, expected: &'static str, default: usize) -> usize {
        let given = self.given(name);
        for (piece, known) in expected.split('\'').enumerate() {
            // Every other piece is between quotes.
            let (at, known) = (piece / 2, JsValue::from_str(known));
            if piece % 2 == 1 && (given == known || (given.is_undefined() && at == default)) {
                put(&self.all, name, known);
                return at;
            }
        }
        self.refuse(name, expected, &given);
        default
    }

    fn threshold(&mut self, name: &'static str, expected: &'static str, value: &mut Threshold) {
        let paper = JsValue::from_str("paper");
        if self.given(name) == paper {
            *value = Threshold::PAPER;
        } else {
            let mut pixels = match *value {
                Threshold::Pixels(pixels) => pixels,
                Threshold::Normalised(_) => 0.0,
            };
            self.number(name, expected, &[ABOVE_ZERO, f64::MAX], &mut pixels);
            if pixels > 0.0 {
                *value = Threshold::Pixels(pixels);
            }
        }
        if let Threshold::Normalised(_) = value {
            put(&self.all, name, paper);
        }
    }
}
