//! Turns edits, configs, settings and time into the next version of the scene, or into an order to make it ready.
//!
//! A version with the lights of the present one is simulated at once. Any other waits until its lights are placed, while
//! the present one goes on; whoever asked for it is answered then. A config replaces what was dragged or set before it was
//! read. What is edited from then on is edited in the present scene at once, and in those to come where they have
//! something of that name; an edit that itself needs other lights, and those that come in the same instant, in those to
//! come alone. VPLs that the simulator saved itself replace nothing else.

use super::Director;
use crate::{
    service::{
        clock::Clock,
        edits::{self, Edits, Versions},
        ledger_actor::{Asked, Change, LightsWanted, ToLedger, Version},
        placements::{Waiting, Wanted},
        placer::{Order, Placed},
        publisher_actor::Still,
        settings::{self, SettingsError},
        watcher::News,
    },
    simulation::{Simulation, have_same_lights},
};
use photonstream_protocol::{Incoming, Replier, Reply, monotonic_ns};
use photonstream_scene::Scene;
use serde_json::{Map, Value};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// What has become of what is animated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    /// It is shown where it is now.
    Shown,
    /// It is there already, or cannot be.
    Still,
    /// It will be shown once a scene is ready.
    Awaited,
}

impl Director {
    /// Applies an edit, together with all edits that wait behind it. Returns the request that follows them, if it is no
    /// edit.
    pub(super) fn edit(&mut self, incoming: Incoming) -> Option<Incoming> {
        let received_ns = monotonic_ns();
        let mut edits = Edits::of(&self.simulation.scene, self.placements.scenes());
        let rest = edits.take(incoming, self.server.requests());
        let Some(Versions { running, wanted, edited }) = edits.finish() else { return rest };
        self.placements.edit(wanted, received_ns);
        let mut now = None;
        if let Some(scene) = running {
            if self.simulation.has_lights_of(&scene) {
                now = Some(self.show(scene, received_ns));
            } else if !self.placements.are_awaited() {
                self.placements.append(Wanted::version(scene, received_ns, Some(self.animated_s)));
            }
        }
        for edit in edited {
            match (now.as_ref().filter(|_| edit.in_running), edit.not_in_newest) {
                (Some(reply), _) => edit.replier.reply(reply.clone()),
                (None, Some(error)) => edit.replier.reply(edits::refusal(&error)),
                (None, None) => self.keep_waiting(Waiting::new(edit.replier)),
            }
        }
        self.place();
        rest
    }

    /// Loads the config again, whether it has changed or not.
    pub(super) fn reload(&mut self, replier: Replier) {
        let not_loaded = match &self.loader {
            Some(loader) => loader.asked.send(replier).err().map(flume::SendError::into_inner),
            None => Some(replier),
        };
        if let Some(replier) = not_loaded {
            replier.reply(Reply::error("unsupported", "this simulation was not started from a config file"));
        }
    }

    /// Follows what the watcher has seen.
    pub(super) fn hear(&mut self, news: News) {
        match news {
            // As loaded it is what is simulated already, or will be: edits since then stay.
            News::Scene(scene, _) if scene.hash == self.loaded_hash => {
                if !self.still.notice.is_empty() {
                    tracing::info!("the config is again what is simulated");
                    self.tell_all("");
                }
            }
            News::Scene(scene, Some(text)) if self.is_saved(&text) => {
                tracing::info!("the config has the VPLs that were saved into it; other edits go on");
                self.take_saved(&scene);
            }
            News::Scene(scene, _) => {
                self.saved = None;
                tracing::info!("the config has changed: it is simulated as soon as its lights are placed");
                self.want_config(*scene, None);
            }
            News::Broken(reason) => self.refuse(&reason),
        }
    }

    /// Wants the scene of another config, in the place of all others.
    pub(super) fn want_config(&mut self, scene: Scene, replier: Option<Replier>) {
        for notice in &scene.notices {
            tracing::warn!("{}: {notice}", scene.name);
        }
        self.loaded_hash = scene.hash;
        self.placements.replace(Wanted {
            is_config: true,
            notice: Some(Arc::from("")),
            waiting: replier.into_iter().map(Waiting::new).collect(),
            ..Wanted::version(scene, monotonic_ns(), None)
        });
        self.place();
    }

    /// Goes on with other settings, of the newest scene.
    pub(super) fn set_streaming(&mut self, values: &Map<String, Value>, replier: Replier) {
        let newest = self.placements.newest().map(|wanted| (&wanted.scene, wanted.animated_s));
        let is_running = newest.is_none();
        let (newest, animated_s) = newest.unwrap_or((&self.simulation.scene, Some(self.animated_s)));
        let scene = match settings::with_settings(newest, values) {
            Ok(scene) => scene,
            Err(SettingsError::Value(error)) => return replier.reply(edits::refusal(&error)),
            Err(error @ SettingsError::Threads) => {
                return replier.reply(Reply::error("invalid-value", error.to_string()));
            }
            Err(error) => return replier.reply(Reply::error("unknown-key", error.to_string())),
        };
        if !have_same_lights(newest, &scene) {
            self.placements.replace(Wanted::version(scene, monotonic_ns(), animated_s));
        } else if is_running {
            return replier.reply(self.show(scene, monotonic_ns()));
        }
        self.keep_waiting(Waiting::new(replier));
        self.place();
    }

