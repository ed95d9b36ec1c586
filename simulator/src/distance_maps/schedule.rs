//! Turns placements and versions of a scene into maps to trace, the coarse ones of all lights first, and keeps what was traced.

use super::{Extent, Map, MapTask, Traced, View, words};
use crate::{change::Moved, disturbance::Obstacle, simulation::Simulation, vsl::Vsl};
use photonstream_scene::Scene;
use std::{
    collections::{HashMap, VecDeque},
    sync::Arc,
};

/// A map is traced as a whole rather than by more obstacles than this.
const MOST_OBSTACLES: usize = 16;

/// The maps of all lights of a placement, and what is to be done about them.
#[derive(Debug)]
pub struct Schedule {
    /// Tells its tasks from those of others.
    number: u64,
    simulation: Simulation,
    edge: u32,
    lights: Vec<Light>,
    queue: VecDeque<u32>,
    /// Where something was or is, change by change, for as long as a map has not followed.
    changes: Vec<Arc<[Obstacle]>>,
    in_flight: usize,
    changed: Vec<u32>,
    is_changed: Vec<bool>,
}

#[derive(Clone, Debug)]
struct Light {
    map: Map,
    pending: Pending,
    is_queued: bool,
    is_in_flight: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Pending {
    Nothing,
    Coarse,
    Whole,
    /// What changes from this one on have touched.
    Since(usize),
}

impl Schedule {
    /// All maps of a simulation's lights, none of them traced; `None` where its scene asks for no maps.
    /// What was begun by a schedule of another `number` is not its own.
    pub fn new(simulation: &Simulation, number: u64) -> Option<Self> {
        let edge = simulation.scene.streaming.distance_map_px;
        if edge == 0 {
            return None;
        }
        let count = simulation.placement.vsls.len();
        // What nobody has looked at hides nothing.
        let empty: Map = vec![0; words(edge)].into();
        let light = Light { map: empty, pending: Pending::Coarse, is_queued: true, is_in_flight: false };
        Some(Self {
            number,
            simulation: simulation.clone(),
            edge,
            lights: vec![light; count],
            queue: scattered(count as u32).collect(),
            changes: Vec::new(),
            in_flight: 0,
            changed: (0..count as u32).collect(),
            is_changed: vec![true; count],
        })
    }

    /// Goes on with other lights in the place of `old`: those that stay where they are keep their maps, `traced` has those
    /// of others that are known, by number, as `traced_in` shows them. What was begun by the old schedule is lost.
    pub fn following(
        old: Self,
        simulation: &Simulation,
        number: u64,
        traced: Vec<(u32, Map)>,
        traced_in: &Scene,
    ) -> Option<Self> {
        let mut next = Self::new(simulation, number)?;
        if next.edge != old.edge {
            return Some(next);
        }
        let before = old.simulation.placement.vsls.iter().map(Vsl::place).zip(&old.lights);
        let before: HashMap<_, _> = before.collect();
        for (light, vsl) in next.lights.iter_mut().zip(&simulation.placement.vsls) {
            let Some(old) = before.get(&vsl.place()) else { continue };
            light.map = Arc::clone(&old.map);
            light.pending = match old.pending {
                // What was being done is not.
                _ if old.is_in_flight => Pending::Whole,
                Pending::Since(_) => Pending::Whole,
                pending => pending,
            };
        }
        let is_same = Arc::ptr_eq(&traced_in.geometry, &old.simulation.scene.geometry);
        for (vsl, map) in traced {
            let light = &mut next.lights[vsl as usize];
            light.map = map;
            light.pending = if is_same { Pending::Nothing } else { Pending::Whole };
        }
        // What has moved since.
        next.simulation.scene = Arc::clone(&old.simulation.scene);
        next.revise(simulation);
        let Self { queue, lights, .. } = &mut next;
        queue.retain(|&vsl| {
            let light = &mut lights[vsl as usize];
            light.is_queued = light.pending != Pending::Nothing;
            light.is_queued
        });
        Some(next)
    }

