//! Turns tasks into finished batches, on as many threads as asked for.

use super::ledger_actor::ToLedger;
use crate::{
    distance_maps::MapTask,
    ledger::Task,
    tracer::{PathBatch, Tracer, Wave},
};
use std::sync::Arc;

/// Paths to trace, with the memory to put them in.
pub(super) struct PathWork {
    pub(super) tracer: Arc<Tracer>,
    pub(super) task: Task,
    pub(super) batch: PathBatch,
}

/// Work for a tracer thread.
pub(super) enum Work {
    /// Paths.
    Paths(Box<PathWork>),
    /// What a virtual surface light sees.
    Map(Box<MapTask>),
}

/// Takes work until there is nobody left to give it or to take the result.
pub(super) fn run(work: &flume::Receiver<Work>, ledger: &flume::Sender<ToLedger>) {
    let mut wave = Wave::default();
    while let Ok(work) = work.recv() {
        let done = match work {
            Work::Paths(work) => {
                let PathWork { tracer, task, mut batch } = *work;
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
