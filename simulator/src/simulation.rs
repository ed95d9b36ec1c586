//! Turns a scene into everything that streaming through it needs, and traces it without actors: for tests, benchmarks
//! and whoever embeds the simulator.

use crate::{
    budgets::Budgets,
    cancel::Cancel,
    change::Moved,
    emitters::{Emitters, LightSlots},
    exposure,
    few_lights::{self, FewLights},
    ledger::{Ledger, PATHS_PER_TASK},
    method::choose,
    owner::{
        OwnerTable,
        kept::{self, OwnerCache},
    },
    placement::Placement,
    tracer::{PathBatch, Tracer, Wave},
};
use photonstream_scene::{Method, Scene};
use rayon::prelude::*;
use std::sync::Arc;

/// A scene made ready for streaming. Immutable; shared by all threads.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its virtual surface lights.
    pub placement: Arc<Placement>,
    /// Who owns which hit.
    pub owners: Arc<OwnerTable>,
    /// How the pool is split among the lights.
    pub emitters: Arc<Emitters>,
    /// Traces paths through it.
    pub tracer: Tracer,
    /// The share of each light's patch that is not inside of something: [`exposure::shares`].
    pub exposed: Arc<[f32]>,
    /// How its light is simulated; never `auto`. For a method of few lights there are no virtual surface lights, and no
    /// pool: [`crate::few_lights::FewLights`] has the light.
    pub method: Method,
}

impl Simulation {
    /// Places virtual surface lights on `scene` and prepares everything else; the same on any number of threads.
    pub fn new(scene: Arc<Scene>) -> Self {
        Self::new_unless(scene, &Cancel::default()).expect("invariant: nobody else can cancel it")
    }

    /// [`Simulation::new`], or `None` soon after it was cancelled. Who owns what is kept where the process keeps things
    /// ([`photonstream_scene::kept`]).
    pub fn new_unless(scene: Arc<Scene>, cancel: &Cancel) -> Option<Self> {
        Self::made(scene, None, OwnerCache::of_this_process(), cancel)
    }

    fn made(
        scene: Arc<Scene>,
        base: Option<&Self>,
        cache: Option<&OwnerCache>,
        cancel: &Cancel,
    ) -> Option<Self> {
        let method = choose(&scene).method;
        if method != Method::PhotonStreaming {
            let (placement, emitters) = (Placement::default(), Arc::new(Emitters::default()));
            return Self::of_placement(scene, placement, emitters, None, cancel);
        }
        let are_adaptive =
            |base: &&Self| base.is_streaming() && base.scene.streaming.adaptive && scene.streaming.adaptive;
        let placement = match base.filter(are_adaptive) {
            // What has the same name is probably lit alike.
            Some(base) => base.placement.followed_unless(&base.scene, &scene, cancel)?,
            None => Placement::new_unless(&scene, cancel)?,
        };
        let emitters = Arc::new(Emitters::new(&scene));
        Self::of_placement(scene, placement, emitters, cache, cancel)
    }

    fn of_placement(
        scene: Arc<Scene>,
        mut placement: Placement,
        emitters: Arc<Emitters>,
        cache: Option<&OwnerCache>,
        cancel: &Cancel,
    ) -> Option<Self> {
        let owners = match cache {
            Some(cache) => cache.owners(&scene, &mut placement, cancel)?,
            None => kept::computed(&scene, &mut placement, cancel)?,
        };
        let owners = Arc::new(owners);
        let tracer = Tracer::new(Arc::clone(&scene), Arc::clone(&owners), Arc::clone(&emitters));
        let exposed = exposure::shares(&scene, &placement).into();
        let (placement, method) = (Arc::new(placement), choose(&scene).method);
        cancel.or(Self { scene, placement, owners, emitters, tracer, exposed, method })
    }

    /// Whether photons are traced: else its light is that of a method of few lights.
    pub fn is_streaming(&self) -> bool {
        self.method == Method::PhotonStreaming
    }

    /// The lights of a method of few lights, before their first update; `None` where photons are streamed.
    pub fn few_lights(&self) -> Option<FewLights> {
        (!self.is_streaming()).then(|| FewLights::new(&self.scene, self.method))
    }

    /// The number of virtual lights that are published: of placed ones, or of a method of few.
    pub fn published_lights(&self) -> usize {
        if self.is_streaming() {
            return self.placement.vsls.len();
        }
        few_lights::count(&self.scene, self.method)
    }

    /// The same scene with other numbers of virtual surface lights on its surfaces, in their order; the pool is split as
    /// before, so that [`crate::ledger::Migration`] keeps every path. `None` soon after it was cancelled.
    ///
    /// # Panics
    /// If there are not as many shares as surfaces.
    pub fn with_shares_unless(&self, shares: &[u32], cancel: &Cancel) -> Option<Self> {
        let placement = self.placement.with_shares_unless(&self.scene, shares, cancel)?;
        Self::of_placement(Arc::clone(&self.scene), placement, Arc::clone(&self.emitters), None, cancel)
    }

