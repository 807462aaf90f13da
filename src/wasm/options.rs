//! The flat options object of JavaScript. One table serves reading and writing, so names and defaults cannot drift.

use js_sys::Object;
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, set};
use crate::geometry::{Calibration, RobustFit, Threshold};
use crate::mosaic::{Blending, Exposure, FillMethod, FillOptions, Seam};
use crate::pipeline::{Mode, Options, WithoutDepth};
use crate::warp::{Holes, WarpMode};
use crate::{Error, Result};

/// Options from a JavaScript object; what is absent or undefined keeps its default.
///
/// # Errors
/// `invalid-argument` for an unknown name or a value out of range.
pub(super) fn from_js(object: &JsValue) -> Result<Options> {
    if object.is_undefined() || object.is_null() {
        return Ok(Options::default());
    }
    let mut reader = Reader { object, known: Vec::new() };
    let mut mode = Mode::default();
    visit_mode(&mut mode, &mut reader)?;
    let mut options = Options::of(mode);
    visit(&mut options, &mut reader)?;
    let keys = Object::keys(object.unchecked_ref::<Object>());
    for key in keys.iter().filter_map(|key| key.as_string()) {
        if !reader.known.contains(&key.as_str()) {
            return Err(Error::UnknownOption { name: key }.into());
        }
    }
    Ok(options)
}

/// The defaults of a mode (`"default"` when undefined) as a JavaScript object.
///
/// # Errors
/// `invalid-argument` for an unknown mode.
pub(super) fn defaults(mode: &JsValue) -> Result<JsValue> {
    let given = Object::new();
    set(&given, "mode", mode);
    let mut mode = Mode::default();
    visit_mode(&mut mode, &mut Reader { object: &given, known: Vec::new() })?;
    let mut writer = Writer { object: Object::new() };
    visit_mode(&mut mode, &mut writer)?;
    visit(&mut Options::of(mode), &mut writer)?;
    Ok(writer.object.into())
}

fn visit_mode(mode: &mut Mode, v: &mut impl Visitor) -> Result<()> {
    v.choice("mode", "'default' or 'paper'", mode, &[("default", Mode::Default), ("paper", Mode::Paper)])
}

