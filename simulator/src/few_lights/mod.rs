//! Turns a scene into the few virtual lights of a method that keeps no photons: update by update, in microseconds.
//!
//! All methods fill the same records: renderers do not know which. The numbers of the lights stay the same for as long as the
//! scene's lights do; what does not shine has no flux. Source: paper B (METHODS §6).

mod axis;
mod constellation;
mod maps;
mod nearest;
mod photons;
mod sources;
#[cfg(test)]
mod tests;

use constellation::Constellation;
use core::f32::consts::SQRT_2;
use glam::Vec3;
use maps::Maps;
pub(crate) use maps::MapsChanged;
use photonstream_protocol::{PatchRecord, VslRecord};
use photonstream_running_light::{Phantom, PhantomSettings, SecondBounce, Spot, VirtualLight, VplId, update};
use photonstream_scene::{Method, ObjectId, Scene, VplSettings};
use photonstream_shading::{basis, sampling};
use sources::Source;
pub(crate) use sources::{POINTS, is_spot};
use std::time::Instant;

/// A phantom that has followed for so many time constants is at its target.
const FOLLOWED: f64 = 12.0;

/// The virtual lights of a method of few lights, and what it remembers from one update to the next.
#[derive(Debug)]
pub struct FewLights {
    method: Method,
    constellation: Constellation,
    /// One for each light of the scene, of which only spots use theirs.
    phantoms: Vec<Phantom>,
    /// What the phantoms followed last.
    aims: Vec<Option<Aim>>,
    /// Seconds until phantoms have followed.
    following_s: f64,
    flux: Vec<Vec3>,
    flux_of_light: Vec<Vec3>,
    active: Vec<VplId>,
    lights: Vec<Shown>,
    maps: Maps,
    update_us: f64,
}

/// A virtual light, and the object it lies on, as far as that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// The light; without flux where it does not shine.
    pub light: VirtualLight,
    /// What it moves with.
    pub object: Option<ObjectId>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Aim {
    spot: Spot,
    hit: Option<Vec3>,
}

impl Shown {
    const NONE: Self = Self {
        light: VirtualLight { position: Vec3::ZERO, normal: Vec3::Y, flux: Vec3::ZERO, area: 0.0 },
        object: None,
    };

    fn free(light: Option<VirtualLight>) -> Self {
        light.map_or(Self::NONE, |light| Self { light, object: None })
    }
}

impl FewLights {
    /// The lights of `method` in `scene`, before the first update.
    ///
    /// # Panics
    /// For [`Method::PhotonStreaming`], which is none of few lights, and [`Method::Auto`], which is none at all.
    pub fn new(scene: &Scene, method: Method) -> Self {
        assert!(is_of_few_lights(method), "{} is no method of few lights", method.name());
        let lights = scene.lights.len();
        Self {
            method,
            constellation: Constellation::new(scene),
            phantoms: vec![Phantom::new(); lights],
            aims: vec![None; lights],
            following_s: 0.0,
            flux: Vec::new(),
            flux_of_light: Vec::new(),
            active: Vec::new(),
            lights: vec![Shown::NONE; count(scene, method)],
            maps: Maps::default(),
            update_us: 0.0,
        }
    }

    /// Goes on to `scene`, a version of the one it was made for, in which `dt_s` seconds have passed.
    ///
    /// With an infinite time, phantoms are at their targets.
    pub fn update(&mut self, scene: &Scene, dt_s: f64) {
        let begun = Instant::now();
        let mut lights = std::mem::take(&mut self.lights);
        lights.clear();
        match self.method {
            Method::InstantRadiosity => self.follow_photons(scene, &mut lights),
            method => self.light_vpls(scene, method == Method::PhantomVpl, dt_s, &mut lights),
        }
        self.lights = lights;
        self.update_us = begun.elapsed().as_secs_f64() * 1e6;
        self.maps.follow(scene, &self.lights);
    }

    /// The lights of the last update: as many for any version of the scene.
    pub fn lights(&self) -> &[Shown] {
        &self.lights
    }

    /// How many of them shine.
    pub fn shining(&self) -> usize {
        self.lights.iter().filter(|shown| shown.light.flux != Vec3::ZERO).count()
    }

    /// What the last update took, µs, without distance maps.
    pub fn update_us(&self) -> f64 {
        self.update_us
    }

    /// Whether the lights go on changing in a scene that does not.
    pub fn is_following(&self) -> bool {
        self.following_s > 0.0 || self.constellation.is_weighing()
    }

