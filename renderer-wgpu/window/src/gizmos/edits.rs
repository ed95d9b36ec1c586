//! Turns changes of a config's tables into requests, and keeps what the simulator does not publish: the tables as they are now.

use super::{Gizmo, Kind};
use crate::following::Published;
use photonstream_protocol::Request;
use photonstream_scene::{Scene, SceneError, VplSet, vpls::VplTables};
use serde_json::{Map, Value};
use std::sync::Arc;

/// The tables of VPLs, blockers and proxies as they are edited here: those of the scene's text until the first edit, and
/// again as soon as another text comes.
#[derive(Debug, Default)]
pub(crate) struct Edits {
    of: Option<Origin>,
    tables: VplTables,
    /// What the tables mean.
    set: Arc<VplSet>,
    /// What the simulator has agreed to last.
    accepted: VplTables,
    /// Kinds whose lists have not been sent yet.
    changed: Vec<Kind>,
    /// Whether the simulator has refused an edit, and none was made since.
    is_refused: bool,
}

/// Of which scene and which run of the simulator the tables are.
#[derive(Debug)]
struct Origin {
    text: Arc<str>,
    hash: u64,
    epoch: u64,
    frame: u64,
}

impl Origin {
    fn of(published: &Published) -> Self {
        let frame = &published.frame;
        Self {
            text: Arc::clone(&frame.scene_text),
            hash: frame.scene_hash,
            epoch: frame.epoch,
            frame: frame.frame,
        }
    }

    /// Whether nothing has been loaded anew since: another segment of the same run goes on with its numbers.
    fn goes_on_with(&self, newer: &Self) -> bool {
        let is_same_run = self.epoch == newer.epoch || self.frame <= newer.frame;
        let is_same_text = Arc::ptr_eq(&self.text, &newer.text) || self.text == newer.text;
        is_same_run && is_same_text && self.hash == newer.hash
    }
}

impl Edits {
    /// The tables.
    pub(crate) fn tables(&self) -> &VplTables {
        &self.tables
    }

    /// What the tables mean.
    pub(crate) fn set(&self) -> &VplSet {
        &self.set
    }

    /// Whether there is such a thing.
    pub(crate) fn has(&self, gizmo: Gizmo) -> bool {
        gizmo.index()
            < match gizmo.kind() {
                Kind::Vpl => self.set.vpls.len(),
                Kind::Blocker => self.set.blockers.len(),
                Kind::Proxy => self.set.proxies.len(),
            }
    }

    /// Takes in a frame: with another scene text, or from another run, its tables take the place of the edited ones, and
    /// it is `true`.
    pub(crate) fn follow(&mut self, published: &Published) -> bool {
        let newer = Origin::of(published);
        let goes_on = self.of.as_ref().is_some_and(|of| of.goes_on_with(&newer));
        self.of = Some(newer);
        if !goes_on {
            let set = &published.scene.vpls;
            self.tables.clone_from(&set.tables);
            self.accepted.clone_from(&set.tables);
            self.set = Arc::clone(set);
            self.changed.clear();
            self.is_refused = false;
        }
        !goes_on
    }

    /// Changes the tables, and notes which of them have to be sent.
    ///
    /// # Errors
    /// If the scene cannot have such tables; they stay as they were.
    pub(crate) fn change(
        &mut self,
        scene: &Scene,
        change: impl FnOnce(&mut VplTables),
    ) -> Result<(), SceneError> {
        let mut tables = self.tables.clone();
        change(&mut tables);
        self.put(scene, tables)
    }

    /// Puts whole tables in the place of those that are there.
    ///
    /// # Errors
    /// As [`Self::change`].
    pub(crate) fn put(&mut self, scene: &Scene, tables: VplTables) -> Result<(), SceneError> {
        let changed: Vec<Kind> =
            Kind::ALL.into_iter().filter(|&kind| differs(kind, &tables, &self.tables)).collect();
        if changed.is_empty() {
            return Ok(());
        }
        self.set = meaning(scene, &tables)?;
        self.tables = tables;
        self.is_refused = false;
        for kind in changed {
            if !self.changed.contains(&kind) {
                self.changed.push(kind);
            }
        }
        Ok(())
    }

    /// The request that sends what has changed since the last one.
    pub(crate) fn take_request(&mut self) -> Option<Request> {
        let changed = std::mem::take(&mut self.changed);
        let values = changed.into_iter().map(|kind| (key(kind).to_owned(), list(kind, &self.tables)));
        let values: Map<String, Value> = values.collect();
        (!values.is_empty()).then_some(Request::SetVpls { values })
    }

    /// The simulator has taken over these lists.
    pub(crate) fn accept(&mut self, scene: &Scene, values: &Map<String, Value>) {
        for kind in Kind::ALL {
            let Some(value) = values.get(key(kind)).cloned() else { continue };
            let read = match kind {
                Kind::Vpl => serde_json::from_value(value).map(|list| self.accepted.vpl = list),
                Kind::Blocker => serde_json::from_value(value).map(|list| self.accepted.blocker = list),
                Kind::Proxy => serde_json::from_value(value).map(|list| self.accepted.proxy = list),
            };
            // They were written here.
            debug_assert!(read.is_ok(), "{read:?}");
        }
        // An answer to what was asked for before the refusal.
        if self.is_refused {
            self.go_back(scene);
        }
    }

    /// The simulator has refused an edit: the tables become again what it has.
    pub(crate) fn refuse(&mut self, scene: &Scene) {
        self.is_refused = true;
        self.changed.clear();
        self.go_back(scene);
    }

    fn go_back(&mut self, scene: &Scene) {
        // What was agreed to once is valid.
        if let Ok(set) = meaning(scene, &self.accepted) {
            self.set = set;
            self.tables.clone_from(&self.accepted);
        }
    }
}

/// What tables mean in a scene.
fn meaning(scene: &Scene, tables: &VplTables) -> Result<Arc<VplSet>, SceneError> {
    let mut edit = scene.edit();
    edit.set_vpls(&Kind::ALL.into_iter().map(|kind| (key(kind).to_owned(), list(kind, tables))).collect())?;
    Ok(edit.finish().vpls)
}

fn differs(kind: Kind, a: &VplTables, b: &VplTables) -> bool {
    match kind {
        Kind::Vpl => a.vpl != b.vpl,
        Kind::Blocker => a.blocker != b.blocker,
        Kind::Proxy => a.proxy != b.proxy,
    }
}

/// The key of a list in requests and configs.
fn key(kind: Kind) -> &'static str {
    match kind {
        Kind::Vpl => "vpl",
        Kind::Blocker => "blocker",
        Kind::Proxy => "proxy",
    }
}

/// A list as it is sent: what is not said is left out.
fn list(kind: Kind, tables: &VplTables) -> Value {
    let list = match kind {
        Kind::Vpl => serde_json::to_value(&tables.vpl),
        Kind::Blocker => serde_json::to_value(&tables.blocker),
        Kind::Proxy => serde_json::to_value(&tables.proxy),
    };
    // Numbers and texts in structures of named fields always are JSON.
    let mut list = list.unwrap_or_default();
    for table in list.as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
        table.retain(|_, value| !value.is_null());
    }
    list
}
