//! Turns what others want of the ledger, and it of them, into messages.

use super::State;
use crate::{
    distance_maps::Traced,
    ledger::Task,
    placement::Placement,
    service::{placer::Moved, publisher_actor::Still},
    simulation::Simulation,
    tracer::PathBatch,
};
use std::sync::Arc;

/// What reaches the ledger.
pub(in crate::service) enum ToLedger {
    /// A tracer has finished a task.
    Finished(Box<(Task, PathBatch)>),
    /// A tracer has traced the distance map of a virtual surface light.
    Mapped(Box<Traced>),
    /// Change what is done; the answer is the number of the first frame that shows it.
    Change(Change, flume::Sender<u64>),
    /// Go on in a new version of the scene; the answer is the number of the first frame that shows it.
    Edit(Box<Version>, flume::Sender<u64>),
    /// In fixed steps of time: nothing has changed until then, s.
    Time(f64),
    /// Tell the present state.
    Query(flume::Sender<State>),
    /// End.
    Stop,
}

/// A new version of the scene.
pub(in crate::service) struct Version {
    pub(in crate::service) simulation: Simulation,
    pub(in crate::service) still: Arc<Still>,
    /// Who wanted it.
    pub(in crate::service) asked: Asked,
    /// Time of the simulated scene, s.
    pub(in crate::service) time_s: f64,
    /// Publish it only once its light is whole: time goes on in fixed steps.
    pub(in crate::service) only_whole: bool,
}

/// Who wants a version of the scene.
pub(in crate::service) enum Asked {
    /// Somebody, by an edit that arrived then, monotonic ns.
    At(u64),
    /// The ledger: the scene is the same, with lights elsewhere.
    Nobody(Moved),
}

/// What the ledger tells of itself.
pub(in crate::service) enum FromLedger {
    /// A frame of the whole light of a version was published.
    Settled(u64),
    /// Lights had better lie elsewhere.
    Wants(LightsWanted),
}

/// Where lights had better lie.
pub(in crate::service) struct LightsWanted {
    /// Instead of here.
    pub(in crate::service) placement: Arc<Placement>,
    /// The number on each of its surfaces.
    pub(in crate::service) shares: Vec<u32>,
}

/// What the ledger can be told to do.
#[derive(Clone, Copy, Debug)]
pub(in crate::service) enum Change {
    /// Stop handing out work.
    Pause,
    /// Go on.
    Resume,
    /// While paused: go on until the next frame.
    Step,
}
