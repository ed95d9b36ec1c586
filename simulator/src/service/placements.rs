//! Turns scenes that need other virtual surface lights into orders to place them, one at a time, the newest wanted last.
//!
//! - Another config or other settings win over all that was wanted before: what is under way is cancelled, and whoever
//!   waits for it waits for the newest.
//! - A resized object waits for what is under way, so that a drag shows something.
//! - Edits go into what is wanted as they go into what is simulated, where they name something that exists there.

use crate::{cancel::Cancel, simulation::have_same_lights};
use photonstream_protocol::{Replier, Reply};
use photonstream_scene::Scene;
use std::sync::Arc;

/// A scene that is to be simulated once its lights are placed.
pub(super) struct Wanted {
    pub(super) scene: Scene,
    /// When the request came, monotonic ns.
    pub(super) received_ns: u64,
    /// The instant of the animation that it shows, s; `None`: as it was loaded.
    pub(super) animated_s: Option<f64>,
    /// It is another config, not a version of the scene.
    pub(super) is_config: bool,
    /// It is the animation that wants it.
    pub(super) is_animated: bool,
    /// The scene is the same, with these numbers of lights on its surfaces.
    pub(super) shares: Option<Vec<u32>>,
    /// What is to be told from then on; `None`: what is told already.
    pub(super) notice: Option<Arc<str>>,
    /// Who waits for it.
    pub(super) waiting: Vec<Waiting>,
}

/// Somebody who waits for a scene.
pub(super) struct Waiting {
    pub(super) replier: Replier,
    /// A step is to be made in it before the answer.
    pub(super) steps: bool,
}

impl Waiting {
    /// Waits for nothing but the scene.
    pub(super) fn new(replier: Replier) -> Self {
        Self { replier, steps: false }
    }
}

impl Wanted {
    /// A version of the scene at an instant of its animation, for an edit that came at `received_ns`.
    pub(super) fn version(scene: Scene, received_ns: u64, animated_s: Option<f64>) -> Self {
        let (shares, notice, waiting) = (None, None, Vec::new());
        Self { scene, received_ns, animated_s, is_config: false, is_animated: false, shares, notice, waiting }
    }

    /// Takes the place of `older`.
    fn replacing(mut self, older: Self) -> Self {
        self.is_config |= older.is_config;
        self.notice = self.notice.or(older.notice);
        self.waiting.splice(0..0, older.waiting);
        self
    }
}

/// A scene whose lights are being placed.
struct UnderWay {
    /// With the edits since it was ordered; its lights are those of the ordered one.
    wanted: Wanted,
    cancel: Cancel,
}

/// What is placed, and what is wanted next.
#[derive(Default)]
pub(super) struct Placements {
    placer_is_busy: bool,
    /// `None` where what the placer is busy with is outdated.
    under_way: Option<UnderWay>,
    next: Option<Wanted>,
}

impl Placements {
    /// Whether another scene is to come.
    pub(super) fn are_awaited(&self) -> bool {
        self.under_way.is_some() || self.next.is_some()
    }

    /// Whether what is placed is the next instant of the animation.
    pub(super) fn are_animated(&self) -> bool {
        self.under_way.as_ref().is_some_and(|under_way| under_way.wanted.is_animated)
    }

    /// Whether what is to come is the present scene with its lights elsewhere, and nothing else.
    pub(super) fn are_moves(&self) -> bool {
        let under_way = self.under_way.iter().map(|under_way| &under_way.wanted);
        under_way.chain(&self.next).all(|wanted| wanted.shares.is_some() && wanted.waiting.is_empty())
    }

    /// The scenes to come, the newest last.
    pub(super) fn scenes(&self) -> impl Iterator<Item = &Scene> {
        let under_way = self.under_way.iter().map(|under_way| &under_way.wanted.scene);
        under_way.chain(self.next.iter().map(|next| &next.scene))
    }

    /// The newest of all, if any is to come.
    pub(super) fn newest(&mut self) -> Option<&mut Wanted> {
        self.next.as_mut().or(self.under_way.as_mut().map(|under_way| &mut under_way.wanted))
    }

    /// Wants `wanted` in the place of all before.
    pub(super) fn replace(&mut self, wanted: Wanted) {
        let under_way = self.under_way.take().map(|under_way| {
            under_way.cancel.cancel();
            under_way.wanted
        });
        let older = under_way.into_iter().chain(self.next.take());
        let older = older.reduce(|older, newer| newer.replacing(older));
        self.next = Some(match older {
            Some(older) => wanted.replacing(older),
            None => wanted,
        });
    }

    /// Wants `wanted`, a version of the newest, once what is under way has come.
    pub(super) fn append(&mut self, wanted: Wanted) {
        self.next = Some(match self.next.take() {
            Some(older) => wanted.replacing(older),
            None => wanted,
        });
    }

    /// Takes edited versions of all [`Placements::scenes`], in their order, in the place of these.
    pub(super) fn edit(&mut self, versions: Vec<Scene>, received_ns: u64) {
        let mut versions = versions.into_iter();
        if let Some(under_way) = &mut self.under_way
            && let Some(version) = versions.next()
        {
            if have_same_lights(&under_way.wanted.scene, &version) {
                under_way.wanted.scene = version;
            } else if self.next.is_none() {
                let animated_s = under_way.wanted.animated_s;
                self.next = Some(Wanted::version(version, received_ns, animated_s));
            }
        }
        if let (Some(next), Some(version)) = (&mut self.next, versions.next()) {
            next.scene = version;
        }
    }

    /// Tells `notice` with what is to come, where that would have told another one.
    pub(super) fn tell(&mut self, notice: &Arc<str>) {
        let under_way = self.under_way.iter_mut().map(|under_way| &mut under_way.wanted);
        for wanted in under_way.chain(&mut self.next).filter(|wanted| wanted.notice.is_some()) {
            wanted.notice = Some(Arc::clone(notice));
        }
    }

    /// Takes what is to be placed next; `None` while the placer is busy, or nothing is wanted.
    pub(super) fn take_next(&mut self) -> Option<Wanted> {
        if self.placer_is_busy { None } else { self.next.take() }
    }

    /// `wanted` is being placed from now on.
    pub(super) fn begin(&mut self, wanted: Wanted) -> Cancel {
        let cancel = Cancel::default();
        self.placer_is_busy = true;
        self.under_way = Some(UnderWay { wanted, cancel: cancel.clone() });
        cancel
    }

    /// The placer has answered; `None` if what it was busy with is outdated.
    pub(super) fn finish(&mut self) -> Option<Wanted> {
        self.placer_is_busy = false;
        self.under_way.take().map(|under_way| under_way.wanted)
    }

    /// Nothing is wanted any more: all who wait are told.
    pub(super) fn end(mut self) {
        let under_way = self.under_way.take().map(|under_way| {
            under_way.cancel.cancel();
            under_way.wanted
        });
        for waiting in under_way.into_iter().chain(self.next.take()).flat_map(|wanted| wanted.waiting) {
            let reply = Reply::error("ended", "the simulation has ended before the scene was ready");
            waiting.replier.reply(reply);
        }
    }
}
