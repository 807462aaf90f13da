//! Progress of a part of a stage.

use crate::observer::{Observer, report};
use crate::{Result, Stage};

/// Rows between two reports of progress.
const ROWS: usize = 64;

/// A part of blending, from one fraction of the whole to another.
pub(super) struct Span<'a> {
    pub observer: &'a mut dyn Observer,
    pub from: f32,
    pub to: f32,
}

impl Span<'_> {
    /// The part of this part between two fractions of it.
    pub fn part(&mut self, from: f32, to: f32) -> Span<'_> {
        let at = |fraction: f32| self.from + (self.to - self.from) * fraction;
        Span { from: at(from), to: at(to), observer: self.observer }
    }

    /// Reports that `done` of `all` rows are done, every now and then.
    pub fn row(&mut self, done: usize, all: usize) -> Result<()> {
        if done.is_multiple_of(ROWS) {
            let fraction = self.from + (self.to - self.from) * (done as f32 / all.max(1) as f32);
            report(self.observer, Stage::Blend, fraction)?;
        }
        Ok(())
    }
}