    /// Edge of the maps in texels.
    pub fn edge(&self) -> u32 {
        self.edge
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether there is no light.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Tasks handed out and not finished.
    pub fn in_flight(&self) -> usize {
        self.in_flight
    }

    /// Whether every map is that of the present scene.
    pub fn is_whole(&self) -> bool {
        self.in_flight == 0 && self.queue.is_empty()
    }

    /// The map of a light, as far as it is traced.
    pub fn map(&self, vsl: u32) -> &Map {
        &self.lights[vsl as usize].map
    }

    /// Takes the lights whose maps have changed since this was asked last.
    pub fn take_changed(&mut self) -> Vec<(u32, Map)> {
        let Self { changed, is_changed, lights, .. } = self;
        let taken = changed.drain(..).map(|vsl| {
            is_changed[vsl as usize] = false;
            (vsl, Arc::clone(&lights[vsl as usize].map))
        });
        taken.collect()
    }

    /// The next map to trace; `None` where there is none.
    pub fn next_task(&mut self) -> Option<MapTask> {
        while let Some(vsl) = self.queue.pop_front() {
            let light = &mut self.lights[vsl as usize];
            light.is_queued = false;
            let view =
                View::of(&self.simulation.scene.geometry, &self.simulation.placement.vsls[vsl as usize]);
            let extent = match std::mem::replace(&mut light.pending, Pending::Nothing) {
                Pending::Nothing => continue,
                Pending::Coarse => Extent::Coarse,
                Pending::Whole => Extent::Whole,
                Pending::Since(first) => {
                    let obstacles: Vec<Obstacle> =
                        self.changes[first..].iter().flat_map(|c| c.iter()).copied().collect();
                    match obstacles.len() {
                        0..=MOST_OBSTACLES => Extent::Crossed(obstacles.into()),
                        _ => Extent::Whole,
                    }
                }
            };
            light.is_in_flight = true;
            self.in_flight += 1;
            let (scene, before) = (Arc::clone(&self.simulation.scene), Arc::clone(&light.map));
            return Some(MapTask { schedule: self.number, scene, vsl, view, extent, before });
        }
        if self.in_flight == 0 {
            // Every map has followed all changes.
            self.changes.clear();
        }
        None
    }

    /// Takes in what was traced, unless it was begun by another schedule.
    pub fn finish(&mut self, traced: Traced) {
        if traced.schedule != self.number {
            return;
        }
        self.in_flight -= 1;
        let light = &mut self.lights[traced.vsl as usize];
        light.is_in_flight = false;
        if !Arc::ptr_eq(&light.map, &traced.map) {
            light.map = traced.map;
            if !std::mem::replace(&mut self.is_changed[traced.vsl as usize], true) {
                self.changed.push(traced.vsl);
            }
        }
        if traced.was_coarse {
            light.pending = Pending::Whole;
        }
        self.enqueue(traced.vsl);
    }

    /// Goes on in another version of the scene with the same lights.
    pub fn revise(&mut self, next: &Simulation) {
        let old = std::mem::replace(&mut self.simulation, next.clone());
        if Arc::ptr_eq(&old.scene.geometry, &next.scene.geometry) {
            return;
        }
        let Moved { has_moved, obstacles } = Moved::between(&old.scene, &next.scene);
        if obstacles.is_empty() {
            return;
        }
        let obstacles: Arc<[Obstacle]> = obstacles.into();
        let number = self.changes.len();
        self.changes.push(Arc::clone(&obstacles));
        for index in 0..self.lights.len() {
            let vsl = &next.placement.vsls[index];
            let light = &mut self.lights[index];
            light.pending = match light.pending {
                Pending::Coarse => Pending::Coarse,
                _ if has_moved[vsl.surface.object.0 as usize] => Pending::Whole,
                Pending::Nothing => {
                    let view = View::of(&next.scene.geometry, vsl);
                    if !obstacles.iter().any(|o| view.faces(o)) {
                        continue;
                    }
                    Pending::Since(number)
                }
                pending => pending,
            };
            self.enqueue(index as u32);
        }
    }

    /// Puts a light at the end of the queue, if it has to be in it: one whose map is being traced comes back later.
    fn enqueue(&mut self, vsl: u32) {
        let light = &mut self.lights[vsl as usize];
        if light.pending != Pending::Nothing && !light.is_queued && !light.is_in_flight {
            light.is_queued = true;
            self.queue.push_back(vsl);
        }
    }
}

/// The numbers below `count` in an order in which neighbours are far apart, so that all parts of a scene come at once.
fn scattered(count: u32) -> impl Iterator<Item = u32> {
    let bits = u32::BITS - count.saturating_sub(1).leading_zeros();
    (0..1u32.checked_shl(bits).unwrap_or(0))
        .map(move |i| if bits == 0 { 0 } else { i.reverse_bits() >> (u32::BITS - bits) })
        .filter(move |&i| i < count)
}