    /// Lets somebody wait for the newest scene.
    fn keep_waiting(&mut self, waiting: Waiting) {
        match self.placements.newest() {
            Some(newest) => newest.waiting.push(waiting),
            None => waiting.replier.reply(Reply::error("internal", "nothing is left to wait for")),
        }
    }

    /// Has the next scene placed, as it is at the present instant, unless another one is.
    pub(super) fn place(&mut self) {
        let Some(mut wanted) = self.placements.take_next() else { return };
        if let Some(scene) = self.at_present(&wanted.scene, wanted.animated_s) {
            (wanted.scene, wanted.animated_s) = (scene, Some(self.clock.time_s()));
        }
        let (scene, shares) = (Arc::new(wanted.scene.clone()), wanted.shares.clone());
        let is_kept = wanted.is_config;
        let cancel = self.placements.begin(wanted);
        // A placer that is gone says so by another way.
        let order = Order { base: self.simulation.clone(), scene, shares, is_kept, cancel };
        let _ = self.to_placer.send(order);
    }

    /// Goes on with what the placer has made ready, if it is still wanted.
    pub(super) fn take_placed(&mut self, placed: Option<Box<Placed>>) {
        if let (Some(wanted), Some(placed)) = (self.placements.finish(), placed) {
            self.swap(*placed, wanted);
        }
        self.place();
    }

    /// Has lights moved to where the ledger wants them, if they are those that it knows, and no other scene is to come.
    pub(super) fn move_lights(&mut self, wish: LightsWanted) {
        if self.placements.are_awaited() || !Arc::ptr_eq(&wish.placement, &self.simulation.placement) {
            // It decides anew in the scene that comes.
            return;
        }
        let scene = Scene::clone(&self.simulation.scene);
        self.placements.append(Wanted {
            shares: Some(wish.shares),
            ..Wanted::version(scene, monotonic_ns(), Some(self.animated_s))
        });
        self.place();
    }

    fn swap(&mut self, placed: Placed, wanted: Wanted) {
        let Placed { simulation, moved } = placed;
        let has_other_settings = wanted.scene.streaming != self.simulation.scene.streaming;
        if wanted.is_config || has_other_settings {
            self.clock.set(wanted.scene.streaming.fixed_step_ms, publish_period(&wanted.scene));
        }
        // Where the size of something is animated, it is as it was when its lights began to be placed.
        let present = self.at_present(&wanted.scene, wanted.animated_s);
        let present = present.filter(|scene| simulation.has_lights_of(scene));
        let then_s = wanted.animated_s.unwrap_or_default();
        self.animated_s = if present.is_some() { self.clock.time_s() } else { then_s };
        let scene = present.unwrap_or(wanted.scene);
        let mut still = self.still.next(&scene);
        still.config_generation += u64::from(wanted.is_config);
        if let Some(notice) = wanted.notice {
            still.notice = notice;
        }
        // In fixed steps, it is shown whole before the next one.
        self.clock.wait();
        let simulation = simulation.with_scene(Arc::new(scene));
        let reply = match moved {
            Some(moved) => self.go_on_with(simulation, still, Asked::Nobody(moved)),
            None => self.go_on(simulation, still, wanted.received_ns),
        };
        for Waiting { replier, steps } in wanted.waiting {
            replier.reply(if steps { self.change(Change::Step) } else { reply.clone() });
        }
    }

    /// Keeps what is simulated, and says everywhere why.
    pub(super) fn refuse(&mut self, reason: &str) {
        tracing::warn!("the changed config is not shown, the last valid one stays: {reason}");
        self.tell_all(reason);
    }

    fn tell_all(&mut self, notice: &str) {
        let notice = Arc::from(notice);
        self.placements.tell(&notice);
        if self.still.notice == notice {
            return;
        }
        let mut still = self.still.next(&self.simulation.scene);
        still.notice = notice;
        let simulation = self.simulation.with_scene(Arc::clone(&self.simulation.scene));
        self.go_on(simulation, still, monotonic_ns());
    }

    /// Makes `scene`, a version with the lights of the present one, the one that is simulated and shown.
    fn show(&mut self, scene: Scene, received_ns: u64) -> Reply {
        let still = self.still.next(&scene);
        let simulation = self.simulation.with_scene(Arc::new(scene));
        self.go_on(simulation, still, received_ns)
    }

