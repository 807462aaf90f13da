//! Progress and time through JavaScript.

use js_sys::Function;
use wasm_bindgen::prelude::*;

use super::convert::to_js_error;
use crate::observer::Observer;
use crate::{Error, Stage};

#[wasm_bindgen]
extern "C" {
    /// The clock of browsers, workers and Node.
    #[wasm_bindgen(thread_local_v2, js_name = performance)]
    static PERFORMANCE: web_sys::Performance;
}

/// Calls `onProgress(stage, fraction)`. Where the callback returns `false` or throws, the call is stopped.
pub(super) struct JsObserver {
    callback: Option<Function>,
    stage: Stage,
}

impl JsObserver {
    /// Before `stage`. `callback` is a function, or anything else for none.
    pub fn new(stage: Stage, callback: &JsValue) -> Self {
        Self { callback: callback.dyn_ref::<Function>().cloned(), stage }
    }

    /// The JavaScript error for `error`, which names the stage reached.
    pub fn error(&self, error: &Error) -> JsValue {
        to_js_error(error, self.stage.name())
    }
}

impl Observer for JsObserver {
    fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
        self.stage = stage;
        let Some(callback) = &self.callback else { return true };
        let reply = callback.call2(&JsValue::NULL, &stage.name().into(), &f64::from(fraction).into());
        reply.is_ok_and(|reply| reply.as_bool() != Some(false))
    }

    fn now(&mut self) -> f64 {
        PERFORMANCE.with(web_sys::Performance::now)
    }
}
