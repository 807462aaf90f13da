//! A call that goes on step by step, as it may leave tasks to other workers.

use std::cell::Cell;
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use wasm_bindgen::prelude::*;

use super::observer::JsObserver;
use super::workers::JsWorkers;
use crate::{Result, Stage};

/// As the declaration that is generated has a symbol that older TypeScript does not know.
#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = "
/** A call that has begun. */
export interface Running {
    /** Goes on: gives the result, after which there is no other step, or undefined. */
    step(): unknown;
    /** Whether another step is of no use before a task is done. */
    readonly waits: boolean;
    free(): void;
}
";

/// A call that has begun.
#[wasm_bindgen(skip_typescript)]
pub struct Running {
    work: Pin<Box<dyn Future<Output = std::result::Result<JsValue, JsValue>>>>,
    waits: Rc<Cell<bool>>,
}

impl Running {
    /// Begins a call, which does nothing before the first step.
    pub(super) fn new(
        on_progress: &JsValue,
        workers: &JsValue,
        call: impl AsyncFnOnce(&mut JsObserver, &JsWorkers) -> Result<JsValue> + 'static,
    ) -> Self {
        let mut observer = JsObserver::new(Stage::Input, on_progress);
        let waits = Rc::new(Cell::new(false));
        let workers = JsWorkers::new(workers, waits.clone());
        let work = async move { call(&mut observer, &workers).await.map_err(|error| observer.error(&error)) };
        Self { work: Box::pin(work), waits }
    }
}

#[wasm_bindgen]
impl Running {
    /// Goes on: gives the result, after which there is no other step, or undefined.
    pub fn step(&mut self) -> std::result::Result<JsValue, JsValue> {
        self.waits.set(false);
        match self.work.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(result) => result,
            Poll::Pending => Ok(JsValue::UNDEFINED),
        }
    }

    /// Whether another step is of no use before a task is done.
    #[wasm_bindgen(getter)]
    pub fn waits(&self) -> bool {
        self.waits.get()
    }
}
