//! Turns the paths in the pool into the light that each surface sends to others.

use super::{Ledger, PATHS_LOOKED_AT};
use crate::{flux::QUANTUM, placement::Placement, trail::Event, vsl::Surface};
use glam::Vec3;
use photonstream_scene::{ObjectId, Scene};
use photonstream_shading::tone::luminance;
use rayon::prelude::*;

/// What the paths of one light have left on a surface, in quanta per channel: sums of whole numbers, the same in any order.
#[derive(Clone, Copy, Debug, Default)]
struct Left {
    all: [i64; 3],
    /// What then reached something, and what left the scene. The rest went no further.
    reaching: [i64; 3],
    lost: [i64; 3],
}

impl Ledger {
    /// The watts (luminance) that reach something from each surface of `placement`, with the lights' present powers, in their
    /// order: the flux of the surface times the share of it that went on to hit something, of all that went on. The same on any
    /// number of threads.
    pub fn reaching_watts(&self, scene: &Scene, placement: &Placement) -> Vec<f64> {
        let mut watts = vec![0.0; placement.surfaces.len()];
        let scales = self.pool_scales(scene);
        let index = surface_index(scene, placement);
        for light in &self.emitters.lights {
            let scale = &scales[light.column as usize];
            if scale.watts == Vec3::ZERO {
                continue;
            }
            let per_path = QUANTUM / f64::from(scale.paths.max(1));
            let weigh = |quanta: [i64; 3]| {
                let paths = Vec3::from(quanta.map(|quanta| (quanta as f64 * per_path) as f32));
                f64::from(luminance(paths * scale.watts))
            };
            let left = self.left_by(light.slots.clone(), scene, &index, watts.len());
            for (watts, left) in watts.iter_mut().zip(left) {
                let (reaching, lost) = (weigh(left.reaching), weigh(left.lost));
                if reaching > 0.0 {
                    *watts += weigh(left.all) * reaching / (reaching + lost);
                }
            }
        }
        watts
    }

    /// What the paths in `slots` have left on each surface.
    fn left_by(
        &self,
        slots: std::ops::Range<u32>,
        scene: &Scene,
        index: &[[u32; 2]],
        surfaces: usize,
    ) -> Vec<Left> {
        let none = || vec![Left::default(); surfaces];
        let starts: Vec<u32> = slots.clone().step_by(PATHS_LOOKED_AT).collect();
        starts
            .into_par_iter()
            .fold(none, |mut sums, start| {
                for slot in start..slots.end.min(start + PATHS_LOOKED_AT as u32) {
                    self.add(slot, scene, index, &mut sums);
                }
                sums
            })
            .reduce(none, |mut a, b| {
                for (a, b) in a.iter_mut().zip(b) {
                    add(&mut a.all, b.all);
                    add(&mut a.reaching, b.reaching);
                    add(&mut a.lost, b.lost);
                }
                a
            })
    }

    fn add(&self, slot: u32, scene: &Scene, index: &[[u32; 2]], sums: &mut [Left]) {
        let Some(path) = self.pool.whole_path(slot) else { return };
        let mut deposits = path.deposits.iter();
        for (place, vertex) in path.vertices.iter().enumerate() {
            let Event::Hit { triangle, side, deposited: true } = vertex.event() else { continue };
            let Some(deposit) = deposits.next() else { return };
            let object = scene.geometry.object_of[triangle as usize];
            let Some(left) = sums.get_mut(index[object.0 as usize][side as usize] as usize) else { continue };
            let quanta = deposit.rgb.map(i64::from);
            add(&mut left.all, quanta);
            match path.vertices.get(place + 1).map(|next| next.event()) {
                Some(Event::Hit { .. }) => add(&mut left.reaching, quanta),
                Some(Event::Escaped) => add(&mut left.lost, quanta),
                Some(Event::Emitted) | None => {}
            }
        }
    }
}

fn add(sum: &mut [i64; 3], more: [i64; 3]) {
    sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}

/// The place of each object's front and back among the surfaces; beyond all of them where it has none.
fn surface_index(scene: &Scene, placement: &Placement) -> Vec<[u32; 2]> {
    let mut index = vec![[u32::MAX; 2]; scene.objects.len()];
    for (place, (Surface { object: ObjectId(object), side }, _)) in placement.surfaces.iter().enumerate() {
        index[*object as usize][*side as usize] = place as u32;
    }
    index
}
