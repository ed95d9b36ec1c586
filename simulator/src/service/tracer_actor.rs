//! Turns tasks into finished batches, on as many threads as asked for.

use super::ledger_actor::ToLedger;
use crate::{
    distance_maps::MapTask,
    ledger::Task,
    tracer::{PathBatch, Tracer, Wave},
};
use std::sync::Arc;

/// Work for a tracer thread.
pub(super) enum Work {
    /// Paths to trace, with the memory to put them in.
    Paths { tracer: Arc<Tracer>, task: Task, batch: PathBatch },
    /// What a virtual surface light sees.
    Map(Box<MapTask>),
}

/// Takes work until there is nobody left to give it or to take the result.
pub(super) fn run(work: &flume::Receiver<Work>, ledger: &flume::Sender<ToLedger>) {
    let mut wave = Wave::default();
    while let Ok(work) = work.recv() {
        let done = match work {
            Work::Paths { tracer, task, mut batch } => {
                tracer.resume(&task.draws, &task.begun, &mut wave, &mut batch);
                ToLedger::Finished(Box::new((task, batch)))
            }
            Work::Map(task) => ToLedger::Mapped(Box::new(task.run())),
        };
        if ledger.send(done).is_err() {
            return;
        }
    }
}
