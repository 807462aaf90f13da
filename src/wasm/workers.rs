//! Tasks that other workers perform, by way of JavaScript.

use std::cell::Cell;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::Poll;

use js_sys::{Array, Function};
use wasm_bindgen::{JsCast, JsValue};

use super::convert::{get, image_to_js};
use super::matches;
use crate::features::Features;
use crate::observer::{Observer, Portion, Subject, report};
use crate::pipeline::{Detect, Memory};
use crate::workers::{Take, Task, Work, Workers};
use crate::{Result, Stage};

/// A task as a call of the module in another worker.
pub(super) trait SharedTask: Task {
    /// The name of the call.
    const NAME: &'static str;
    /// The stage that is reported when it is done.
    const STAGE: Stage;

    /// Its arguments but for the options, which are those of the whole.
    fn arguments(&self) -> Array;

    /// What the call gave.
    fn output(&self, result: &JsValue) -> Result<Self::Output>;
}

/// This worker, and others.
pub(super) struct JsWorkers {
    /// Has a call performed, by its name and arguments. Gives an object that will have the call's `result`.
    perform: Option<Function>,
    /// How many others take part.
    others: Cell<usize>,
    /// Set when there is nothing to do before a task of others is done.
    waits: Rc<Cell<bool>>,
}

impl JsWorkers {
    /// Of `{ others, perform }`; anything else is none but this one.
    pub fn new(workers: &JsValue, waits: Rc<Cell<bool>>) -> Self {
        let perform: Option<Function> = get(workers, "perform").dyn_into().ok();
        let others = perform.as_ref().and_then(|_| get(workers, "others").as_f64()).unwrap_or(0.0) as usize;
        Self { perform, others: Cell::new(others), waits }
    }

    /// Leaves tasks to so many workers only that all of them together take no more memory than may be taken, which is so many `times` what is
    /// predicted of the whole.
    pub fn limit(&self, times: u64) {
        let others = usize::try_from(times.saturating_sub(1)).unwrap_or(usize::MAX);
        self.others.set(self.others.get().min(others));
    }

    /// Refuses a job of two photos that would take too much memory with this canvas, and [limits](Self::limit) the workers for it.
    pub fn check(&self, memory: &Memory<'_>, canvas: (usize, usize)) -> Result<()> {
        self.limit(memory.times(canvas));
        memory.check(canvas)
    }

    /// Performs tasks here and elsewhere, in the order in which their results are taken: so few of them have to be kept.
    async fn share(&self, tasks: &mut dyn Tasks, stage: Stage, observer: &mut dyn Observer) -> Result<()> {
        let all = tasks.count();
        let (mut elsewhere, mut done) = (0, 0);
        // Of the tasks that have begun: what will have the result, if it is begun elsewhere.
        let mut begun: Vec<Option<JsValue>> = Vec::with_capacity(all);
        let mut taken = 0;
        while taken < all {
            while self.share_of_others(elsewhere, all - begun.len()) {
                begun.push(self.perform.as_ref().map(|perform| tasks.begin_elsewhere(begun.len(), perform)));
                elsewhere += 1;
            }
            if let Some(outcome) = begun.get_mut(taken) {
                let Some(object) = outcome.take() else {
                    tasks.take_own(taken)?;
                    taken += 1;
                    continue;
                };
                let result = get(&object, "result");
                if !result.is_undefined() {
                    (elsewhere, done) = (elsewhere - 1, done + 1);
                    observer.subject(tasks.subject(taken));
                    report(observer, stage, done as f32 / all as f32)?;
                    tasks.take_from_others(taken, &result)?;
                    taken += 1;
                    continue;
                }
                *outcome = Some(object);
            }
            let next = begun.len();
            if next < all {
                observer.subject(tasks.subject(next));
                let (from, to) = (done as f32 / all as f32, (done + 1) as f32 / all as f32);
                tasks.perform(next, &mut Portion::new(observer, from, to))?;
                begun.push(None);
                done += 1;
            } else {
                self.waits.set(true);
            }
            if elsewhere > 0 {
                pause().await;
            }
        }
        Ok(())
    }

    /// Whether others should get another task of those `left`, besides the ones they have. Each gets one to work on and, unless there are few, one
    /// to go on with; the last task is done here.
    fn share_of_others(&self, elsewhere: usize, left: usize) -> bool {
        let others = self.others.get();
        left > 1 && elsewhere < others || left > others + 1 && elsewhere < 2 * others
    }
}

/// Tasks of any kind, by their index.
trait Tasks {
    fn count(&self) -> usize;
    fn subject(&self, task: usize) -> Subject;
    /// Has a task performed by others. Gives an object that will have the result.
    fn begin_elsewhere(&self, task: usize, perform: &Function) -> JsValue;
    /// Performs a task here, and keeps what it gives.
    fn perform(&mut self, task: usize, observer: &mut dyn Observer) -> Result<()>;
    /// Hands over what has been kept longest.
    fn take_own(&mut self, task: usize) -> Result<()>;
    /// Hands over what others give.
    fn take_from_others(&mut self, task: usize, result: &JsValue) -> Result<()>;
}

struct TasksOf<'a, T: SharedTask> {
    tasks: &'a [T],
    take: Take<'a, T::Output>,
    kept: Vec<T::Output>,
}

impl<T: SharedTask> Tasks for TasksOf<'_, T> {
    fn count(&self) -> usize {
        self.tasks.len()
    }

    fn subject(&self, task: usize) -> Subject {
        self.tasks[task].subject()
    }

    fn begin_elsewhere(&self, task: usize, perform: &Function) -> JsValue {
        let arguments = self.tasks[task].arguments();
        perform.call2(&JsValue::NULL, &T::NAME.into(), &arguments).unwrap_or(JsValue::UNDEFINED)
    }

    fn perform(&mut self, task: usize, observer: &mut dyn Observer) -> Result<()> {
        self.kept.push(self.tasks[task].perform(observer)?);
        Ok(())
    }

    fn take_own(&mut self, task: usize) -> Result<()> {
        if self.kept.is_empty() { Ok(()) } else { (self.take)(task, self.kept.remove(0)) }
    }

    fn take_from_others(&mut self, task: usize, result: &JsValue) -> Result<()> {
        (self.take)(task, self.tasks[task].output(result)?)
    }
}

impl SharedTask for Detect<'_> {
    const NAME: &'static str = "detect";
    const STAGE: Stage = Stage::Detect;

    fn arguments(&self) -> Array {
        let photo = self.photo;
        Array::of1(&image_to_js(photo.data(), photo.width(), photo.height()))
    }

    fn output(&self, result: &JsValue) -> Result<Features> {
        matches::features("features", result)
    }
}

/// Lets JavaScript receive messages.
async fn pause() {
    let mut paused = false;
    poll_fn(|_| if std::mem::replace(&mut paused, true) { Poll::Ready(()) } else { Poll::Pending }).await;
}

impl<T: SharedTask> Workers<T> for JsWorkers {
    fn perform<'a>(&'a self, tasks: &'a [T], take: Take<'a, T::Output>, observer: &'a mut dyn Observer) -> Work<'a> {
        let mut tasks = TasksOf { tasks, take, kept: Vec::new() };
        Box::pin(async move { self.share(&mut tasks, T::STAGE, observer).await })
    }
}