/// The table: every option's name, place and range.
fn visit(options: &mut Options, v: &mut impl Visitor) -> Result<()> {
    let detect = &mut options.features.detect;
    v.count("matchSize", "a whole number from 0 to 65535", &mut detect.max_size, 0, 65535)?;
    v.count("maxKeypoints", "a whole number from 1 to 100000", &mut detect.max_keypoints, 1, 100_000)?;
    v.number("contrastThreshold", "a number from 0 to 1", &mut detect.contrast_threshold, |x| {
        (0.0..=1.0).contains(&x)
    })?;
    v.number("edgeThreshold", "a number of at least 1", &mut detect.edge_threshold, |x| x.is_finite() && x >= 1.0)?;
    v.flag("adaptiveContrast", &mut detect.adaptive)?;
    v.flag("upsample", &mut detect.upsample)?;
    v.flag("rootSift", &mut detect.root)?;
    let matching = &mut options.features.matching;
    v.number("matchRatio", "above 0, at most 1", &mut matching.ratio, |x| x > 0.0 && x <= 1.0)?;
    v.flag("mutual", &mut matching.mutual)?;
    v.flag("guidedMatching", &mut options.features.guided)?;

    v.choice(
        "withoutDepth",
        "'two-view' or 'homography'",
        &mut options.without_depth,
        &[("two-view", WithoutDepth::TwoView), ("homography", WithoutDepth::Homography)],
    )?;
    let estimate = &mut options.estimate;
    v.choice(
        "robustFit",
        "'depth', 'homography' or 'multi-homography'",
        &mut estimate.robust_fit,
        &[
            ("depth", RobustFit::Depth),
            ("homography", RobustFit::Homography),
            ("multi-homography", RobustFit::MultiHomography),
        ],
    )?;
    v.threshold("threshold", &mut estimate.threshold)?;
    v.number("confidence", "between 0 and 1", &mut estimate.confidence, |c| c > 0.0 && c < 1.0)?;
    v.whole("maxTrials", "a whole number from 1 to 1000000", &mut estimate.max_trials, 1, 1_000_000)?;
    v.whole("seed", "a whole number from 0 to 4294967295", &mut estimate.seed, 0, u32::MAX)?;

    v.choice(
        "calibration",
        "'auto', 'always' or 'off'",
        &mut estimate.calibration,
        &[("auto", Calibration::Auto), ("always", Calibration::Always), ("off", Calibration::Off)],
    )?;
    v.optional("focalLength", "a number of at least 0", &mut estimate.focal)?;

    let mut refined = options.refine.is_some();
    let mut refine = options.refine.take().unwrap_or_default();
    v.choice("refinement", "'epipolar' or 'none'", &mut refined, &[("epipolar", true), ("none", false)])?;
    v.optional("refinementRange", "a number of at least 0", &mut refine.range)?;
    options.refine = refined.then_some(refine);

    let warp = &mut options.warp;
    v.choice(
        "warpMode",
        "'forward', 'backward', 'backward+void' or 'optimal'",
        &mut warp.mode,
        &[
            ("forward", WarpMode::Forward),
            ("backward", WarpMode::Backward),
            ("backward+void", WarpMode::BackwardVoid),
            ("optimal", WarpMode::Optimal),
        ],
    )?;
    v.whole("gridColumns", "a whole number from 0 to 65535", &mut warp.grid.0, 0, 65535)?;
    v.whole("gridRows", "a whole number from 0 to 65535", &mut warp.grid.1, 0, 65535)?;
    v.choice("holes", "'nearest' or 'drop'", &mut warp.holes, &[("nearest", Holes::Nearest), ("drop", Holes::Drop)])?;
    let positive = |x: f64| x.is_finite() && x > 0.0;
    v.number("voidDistance", "a number above 0", &mut warp.void_distance, positive)?;
    v.number("stretchLimit", "a number above 0", &mut warp.stretch_limit, positive)?;
    v.number("canvasLimit", "a number from 0 to 100", &mut warp.canvas_limit, |x| (0.0..=100.0).contains(&x))?;

    let blend = &mut options.blend;
    v.choice(
        "exposure",
        "'field', 'gain' or 'none'",
        &mut blend.exposure,
        &[("field", Exposure::Field), ("gain", Exposure::Gain), ("none", Exposure::Off)],
    )?;
    v.choice("seam", "'cut' or 'none'", &mut blend.seam, &[("cut", Seam::Cut), ("none", Seam::Off)])?;
    v.choice(
        "blending",
        "'multiband', 'feather' or 'average'",
        &mut blend.blending,
        &[("multiband", Blending::Multiband), ("feather", Blending::Feather), ("average", Blending::Average)],
    )?;
    v.whole("feather", "a whole number from 0 to 1000", &mut blend.feather, 0, 1000)?;
    v.whole("bands", "a whole number from 0 to 10", &mut blend.bands, 0, 10)?;

    let mut method = options.fill.as_ref().map(|fill| fill.method);
    let mut fill = options.fill.take().unwrap_or_default();
    v.choice(
        "fill",
        "'exemplar', 'smooth' or 'none'",
        &mut method,
        &[("exemplar", Some(FillMethod::Exemplar)), ("smooth", Some(FillMethod::Smooth)), ("none", None)],
    )?;
    v.whole("fillRadius", "a whole number from 1 to 64", &mut fill.radius, 1, 64)?;
    options.fill = method.map(|method| FillOptions { method, ..fill });

    let mut bytes = warp.max_bytes as f64;
    let addressable = |x: f64| (1.0..=4_294_967_296.0).contains(&x);
    v.number("maxBytes", "a number from 1 to 4294967296, all that wasm can address", &mut bytes, addressable)?;
    warp.max_bytes = bytes as u64;
    options.features.detect.max_bytes = warp.max_bytes;
    Ok(())
}

