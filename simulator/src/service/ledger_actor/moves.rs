//! Turns whole light into the decision where virtual surface lights are to lie, once for each change of it.

use super::{LightsWanted, Progress};
use crate::budgets::Budgets;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// Time between two decisions on the clock, at least; each looks through the whole pool.
const BETWEEN: Duration = Duration::from_millis(100);

/// Where virtual surface lights are to lie.
pub(super) struct Moves {
    due: Due,
    /// The director was asked for others, which are to come.
    are_wanted: bool,
    /// No decision before.
    not_before: Instant,
}

/// When it is to be decided.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Due {
    Never,
    /// As soon as there is no light of an older version.
    Settled,
    /// Once more when the pool has its size again, which a latency target had taken from it.
    Full,
}

impl Moves {
    /// It was never decided.
    pub(super) fn new(now: Instant) -> Self {
        Self { due: Due::Settled, are_wanted: false, not_before: now }
    }

    /// Something has changed: the scene, or the lights that were wanted are there.
    pub(super) fn are_due(&mut self) {
        (self.due, self.are_wanted) = (Due::Settled, false);
    }
}

impl Progress {
    fn is_adaptive(&self) -> bool {
        self.simulation.scene.streaming.adaptive && self.simulation.is_streaming()
    }

    /// Whether virtual surface lights stay where they are, as far as is known; while paused they do.
    pub(super) fn has_lights_at_rest(&self) -> bool {
        let is_decided = self.moves.due == Due::Never && !self.moves.are_wanted;
        self.paused || ((is_decided || !self.is_adaptive()) && !self.is_on_its_way())
    }

    /// Whether all light is as exact as it will be.
    pub(super) fn has_converged(&self) -> bool {
        self.ledger.is_converged() && self.has_whole_maps() && self.has_lights_at_rest()
    }

    /// Whether lights go on changing in a scene that does not: they fade, or phantoms follow.
    pub(super) fn is_on_its_way(&self) -> bool {
        self.fade.is_some() || self.few.as_ref().is_some_and(|few| few.lights.is_following())
    }

    /// Nothing is refined that will have to be refined again, in other lights.
    pub(super) fn hold_or_refine(&mut self) {
        let is_decided = self.moves.due == Due::Never && !self.moves.are_wanted && self.fade.is_none();
        self.ledger.hold_refinement(self.is_adaptive() && !is_decided);
    }

    /// Room for so many virtual surface lights, so that those that move can be shown twice.
    pub(super) fn room(&self) -> usize {
        let placement = &self.simulation.placement;
        if let Some(few) = &self.few {
            return few.lights.lights().len();
        }
        if self.is_adaptive() { 2 * placement.owning() } else { placement.vsls.len() }
    }

    fn can_decide(&self) -> bool {
        let ledger = &self.ledger;
        let is_ready = match self.moves.due {
            Due::Never => false,
            Due::Settled => ledger.is_settled(),
            Due::Full => ledger.is_settled() && ledger.is_full(),
        };
        is_ready && self.is_adaptive() && !self.moves.are_wanted && self.fade.is_none() && self.shown_running
    }

    /// When the next decision may be made, if one is to be made of the present light.
    pub(super) fn next_decision(&self) -> Option<Instant> {
        self.can_decide().then_some(self.moves.not_before)
    }

    /// Where the scene is adaptive, and lights had better lie elsewhere, where: decided after each change, as soon as a frame
    /// of its whole light is out. Until they are there nothing is refined.
    pub(super) fn follow_light(&mut self) -> Option<LightsWanted> {
        let now = Instant::now();
        // In fixed steps of time it is decided in each of them, however long they take.
        let is_in_steps = self.is_in_steps();
        if !self.can_decide() || (now < self.moves.not_before && !is_in_steps) {
            return None;
        }
        self.moves.not_before = now + BETWEEN;
        self.moves.due = if self.ledger.is_full() { Due::Never } else { Due::Full };
        let (scene, placement) = (&self.simulation.scene, &self.simulation.placement);
        let reaching = self.ledger.reaching_watts(scene, placement);
        let budgets = Budgets::new(scene, placement, &reaching);
        let next = budgets.next().map(<[u32]>::to_vec);
        // Those that have faded out are not needed any more.
        let has_retiring = placement.owning() < placement.vsls.len();
        let next = next.or(has_retiring.then_some(budgets.present));
        let wanted = next.map(|shares| LightsWanted { placement: Arc::clone(placement), shares });
        self.moves.are_wanted = wanted.is_some();
        self.hold_or_refine();
        // The last frame did not say that all is done.
        self.changed |= wanted.is_none() && !is_in_steps;
        wanted
    }
}
