//! Turns the edits that wait in the queue into one new version of the scene, and of those that are to come.

use photonstream_protocol::{Incoming, Replier, Reply, Request};
use photonstream_scene::{Scene, SceneEdit, SceneError};

/// Most edits of one version: whoever sends bad ones without end does not keep the others waiting.
const MOST: usize = 256;

/// Edits gathered for the next version.
pub(super) struct Edits {
    running: SceneEdit,
    /// The scenes to come.
    wanted: Vec<SceneEdit>,
    edited: Vec<Edited>,
}

/// An edit that at least one of the scenes took.
pub(super) struct Edited {
    pub(super) replier: Replier,
    /// Whether the scene that is simulated took it.
    pub(super) in_running: bool,
    /// Why the newest scene to come did not take it; none where there is no such scene.
    pub(super) not_in_newest: Option<SceneError>,
}

/// The new versions, and who made them.
pub(super) struct Versions {
    /// `None` where nothing in it was edited.
    pub(super) running: Option<Scene>,
    pub(super) wanted: Vec<Scene>,
    pub(super) edited: Vec<Edited>,
}

impl Edits {
    /// None yet, of the scene that is simulated and those that are to come, the newest last.
    pub(super) fn of<'s>(running: &Scene, wanted: impl Iterator<Item = &'s Scene>) -> Self {
        Self { running: running.edit(), wanted: wanted.map(Scene::edit).collect(), edited: Vec::new() }
    }

    /// Takes in `first` and all edits that wait behind it. Bad ones are answered at once and change nothing. Returns the
    /// first request that is no edit.
    pub(super) fn take(&mut self, first: Incoming, queue: &flume::Receiver<Incoming>) -> Option<Incoming> {
        let mut next = Some(first);
        for _ in 0..MOST {
            let Incoming { request, replier } = next.take().or_else(|| queue.try_recv().ok())?;
            let Some(in_running) = apply(&mut self.running, &request) else {
                return Some(Incoming { request, replier });
            };
            let in_wanted: Vec<_> = self.wanted.iter_mut().filter_map(|edit| apply(edit, &request)).collect();
            let is_wanted = in_wanted.iter().any(Result::is_ok);
            match in_running {
                Err(error) if !is_wanted => replier.reply(refusal(&error)),
                in_running => self.edited.push(Edited {
                    replier,
                    in_running: in_running.is_ok(),
                    not_in_newest: in_wanted.into_iter().next_back().and_then(Result::err),
                }),
            }
        }
        None
    }

    /// The new versions; `None` where there was no good edit.
    pub(super) fn finish(self) -> Option<Versions> {
        let Self { running, wanted, edited } = self;
        let is_edited = edited.iter().any(|edit| edit.in_running);
        (!edited.is_empty()).then(|| Versions {
            running: is_edited.then(|| running.finish()),
            wanted: wanted.into_iter().map(SceneEdit::finish).collect(),
            edited,
        })
    }
}

/// Makes the edit that a request asks for; `None` if it asks for none.
fn apply(edit: &mut SceneEdit, request: &Request) -> Option<Result<(), SceneError>> {
    match request {
        Request::SetLight { name, values } => Some(edit.set_light(name, values).map(|_| ())),
        Request::MoveObject { name, values } => Some(edit.move_object(name, values).map(|_| ())),
        Request::SetMaterial { name, values } => Some(edit.set_material(name, values).map(|_| ())),
        Request::SetVpls { values } => Some(edit.set_vpls(values)),
        _ => None,
    }
}

/// The answer to an edit or a config that is not valid.
pub(super) fn refusal(error: &SceneError) -> Reply {
    let code = match error {
        SceneError::UnknownName { .. } => "unknown-name",
        SceneError::UnknownKey { .. } => "unknown-key",
        _ => "invalid-value",
    };
    Reply::error(code, error.to_string())
}
