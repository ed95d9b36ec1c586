//! Turns the edits that wait in the queue into one new version of the scene.

use photonstream_protocol::{Incoming, Replier, Reply, Request};
use photonstream_scene::{Scene, SceneEdit, SceneError};

/// Most edits of one version: whoever sends bad ones without end does not keep the others waiting.
const MOST: usize = 256;

/// Edits gathered for the next version.
pub(super) struct Edits {
    edit: SceneEdit,
    /// Who waits for the version.
    repliers: Vec<Replier>,
}

impl Edits {
    /// None yet.
    pub(super) fn of(scene: &Scene) -> Self {
        Self { edit: scene.edit(), repliers: Vec::new() }
    }

    /// Takes in `first` and all edits that wait behind it. Bad ones are answered at once and change nothing. Returns the
    /// first request that is no edit.
    pub(super) fn take(&mut self, first: Incoming, queue: &flume::Receiver<Incoming>) -> Option<Incoming> {
        let mut next = Some(first);
        for _ in 0..MOST {
            let Incoming { request, replier } = next.take().or_else(|| queue.try_recv().ok())?;
            let result = match &request {
                Request::SetLight { name, values } => self.edit.set_light(name, values).map(|_| ()),
                Request::MoveObject { name, values } => self.edit.move_object(name, values).map(|_| ()),
                Request::SetMaterial { name, values } => self.edit.set_material(name, values).map(|_| ()),
                _ => return Some(Incoming { request, replier }),
            };
            match result {
                Ok(()) => self.repliers.push(replier),
                Err(error) => replier.reply(Reply::error(code(&error), error.to_string())),
            }
        }
        None
    }

    /// The new version, and who waits for it; `None` where there was no good edit.
    pub(super) fn finish(self) -> Option<(Scene, Vec<Replier>)> {
        (!self.repliers.is_empty()).then(|| (self.edit.finish(), self.repliers))
    }
}

/// The word for programs.
pub(super) fn code(error: &SceneError) -> &'static str {
    match error {
        SceneError::UnknownName { .. } => "unknown-name",
        SceneError::UnknownKey { .. } => "unknown-key",
        _ => "invalid-value",
    }
}
