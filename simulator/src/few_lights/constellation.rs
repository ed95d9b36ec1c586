//! Turns predefined VPLs and blockers into where they are now, and what the VPLs weigh.

use glam::Vec3;
use photonstream_running_light::{
    AmortisedWeights, Blocker, ShadowRay, VirtualLight, Visibility, Vpl, automatic_weights,
};
use photonstream_scene::{
    Geometry, Scene, VplSet, VplVisibility, Weights,
    bvh::Ray,
    vpls::{self, moved_normal},
};
use std::sync::Arc;

/// Rays begin so far off a VPL along its normal, relative to the radius of the scene: VPLs are placed by hand, too.
const LIFT: f32 = 2e-4;

/// Rays to a light end so much before it, relative to their length.
const SHORT_OF_LIGHT: f32 = 1e-4;

/// VPLs and blockers in one version of a scene.
#[derive(Debug, Default)]
pub(super) struct Constellation {
    vpls: Vec<Vpl>,
    /// The same, a little off their surfaces, for rays.
    lifted: Vec<Vpl>,
    blockers: Vec<Blocker>,
    amortised: AmortisedWeights,
    /// Comparisons until all weights are those of the present places.
    steps_left: usize,
    of: Option<(Arc<VplSet>, Arc<Geometry>)>,
    has_changed: bool,
}

impl Constellation {
    pub(super) fn new(scene: &Scene) -> Self {
        let mut constellation = Self::default();
        constellation.follow(scene);
        constellation
    }

    /// Goes on to a version of the scene: nothing is done where nothing has moved, but for one step of amortised weights.
    pub(super) fn follow(&mut self, scene: &Scene) {
        let is_same = self.of.as_ref().is_some_and(|(set, geometry)| {
            Arc::ptr_eq(set, &scene.vpls) && Arc::ptr_eq(geometry, &scene.geometry)
        });
        self.has_changed = false;
        let settings = &scene.vpls.settings;
        if !is_same {
            let last = self.of.replace((Arc::clone(&scene.vpls), Arc::clone(&scene.geometry)));
            let before = std::mem::take(&mut self.vpls);
            self.place(scene, &before);
            self.has_changed = self.vpls != before;
            let is_weighed_alike = last.is_some_and(|(last, _)| are_weighed_alike(&last, &scene.vpls));
            // Where all are given, or nothing has come closer, there is nothing to compare.
            let are_due = !(is_weighed_alike && self.are_where(&before));
            match settings.weights {
                _ if !(are_due && scene.vpls.vpls.iter().any(|vpl| vpl.weight.is_none())) => {}
                Weights::Amortised if is_weighed_alike => {
                    self.steps_left = self.amortised.steps_until_whole(self.vpls.len());
                }
                _ => {
                    automatic_weights(&mut self.vpls, settings.area_per_weight);
                    (self.amortised, self.steps_left) = (AmortisedWeights::new(), 0);
                }
            }
        } else if self.steps_left == 0 {
            return;
        }
        if self.steps_left > 0 {
            self.amortised.step(&mut self.vpls, settings.area_per_weight);
            self.steps_left -= 1;
        }
        for (vpl, placed) in self.vpls.iter_mut().zip(&scene.vpls.vpls) {
            vpl.weight = placed.weight.unwrap_or(vpl.weight);
        }
        let lift = LIFT * scene.bounds.radius;
        self.lifted.clear();
        let lifted = self.vpls.iter().map(|vpl| Vpl { position: vpl.position + vpl.normal * lift, ..*vpl });
        self.lifted.extend(lifted);
    }

    /// Whether the last version had other VPLs, or in other places.
    pub(super) fn has_changed(&self) -> bool {
        self.has_changed
    }

    /// Whether weights go on changing in a scene that does not.
    pub(super) fn is_weighing(&self) -> bool {
        self.steps_left > 0
    }

    pub(super) fn vpls(&self) -> &[Vpl] {
        &self.vpls
    }

    /// Calls `f` with the VPLs and what stands between them and lights.
    pub(super) fn with_visibility<T>(
        &self,
        scene: &Scene,
        f: impl FnOnce(&[Vpl], &mut Visibility<'_>) -> T,
    ) -> T {
        match scene.vpls.settings.visibility {
            VplVisibility::None => f(&self.vpls, &mut Visibility::None),
            VplVisibility::Blockers => f(&self.vpls, &mut Visibility::Blockers(&self.blockers)),
            VplVisibility::Rays => {
                let mut ask = |ray: ShadowRay| {
                    let t_max = ray.distance * (1.0 - SHORT_OF_LIGHT);
                    let ray = Ray { origin: ray.origin, direction: ray.direction, t_max };
                    if scene.bvh.occluded(&ray) { 0.0 } else { 1.0 }
                };
                f(&self.lifted, &mut Visibility::Asked(&mut ask))
            }
        }
    }

    /// Whether there are as many as `before`, in the same places.
    fn are_where(&self, before: &[Vpl]) -> bool {
        let places = |vpls: &[Vpl]| vpls.iter().map(|vpl| vpl.position).collect::<Vec<_>>();
        places(&self.vpls) == places(before)
    }

    fn place(&mut self, scene: &Scene, before: &[Vpl]) {
        let VplSet { vpls, blockers, .. } = &*scene.vpls;
        // Weights that are not given stay what they were until they are computed anew.
        let weights = before.iter().map(|vpl| vpl.weight).chain(std::iter::repeat(1.0));
        self.vpls.clear();
        self.vpls.extend(vpls.iter().zip(weights).map(|(placed, before)| {
            let vpls::Vpl { position, normal, albedo, weight, object } = *placed;
            let map = scene.world_from_anchor(object);
            Vpl {
                position: map.transform_point3(position).as_vec3(),
                normal: moved_normal(&map.matrix3, normal).as_vec3().normalize_or(Vec3::Y),
                albedo,
                weight: weight.unwrap_or(before),
            }
        }));
        self.blockers.clear();
        self.blockers.extend(blockers.iter().map(|blocker| {
            let map = scene.world_from_anchor(blocker.object);
            Blocker::new(map.transform_point3(blocker.centre).as_vec3(), blocker.radius)
        }));
    }
}

/// Whether two sets have as many VPLs, which have or lack weights alike, in the same unit.
fn are_weighed_alike(a: &VplSet, b: &VplSet) -> bool {
    let are_given = |set: &VplSet| set.vpls.iter().map(|vpl| vpl.weight.is_some()).collect::<Vec<_>>();
    a.settings.area_per_weight == b.settings.area_per_weight
        && a.settings.weights == b.settings.weights
        && are_given(a) == are_given(b)
}

/// A virtual light as a place that reflects: what a second bounce is made from.
pub(super) fn as_vpl(light: &VirtualLight) -> Vpl {
    Vpl { position: light.position, normal: light.normal, albedo: Vec3::ONE, weight: 1.0 }
}