    /// The lights of the last update as records.
    pub fn records(&self, generation: u32) -> Vec<VslRecord> {
        self.lights
            .iter()
            .map(|Shown { light, object }| VslRecord {
                generation,
                object: object.map_or(u32::MAX, |object| object.0),
                position: light.position.to_array(),
                area: light.area,
                normal: light.normal.normalize_or(Vec3::Y).to_array(),
                flux: light.flux.to_array(),
                ..VslRecord::default()
            })
            .collect()
    }

    /// The polygons of the lights of the last update: octagons of their areas, so that kernel `patch` is bounded and exact for
    /// them, too; none for what does not shine.
    pub fn patches(&self) -> Vec<PatchRecord> {
        self.lights.iter().map(|shown| octagon(&shown.light)).collect()
    }

    /// The distance maps that have changed since this was asked last; `None` where the scene asks for none.
    pub(crate) fn take_changed_maps(&mut self) -> Option<MapsChanged> {
        self.maps.take_changed()
    }

    /// All distance maps, one after the other; empty where the scene asks for none.
    pub fn distance_maps(&self) -> Vec<u32> {
        self.maps.all()
    }

    fn light_vpls(&mut self, scene: &Scene, has_phantoms: bool, dt_s: f64, lights: &mut Vec<Shown>) {
        self.constellation.follow(scene);
        let settings = &scene.vpls.settings;
        let sources = sources::of(scene);
        let is_phantom = |source: &Source| has_phantoms && source.spot.is_some();
        let is_static = |source: &&Source| !is_phantom(source) && !source.samples.is_empty();
        let statics: Vec<&Source> = sources.iter().filter(is_static).collect();
        let mut second: Vec<Shown> = Vec::new();
        if !statics.is_empty() {
            self.light_statics(scene, &statics, lights, &mut second);
        }
        self.follow_axes(scene, &sources, has_phantoms, dt_s);
        let bounce = second_bounce(settings);
        for (index, source) in sources.iter().enumerate().filter(|(_, source)| is_phantom(source)) {
            let Some(Aim { spot, hit }) = self.aims[index] else { continue };
            let dt = if self.following_s > 0.0 { dt_s as f32 } else { f32::INFINITY };
            let phantom_settings = PhantomSettings {
                area_per_weight: settings.area_per_weight,
                softening: settings.softening,
                time_constant: settings.smoothing_s,
            };
            let vpls = self.constellation.vpls();
            let phantom = self.phantoms[index].update(&spot, hit, vpls, &phantom_settings, dt);
            debug_assert!(source.spot.is_some());
            lights.push(Shown::free(phantom));
            if let Some(bounce) = bounce {
                second.push(Shown::free(phantom.and_then(|phantom| bounce.of_phantom(&phantom, &spot))));
            }
        }
        lights.extend(second);
    }

    /// The static VPLs, and one second bounce for each of the sources.
    fn light_statics(
        &mut self,
        scene: &Scene,
        sources: &[&Source],
        lights: &mut Vec<Shown>,
        second: &mut Vec<Shown>,
    ) {
        let settings = &scene.vpls.settings;
        let vpls = self.constellation.vpls();
        self.flux.resize(vpls.len(), Vec3::ZERO);
        self.flux_of_light.resize(vpls.len(), Vec3::ZERO);
        self.active.resize(vpls.len(), VplId(0));
        let invariant = "invariant: there is one flux for each VPL";
        let run = photonstream_running_light::UpdateSettings {
            area_per_weight: settings.area_per_weight,
            cull_intensity: settings.cull_intensity,
        };
        let all: Vec<_> = sources.iter().flat_map(|source| source.samples.iter().copied()).collect();
        self.constellation.with_visibility(scene, |vpls, visibility| {
            update(vpls, &all, visibility, &run, &mut self.flux, &mut self.active).expect(invariant);
        });
        if let Some(bounce) = second_bounce(settings) {
            let uncut = photonstream_running_light::UpdateSettings { cull_intensity: 0.0, ..run };
            for source in sources {
                self.constellation.with_visibility(scene, |vpls, visibility| {
                    let (of_light, active) = (&mut self.flux_of_light, &mut self.active);
                    update(vpls, &source.samples, visibility, &uncut, of_light, active).expect(invariant);
                });
                // Those that do not shine in the light of all sources send nothing on.
                for (own, total) in self.flux_of_light.iter_mut().zip(&self.flux) {
                    *own = if *total == Vec3::ZERO { Vec3::ZERO } else { *own };
                }
                let bounced =
                    bounce.of_constellation(self.constellation.vpls(), &self.flux_of_light, &source.whole);
                second.push(Shown::free(bounced.expect(invariant)));
            }
        }
        let shown = self.constellation.vpls().iter().zip(&self.flux).zip(&scene.vpls.vpls).map(
            |((vpl, &flux), placed)| Shown {
                light: VirtualLight {
                    position: vpl.position,
                    normal: vpl.normal,
                    flux,
                    area: vpl.weight * settings.area_per_weight,
                },
                object: placed.object,
            },
        );
        lights.extend(shown);
    }

