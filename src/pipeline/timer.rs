//! Where the time goes.

use crate::Stage;
use crate::observer::Observer;

/// Milliseconds per stage by the observer's clock; the times of a stage that runs more than once are added up.
pub(super) struct StageTimer {
    times: Vec<(Stage, f64)>,
    /// When the stage that is running began.
    start: f64,
}

impl StageTimer {
    /// Starts the clock of the first stage.
    pub fn start(observer: &mut dyn Observer) -> Self {
        Self { times: Vec::new(), start: observer.now() }
    }

    /// Ends `stage`, which began when the one before ended.
    pub fn end(&mut self, stage: Stage, observer: &mut dyn Observer) {
        let now = observer.now();
        match self.times.iter_mut().find(|(known, _)| *known == stage) {
            Some((_, ms)) => *ms += now - self.start,
            None => self.times.push((stage, now - self.start)),
        }
        self.start = now;
    }

    /// The times, in the order in which the stages ran first.
    pub fn into_times(self) -> Vec<(Stage, f64)> {
        self.times
    }
}
