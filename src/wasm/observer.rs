//! Progress and time through JavaScript.

use js_sys::{Array, Function};
use wasm_bindgen::prelude::*;

use super::convert::to_js_error;
use crate::observer::{Observer, Subject};
use crate::{Error, Stage};

#[wasm_bindgen]
extern "C" {
    /// The clock of browsers, workers and Node.
    #[wasm_bindgen(thread_local_v2, js_name = performance)]
    static PERFORMANCE: web_sys::Performance;
}

/// Calls `onProgress(stage, fraction, subject)`, the last being the index of a photo, those of a pair, or undefined. Where the callback
/// returns `false` or throws, the call is stopped.
pub(super) struct JsObserver {
    callback: Option<Function>,
    stage: Stage,
    subject: JsValue,
    /// What was reported last of this stage and subject; negative for nothing.
    reported: f32,
}

/// The stages report often; a hundred times per stage, photo or pair is enough.
const STEP: f32 = 0.01;

impl JsObserver {
    /// Before `stage`. `callback` is a function, or anything else for none.
    pub fn new(stage: Stage, callback: &JsValue) -> Self {
        Self { callback: callback.dyn_ref::<Function>().cloned(), stage, subject: JsValue::UNDEFINED, reported: -1.0 }
    }

    /// The JavaScript error for `error`, which names the stage reached.
    pub fn error(&self, error: &Error) -> JsValue {
        to_js_error(error, self.stage.name())
    }
}

impl Observer for JsObserver {
    fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
        if stage == self.stage && fraction < 1.0 && fraction - self.reported < STEP {
            return true;
        }
        (self.stage, self.reported) = (stage, fraction);
        let Some(callback) = &self.callback else { return true };
        let reply = callback.call3(&JsValue::NULL, &stage.name().into(), &f64::from(fraction).into(), &self.subject);
        reply.is_ok_and(|reply| reply.as_bool() != Some(false))
    }

    fn subject(&mut self, subject: Subject) {
        let index = |photo: usize| JsValue::from(photo as f64);
        self.reported = -1.0;
        self.subject = match subject {
            Subject::All => JsValue::UNDEFINED,
            Subject::Photo(photo) => index(photo),
            Subject::Pair(photos) => photos.map(index).iter().collect::<Array>().into(),
        };
    }

    fn now(&mut self) -> f64 {
        PERFORMANCE.with(web_sys::Performance::now)
    }
}
