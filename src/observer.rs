//! Progress reports and cancellation of long calls.

use crate::{Error, Result, Stage};

/// What is worked on, of many photos.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Subject {
    /// All of them, or the only two.
    #[default]
    All,
    /// The photo of this index.
    Photo(usize),
    /// The pair of these indices, ascending.
    Pair([usize; 2]),
}

/// Receives progress and can cancel a call. The unit type `()` ignores progress and never cancels.
pub trait Observer {
    /// Called with the current stage and the completed fraction of it, 0 to 1. Returning `false` stops the call with
    /// [`Error::Aborted`].
    fn progress(&mut self, _stage: Stage, _fraction: f32) -> bool {
        true
    }

    /// Called before the work on another photo or pair begins, when there are many: what is reported from then on is of that.
    fn subject(&mut self, _subject: Subject) {}

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

/// Rows between two reports of [`report_row`].
const ROWS: usize = 64;

/// Reports now and then that `done` of `all` rows are done.
pub(crate) fn report_row(observer: &mut dyn Observer, stage: Stage, done: usize, all: usize) -> Result<()> {
    if done.is_multiple_of(ROWS) { report(observer, stage, done as f32 / all.max(1) as f32) } else { Ok(()) }
}

/// A stage made of several steps: each step reports 0 to 1, and the observer hears one fraction that only grows.
pub struct Portion<'a> {
    observer: &'a mut dyn Observer,
    from: f32,
    to: f32,
    /// The stage that is reported, whatever the step reports.
    stage: Option<Stage>,
}

impl<'a> Portion<'a> {
    /// The step that takes a stage from one fraction to another.
    pub fn new(observer: &'a mut dyn Observer, from: f32, to: f32) -> Self {
        Self { observer, from, to, stage: None }
    }

    /// A step that has stages of its own, reported as a part of `stage`: a later stage may repeat an earlier one's work, but
    /// progress does not go back.
    pub fn of_stage(observer: &'a mut dyn Observer, stage: Stage, from: f32, to: f32) -> Self {
        Self { stage: Some(stage), ..Self::new(observer, from, to) }
    }
}

impl Observer for Portion<'_> {
    fn progress(&mut self, stage: Stage, fraction: f32) -> bool {
        self.observer.progress(self.stage.unwrap_or(stage), self.from + (self.to - self.from) * fraction)
    }

    fn subject(&mut self, subject: Subject) {
        self.observer.subject(subject);
    }

    fn now(&mut self) -> f64 {
        self.observer.now()
    }
}
