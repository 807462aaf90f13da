//! Tasks of a stage that do not depend on each other, and who performs them.

use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};

use crate::observer::{Observer, Portion, Subject};
use crate::{Error, Result};

/// A part of a stage.
pub(crate) trait Task {
    /// What it gives.
    type Output;

    /// What it works on.
    fn subject(&self) -> Subject;

    /// Performs it.
    fn perform(&self, observer: &mut dyn Observer) -> Result<Self::Output>;
}

/// Takes what each task gives, by its index, in the order of the tasks.
pub(crate) type Take<'a, T> = &'a mut dyn FnMut(usize, T) -> Result<()>;

/// The work on tasks; an error is the first of any of them.
pub(crate) type Work<'a> = Pin<Box<dyn Future<Output = Result<()>> + 'a>>;

/// Performs tasks, wherever. The unit type `()` performs one after another on this thread.
pub(crate) trait Workers<T: Task> {
    /// Performs all tasks.
    fn perform<'a>(&'a self, tasks: &'a [T], take: Take<'a, T::Output>, observer: &'a mut dyn Observer) -> Work<'a>;
}

impl<T: Task> Workers<T> for () {
    fn perform<'a>(&'a self, tasks: &'a [T], take: Take<'a, T::Output>, observer: &'a mut dyn Observer) -> Work<'a> {
        Box::pin(async move {
            let count = tasks.len() as f32;
            for (i, task) in tasks.iter().enumerate() {
                observer.subject(task.subject());
                let mut portion = Portion::new(observer, i as f32 / count, (i + 1) as f32 / count);
                take(i, task.perform(&mut portion)?)?;
            }
            Ok(())
        })
    }
}

/// The result of work whose tasks are all performed on this thread, so that it never waits.
pub(crate) fn without_waiting<T>(work: impl Future<Output = Result<T>>) -> Result<T> {
    match pin!(work).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => result,
        Poll::Pending => Err(Error::Aborted.into()),
    }
}
