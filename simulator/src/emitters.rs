//! Turns lights into slots of the path pool: who emits how many paths, into which column of flux, from which samples.

use crate::{split, streams::stream_of};
use glam::Vec3;
use photonstream_scene::{LightId, Scene};
use photonstream_shading::sobol::Sequence;
use std::ops::Range;

/// The slots of one light.
#[derive(Clone, Debug, PartialEq)]
pub struct LightSlots {
    /// The light.
    pub light: LightId,
    /// Its slots in the pool; contiguous, in the order of the lights.
    pub slots: Range<u32>,
    /// The column that its paths deposit in.
    pub column: u32,
    /// What a path carries at birth, relative to the unit of its column; 1 where the light has a column of its own.
    pub birth: Vec3,
    /// Its samples.
    pub sequence: Sequence,
    /// Watts it emits into the scene per unit of its power.
    pub watts_per_power: f32,
}

/// The lights whose deposits are summed together.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Its lights: one, or all that share the last column.
    pub lights: Range<u32>,
    /// Slots of its lights.
    pub slots: u32,
    /// For a shared column the watts that one unit of its deposits stands for; a column of one light takes its present
    /// power when it is published.
    pub shared_watts: Option<f32>,
}

/// The split of the pool among the lights; by default none for any of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Emitters {
    /// One entry a light, in their order.
    pub lights: Vec<LightSlots>,
    /// The columns of flux.
    pub columns: Vec<Column>,
    /// Slots of all lights.
    pub slots: u32,
}

impl Emitters {
    /// Splits `scene.streaming.pool_paths` slots by emitted power; at least one for each light, none without lights.
    pub fn new(scene: &Scene) -> Self {
        Self::with_slots(scene, &split::by_power(scene))
    }

    /// The same split for an edited version of the scene, whatever power its lights have now: slots keep their samples.
    pub fn with_scene(&self, scene: &Scene) -> Self {
        Self::with_slots(scene, &self.slot_counts())
    }

    /// Slots of each light.
    pub fn slot_counts(&self) -> Vec<u32> {
        self.lights.iter().map(|l| l.slots.end - l.slots.start).collect()
    }

    /// The emitters of a scene of which each light has the given number of slots; for no numbers at all, none.
    pub fn with_slots(scene: &Scene, slots: &[u32]) -> Self {
        let count = scene.lights.len();
        if count == 0 || slots.is_empty() {
            return Self::default();
        }
        let watts = watts(scene);
        let own = (scene.streaming.light_columns.max(1) as usize).min(count);
        let shares_last = count > own;
        let mut lights = Vec::with_capacity(count);
        let mut first = 0;
        for (index, light) in scene.lights.iter().enumerate() {
            lights.push(LightSlots {
                light: LightId(index as u32),
                slots: first..first + slots[index],
                column: index.min(own - 1) as u32,
                birth: Vec3::ONE,
                sequence: Sequence::new(scene.streaming.seed, stream_of(&light.name, 0)),
                watts_per_power: light.light.shape.watts_per_power(scene.bounds),
            });
            first += slots[index];
        }
        let mut columns: Vec<Column> = (0..own as u32)
            .map(|i| Column { lights: i..i + 1, slots: slots[i as usize], shared_watts: None })
            .collect();
        if shares_last {
            let column = &mut columns[own - 1];
            column.lights.end = count as u32;
            column.slots = slots[own - 1..].iter().sum();
            // A path of light l stands for P_l/n_l; in units in which the largest is 1.
            let per_path = |i: usize| watts[i] * (column.slots as f32 / slots[i] as f32);
            let unit = (own - 1..count).map(|i| per_path(i).max_element()).fold(0.0, f32::max);
            column.shared_watts = Some(unit);
            for (i, light) in lights.iter_mut().enumerate().skip(own - 1) {
                light.birth = if unit > 0.0 { per_path(i) / unit } else { Vec3::ZERO };
            }
        }
        Self { lights, columns, slots: first }
    }

    /// The light that `slot` belongs to.
    pub fn light_of(&self, slot: u32) -> &LightSlots {
        &self.lights[self.lights.partition_point(|l| l.slots.end <= slot)]
    }

    /// Watts per unit of each column's mean path, linear RGB, with the lights' present powers.
    pub fn column_watts(&self, scene: &Scene) -> Vec<Vec3> {
        self.columns
            .iter()
            .map(|column| match column.shared_watts {
                Some(watts) => Vec3::splat(watts),
                None => {
                    let light = &scene.lights[column.lights.start as usize].light;
                    light.power * light.shape.watts_per_power(scene.bounds)
                }
            })
            .collect()
    }
}

/// Watts that each light emits into the scene, linear RGB.
pub(crate) fn watts(scene: &Scene) -> Vec<Vec3> {
    scene.lights.iter().map(|l| l.light.power * l.light.shape.watts_per_power(scene.bounds)).collect()
}