trait Visitor {
    fn number(
        &mut self,
        name: &'static str,
        expected: &'static str,
        value: &mut f64,
        ok: fn(f64) -> bool,
    ) -> Result<()>;
    fn choice<T: Copy + PartialEq>(
        &mut self,
        name: &'static str,
        expected: &'static str,
        value: &mut T,
        table: &[(&'static str, T)],
    ) -> Result<()>;
    fn flag(&mut self, name: &'static str, value: &mut bool) -> Result<()>;
    fn threshold(&mut self, name: &'static str, value: &mut Threshold) -> Result<()>;

    /// A number for which 0 says that there is none.
    fn optional(&mut self, name: &'static str, expected: &'static str, value: &mut Option<f64>) -> Result<()> {
        let mut number = value.unwrap_or(0.0);
        self.number(name, expected, &mut number, |x| x.is_finite() && x >= 0.0)?;
        *value = Some(number).filter(|number| *number > 0.0);
        Ok(())
    }

    fn whole(&mut self, name: &'static str, expected: &'static str, value: &mut u32, min: u32, max: u32) -> Result<()> {
        let mut number = f64::from(*value);
        self.number(name, expected, &mut number, |x| x.floor() == x)?;
        if number < f64::from(min) || number > f64::from(max) {
            return Err(Error::InvalidArgument { name, expected, value: number }.into());
        }
        *value = number as u32;
        Ok(())
    }

    fn count(
        &mut self,
        name: &'static str,
        expected: &'static str,
        value: &mut usize,
        min: u32,
        max: u32,
    ) -> Result<()> {
        let mut number = *value as u32;
        self.whole(name, expected, &mut number, min, max)?;
        *value = number as usize;
        Ok(())
    }
}

struct Reader<'a> {
    object: &'a JsValue,
    known: Vec<&'static str>,
}

impl Reader<'_> {
    /// The value given, `None` where there is none.
    fn given(&mut self, name: &'static str) -> Option<JsValue> {
        self.known.push(name);
        Some(get(self.object, name)).filter(|value| !value.is_undefined())
    }
}

impl Visitor for Reader<'_> {
    fn number(
        &mut self,
        name: &'static str,
        expected: &'static str,
        value: &mut f64,
        ok: fn(f64) -> bool,
    ) -> Result<()> {
        let Some(given) = self.given(name) else { return Ok(()) };
        let number = given.as_f64().unwrap_or(f64::NAN);
        if !ok(number) {
            return Err(Error::InvalidArgument { name, expected, value: number }.into());
        }
        *value = number;
        Ok(())
    }

    fn choice<T: Copy + PartialEq>(
        &mut self,
        name: &'static str,
        expected: &'static str,
        value: &mut T,
        table: &[(&'static str, T)],
    ) -> Result<()> {
        let Some(given) = self.given(name) else { return Ok(()) };
        let text = given.as_string();
        let Some((_, choice)) = table.iter().find(|(name, _)| text.as_deref() == Some(name)) else {
            return Err(Error::InvalidArgument { name, expected, value: given.as_f64().unwrap_or(f64::NAN) }.into());
        };
        *value = *choice;
        Ok(())
    }

    fn flag(&mut self, name: &'static str, value: &mut bool) -> Result<()> {
        let Some(given) = self.given(name) else { return Ok(()) };
        let refused =
            Error::InvalidArgument { name, expected: "true or false", value: given.as_f64().unwrap_or(f64::NAN) };
        *value = given.as_bool().ok_or(refused)?;
        Ok(())
    }

    fn threshold(&mut self, name: &'static str, value: &mut Threshold) -> Result<()> {
        let Some(given) = self.given(name) else { return Ok(()) };
        *value = match (given.as_f64(), given.as_string().as_deref()) {
            (Some(pixels), _) if pixels.is_finite() && pixels > 0.0 => Threshold::Pixels(pixels),
            (_, Some("paper")) => Threshold::PAPER,
            (number, _) => {
                let expected = "a number of pixels above 0, or 'paper'";
                return Err(Error::InvalidArgument { name, expected, value: number.unwrap_or(f64::NAN) }.into());
            }
        };
        Ok(())
    }
}

struct Writer {
    object: Object,
}

impl Visitor for Writer {
    fn number(&mut self, name: &'static str, _: &'static str, value: &mut f64, _: fn(f64) -> bool) -> Result<()> {
        set(&self.object, name, &JsValue::from_f64(*value));
        Ok(())
    }

    fn choice<T: Copy + PartialEq>(
        &mut self,
        name: &'static str,
        _: &'static str,
        value: &mut T,
        table: &[(&'static str, T)],
    ) -> Result<()> {
        if let Some((text, _)) = table.iter().find(|(_, choice)| choice == value) {
            set(&self.object, name, &JsValue::from_str(text));
        }
        Ok(())
    }

    fn flag(&mut self, name: &'static str, value: &mut bool) -> Result<()> {
        set(&self.object, name, &JsValue::from_bool(*value));
        Ok(())
    }

    fn threshold(&mut self, name: &'static str, value: &mut Threshold) -> Result<()> {
        let js = match *value {
            Threshold::Pixels(pixels) => JsValue::from_f64(pixels),
            Threshold::Normalised(_) => JsValue::from_str("paper"),
        };
        set(&self.object, name, &js);
        Ok(())
    }
}
