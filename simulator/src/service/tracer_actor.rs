//! Turns tasks into finished batches, on as many threads as asked for.

use super::ledger_actor::ToLedger;
use crate::{
    ledger::Task,
    tracer::{PathBatch, Tracer, Wave},
};
use std::sync::Arc;

/// Work for a tracer thread, with the memory to put the result in.
pub(super) struct Work {
    pub(super) tracer: Arc<Tracer>,
    pub(super) task: Task,
    pub(super) batch: PathBatch,
}

/// Takes work until there is nobody left to give it or to take the result.
pub(super) fn run(work: &flume::Receiver<Work>, ledger: &flume::Sender<ToLedger>) {
    let mut wave = Wave::default();
    while let Ok(Work { tracer, task, mut batch }) = work.recv() {
        tracer.resume(&task.draws, &task.begun, &mut wave, &mut batch);
        if ledger.send(ToLedger::Finished(Box::new((task, batch)))).is_err() {
            return;
        }
    }
}