    /// Finds where the axes of spots end now, and for how long phantoms have to follow them.
    fn follow_axes(&mut self, scene: &Scene, sources: &[Source], has_phantoms: bool, dt_s: f64) {
        let mut is_new = false;
        let mut has_moved = false;
        for (aim, source) in self.aims.iter_mut().zip(sources) {
            let Some(spot) = source.spot.filter(|_| has_phantoms) else { continue };
            let next = Some(Aim { spot, hit: axis::hit(scene, &spot) });
            is_new |= aim.is_none();
            has_moved |= *aim != next;
            *aim = next;
        }
        has_moved |= self.constellation.has_changed();
        let longest = FOLLOWED * f64::from(scene.vpls.settings.smoothing_s);
        self.following_s = match (is_new || !has_phantoms, has_moved) {
            (true, _) => 0.0,
            (false, true) if dt_s.is_finite() => longest,
            (false, _) => (self.following_s - dt_s).max(0.0),
        };
    }

    fn follow_photons(&mut self, scene: &Scene, lights: &mut Vec<Shown>) {
        let bounce = second_bounce(&scene.vpls.settings);
        let photons = photons::trace(scene);
        let mut second = Vec::new();
        for (source, of_light) in sources::of(scene).iter().zip(photons) {
            if let Some(bounce) = bounce {
                let (vpls, flux): (Vec<_>, Vec<_>) = of_light
                    .iter()
                    .map(|shown| (constellation::as_vpl(&shown.light), shown.light.flux))
                    .unzip();
                let bounced = bounce.of_constellation(&vpls, &flux, &source.whole);
                second.push(Shown::free(bounced.expect("invariant: there is one flux for each VPL")));
            }
            lights.extend(of_light);
        }
        photons::give_areas(scene, lights);
        lights.extend(second);
    }
}

/// Whether a method is one of few lights.
pub fn is_of_few_lights(method: Method) -> bool {
    matches!(method, Method::StaticVpl | Method::PhantomVpl | Method::InstantRadiosity)
}

/// The number of lights of a method of few lights in any version of a scene.
pub fn count(scene: &Scene, method: Method) -> usize {
    let spots = scene.lights.iter().filter(|light| is_spot(light)).count();
    let lights_of_vpls = scene.lights.iter().filter(|light| sources::lights_vpls(light)).count();
    let (first, sources) = match method {
        Method::StaticVpl if lights_of_vpls > 0 => (scene.vpls.vpls.len(), lights_of_vpls),
        Method::PhantomVpl if lights_of_vpls > spots => (scene.vpls.vpls.len() + spots, lights_of_vpls),
        Method::PhantomVpl => (spots, spots),
        Method::InstantRadiosity => (photons::counts(scene).iter().sum::<u32>() as usize, scene.lights.len()),
        _ => (0, 0),
    };
    first + if second_bounce(&scene.vpls.settings).is_some() { sources } else { 0 }
}

/// A regular octagon of a light's area around it, counter-clockwise as its lit side sees it.
fn octagon(light: &VirtualLight) -> PatchRecord {
    let mut record = PatchRecord::default();
    // 2√2 R² is its area.
    let radius = (light.area / (2.0 * SQRT_2)).sqrt();
    let normal = light.normal.normalize_or(Vec3::Y);
    if light.flux == Vec3::ZERO || !(radius > 0.0 && radius.is_finite()) {
        return record;
    }
    let (tangent, bitangent) = basis::tangents(normal);
    for (index, corner) in record.corners.chunks_exact_mut(3).enumerate() {
        let (sin, cos) = sampling::sin_cos_turn(index as f32 / 8.0);
        corner.copy_from_slice(&((tangent * cos + bitangent * sin) * radius).to_array());
    }
    (record.count, record.area) = (8, light.area);
    record
}

/// The settings of the second bounce, if there is to be one.
fn second_bounce(settings: &VplSettings) -> Option<SecondBounce> {
    (settings.second_bounce_distance > 0.0).then_some(SecondBounce {
        average_albedo: settings.second_bounce_albedo,
        distance: settings.second_bounce_distance,
    })
}