    /// Where the scene is adaptive, with virtual surface lights where the light of its filled pool is; else the same.
    pub fn adapted(self) -> Self {
        if !self.scene.streaming.adaptive || !self.is_streaming() {
            return self;
        }
        let reaching = self.fill().reaching_watts(&self.scene, &self.placement);
        let budgets = Budgets::new(&self.scene, &self.placement, &reaching);
        let cancel = Cancel::default();
        match budgets.next() {
            Some(shares) => {
                self.with_shares_unless(shares, &cancel).expect("invariant: nobody else can cancel it")
            }
            None => self,
        }
    }

    /// Whether the virtual surface lights of `scene` are those of this simulation: a version of its scene in which no
    /// object has another mesh, with the same settings.
    pub fn has_lights_of(&self, scene: &Scene) -> bool {
        have_same_lights(&self.scene, scene)
    }

    /// The same simulation in an edited version of its scene: the virtual surface lights ride with their objects, and the
    /// pool is split as before, whatever power the lights have now.
    pub fn with_scene(&self, scene: Arc<Scene>) -> Self {
        let exposed = self.exposed_in(&scene);
        let emitters = Arc::new(self.emitters.with_scene(&scene));
        let tracer = Tracer::new(Arc::clone(&scene), Arc::clone(&self.owners), Arc::clone(&emitters));
        Self {
            scene,
            placement: Arc::clone(&self.placement),
            owners: Arc::clone(&self.owners),
            emitters,
            tracer,
            exposed,
            method: self.method,
        }
    }

    fn exposed_in(&self, scene: &Scene) -> Arc<[f32]> {
        if Arc::ptr_eq(&self.scene.geometry, &scene.geometry) {
            return Arc::clone(&self.exposed);
        }
        let Moved { has_moved, obstacles } = Moved::between(&self.scene, scene);
        if obstacles.is_empty() {
            return Arc::clone(&self.exposed);
        }
        exposure::followed(&self.exposed, scene, &self.placement, &has_moved, &obstacles).into()
    }

    /// Another scene in the place of this one, with lights placed anew. Where the lights and the size of the pool are the
    /// same, the pool is split as before, so that no path is lost to another power.
    pub fn reloaded(&self, scene: Arc<Scene>) -> Self {
        self.reloaded_unless(scene, &Cancel::default()).expect("invariant: nobody else can cancel it")
    }

    /// [`Simulation::reloaded`], or `None` soon after it was cancelled.
    pub fn reloaded_unless(&self, scene: Arc<Scene>, cancel: &Cancel) -> Option<Self> {
        Some(Self::made(scene, Some(self), None, cancel)?.with_split_of(self))
    }

    /// [`Simulation::reloaded_unless`], with who owns what kept as by [`Simulation::new_unless`]: for scenes that may come again.
    pub(crate) fn reloaded_and_kept_unless(&self, scene: Arc<Scene>, cancel: &Cancel) -> Option<Self> {
        let cache = OwnerCache::of_this_process();
        Some(Self::made(scene, Some(self), cache, cancel)?.with_split_of(self))
    }

    /// A ledger with an empty pool.
    pub fn ledger(&self) -> Ledger {
        Ledger::new(&self.scene, Arc::clone(&self.emitters), self.placement.vsls.len())
    }

    /// Traces `tasks` tasks, or until there is nothing left to trace, on the present rayon pool.
    pub fn advance(&self, ledger: &mut Ledger, tasks: u64) {
        const BLOCK: u64 = 64;
        let mut left = tasks;
        loop {
            let block: Vec<_> =
                std::iter::from_fn(|| ledger.next_task()).take(left.min(BLOCK) as usize).collect();
            if block.is_empty() {
                return;
            }
            left -= block.len() as u64;
            let batches: Vec<PathBatch> = block
                .par_iter()
                .map_init(Wave::default, |wave, task| {
                    let mut batch = PathBatch::default();
                    self.tracer.resume(&task.draws, &task.begun, wave, &mut batch);
                    batch
                })
                .collect();
            for (task, batch) in block.into_iter().zip(batches) {
                ledger.apply(task, batch, 0);
            }
        }
    }

    /// The ledger after every slot has been traced once.
    pub fn fill(&self) -> Ledger {
        let mut ledger = self.ledger();
        let tasks = |l: &LightSlots| u64::from((l.slots.end - l.slots.start).div_ceil(PATHS_PER_TASK));
        self.advance(&mut ledger, self.emitters.lights.iter().map(tasks).sum());
        ledger
    }
}

/// Whether two versions of a scene have the same virtual surface lights: [`Simulation::has_lights_of`].
pub(crate) fn have_same_lights(a: &Scene, b: &Scene) -> bool {
    let are_like =
        Arc::ptr_eq(&a.geometry.rest_vertices, &b.geometry.rest_vertices) && a.streaming == b.streaming;
    // Edits of VPLs may leave `auto` another choice.
    are_like && (a.streaming.method != Method::Auto || choose(a).method == choose(b).method)
}
