//! How a long call tells its caller where it is, and learns that it should stop.

use crate::{Error, Result, Stage};

/// Follows a call through its stages. The unit type `()` follows nothing.
pub trait Observer {
    /// Called with the stage and how much of it is done, 0 to 1. Returning `false` stops the call with
    /// [`Error::Aborted`].
    fn progress(&mut self, _stage: Stage, _fraction: f32) -> bool {
        true
    }

    /// A clock in milliseconds; only differences count. The core has none of its own, wasm has no `Instant`.
    fn now(&mut self) -> f64 {
        0.0
    }
}

impl Observer for () {}

/// Reports progress, turning a refusal into [`Error::Aborted`].
pub fn report(observer: &mut dyn Observer, stage: Stage, fraction: f32) -> Result<()> {
    if observer.progress(stage, fraction) { Ok(()) } else { Err(Error::Aborted.into()) }
}

/// A stage made of several steps: each step reports 0 to 1, and the observer hears one fraction that only grows.
pub struct Portion<'a> {
    observer: &'a mut dyn Observer,
    from: f32,
    to: f32,
}

impl<'a> Portion<'a> {
    /// The step that takes a stage from one fraction to another.
    pub fn new(observer: &'a mut dyn Observer, from: f32, to: f32) -> Self {
        Self { observer, from, to }
    }
}

impl Observer for Portion<'_> {
    fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
        self.observer.progress(stage, self.from + (self.to - self.from) * fraction)
    }

    fn now(&mut self) -> f64 {
        self.observer.now()
    }
}
