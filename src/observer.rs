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