    pub(super) fn go_on(&mut self, simulation: Simulation, still: Still, received_ns: u64) -> Reply {
        self.go_on_with(simulation, still, Asked::At(received_ns))
    }

    fn go_on_with(&mut self, simulation: Simulation, still: Still, asked: Asked) -> Reply {
        (self.simulation, self.still) = (simulation, Arc::new(still));
        self.versions += 1;
        let version = Version {
            simulation: self.simulation.clone(),
            still: Arc::clone(&self.still),
            asked,
            time_s: self.animated_s,
            only_whole: self.clock.is_fixed() && !self.simulation.scene.animation.is_empty(),
        };
        match self.ask(|sender| ToLedger::Edit(Box::new(version), sender)) {
            Some(frame) => Reply::Ok { frame },
            None => Self::busy(),
        }
    }

    /// Whether anything in the scene is to move or to dim yet.
    pub(super) fn is_moving(&self) -> bool {
        is_moving(&self.simulation.scene, Some(self.animated_s))
    }

    /// When it is time to look at the animation; `None` where nothing moves, and where fixed steps wait for a scene.
    pub(super) fn due(&self) -> Option<Instant> {
        let is_held = self.clock.is_fixed() && self.placements.are_awaited();
        self.clock.next().filter(|_| self.is_moving() && !is_held)
    }

    /// Goes on to `now`.
    pub(super) fn tick(&mut self, now: Instant) {
        self.clock.tick(now);
        if self.animate() != Motion::Still {
            return;
        }
        let goes_on_alone = self.simulation.scene.streaming.adaptive || !self.simulation.is_streaming();
        if self.clock.is_fixed() && goes_on_alone {
            // It says when it has shown this instant; if it is gone, that is told by another way.
            let _ = self.to_ledger.send(ToLedger::Time(self.animated_s));
        } else {
            // There is nothing to wait for.
            self.clock.settled();
        }
    }

    /// Makes one step while time stands still.
    pub(super) fn step(&mut self, replier: Replier) {
        if self.clock.is_paused() {
            if self.placements.are_animated() {
                let reason = "the lights of the step before are being placed; try again";
                return replier.reply(Reply::error("busy", reason));
            }
            self.clock.step();
            if self.is_moving() && self.animate() == Motion::Awaited {
                return self.keep_waiting(Waiting { replier, steps: true });
            }
        }
        replier.reply(self.change(Change::Step));
    }

    /// Puts what is animated where it is now.
    fn animate(&mut self) -> Motion {
        if self.placements.are_animated() {
            return Motion::Awaited;
        }
        let received_ns = monotonic_ns();
        let before = Arc::clone(&self.simulation.scene);
        let Some(scene) = self.at_present(&before, Some(self.animated_s)) else {
            self.animated_s = self.clock.time_s();
            return Motion::Still;
        };
        if !self.simulation.has_lights_of(&scene) {
            // What is awaited is put where it is then; lights that only move have to wait.
            if !self.placements.are_awaited() || self.placements.are_moves() {
                self.placements.replace(Wanted {
                    is_animated: true,
                    ..Wanted::version(scene, received_ns, Some(self.clock.time_s()))
                });
                self.place();
            }
            return Motion::Awaited;
        }
        self.animated_s = self.clock.time_s();
        let is_still = Arc::ptr_eq(&scene.geometry, &before.geometry) && scene.lights == before.lights;
        if is_still {
            return Motion::Still;
        }
        self.show(scene, received_ns);
        Motion::Shown
    }

    /// A scene that shows the instant `animated_s` at the time that it is; `None` where nothing in it moves any more, or
    /// it cannot be there.
    fn at_present(&mut self, scene: &Scene, animated_s: Option<f64>) -> Option<Scene> {
        if !is_moving(scene, animated_s) {
            return None;
        }
        let mut edit = scene.edit();
        match scene.animation.apply(self.clock.time_s(), &mut edit) {
            Ok(()) => Some(edit.finish()),
            Err(error) => {
                let error = error.to_string();
                if self.animation_error != error {
                    tracing::warn!("the animation stands still: {error}");
                    self.animation_error = error;
                }
                None
            }
        }
    }
}

/// Whether anything in a scene that shows the instant `animated_s` of its animation is to move or to dim yet: what has
/// ended stays where edits put it.
fn is_moving(scene: &Scene, animated_s: Option<f64>) -> bool {
    let is_over = |end: f64| animated_s.is_some_and(|now| now >= end);
    !scene.animation.is_empty() && !scene.animation.end_s().is_some_and(is_over)
}

/// Time between two frames.
pub(super) fn publish_period(scene: &Scene) -> Duration {
    Duration::from_secs_f32(scene.streaming.publish_period_ms.max(0.1) / 1e3)
}

/// The clock of a scene's beginning.
pub(super) fn clock(scene: &Scene) -> Clock {
    Clock::new(scene.streaming.fixed_step_ms, publish_period(scene))
}
