//! Turns the records of a frame into what each of them is to a method of few lights, which no record says.

use super::Places;
use crate::following::Published;
use glam::Vec3;
use photonstream_scene::{LightId, Method, Scene, VplSet};
use photonstream_shading::LightShape;

/// A record of a VPL is at its place within this share of the scene's radius.
const NEAR: f64 = 1e-3;

/// A published light that is no predefined VPL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mark {
    /// Where the beam of this spot ends.
    Phantom(LightId),
    /// Where the light of this light comes from after two reflections.
    SecondBounce(LightId),
    /// Of instant radiosity.
    Photon,
}

/// What the records of a frame are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Roles {
    /// So many of the first records are the VPLs in their order.
    pub(crate) statics: usize,
    /// The others, by their numbers.
    pub(crate) marks: Vec<(usize, Mark)>,
}

impl Roles {
    /// What the records are by the method of the scene's text, or by another one whose counts and places they fit: the method of
    /// a running simulation can be changed. No roles for the lights of photon streaming.
    pub(crate) fn of(published: &Published, set: &VplSet) -> Self {
        let scene = &published.scene;
        let named = scene.streaming.method;
        let bounces = set.settings.second_bounce_distance > 0.0;
        for method in [named, Method::StaticVpl, Method::PhantomVpl] {
            for second in [bounces, !bounces] {
                let marks = after_statics(scene, method, second);
                let Some(statics) = published.frame.vsls.len().checked_sub(marks.len()) else { continue };
                // Right after an edit there are as many VPLs as there were.
                let is_expected = method == named && second == bounces;
                let is_of_statics = matches!(method, Method::StaticVpl | Method::PhantomVpl);
                let has_statics = statics > 0 && are_there(published, set, statics);
                let has_none = statics == 0 && (set.vpls.is_empty() || !lights_statics(scene, method));
                let fits = has_none || has_statics && lights_statics(scene, method);
                if is_of_statics && fits && (is_expected || has_none || statics == set.vpls.len()) {
                    let marks = marks.into_iter().enumerate();
                    return Self { statics, marks: marks.map(|(i, mark)| (statics + i, mark)).collect() };
                }
            }
        }
        Self::of_photons(published, bounces)
    }

    fn of_photons(published: &Published, bounces: bool) -> Self {
        let scene = &published.scene;
        let count = published.frame.vsls.len();
        let second = if bounces { scene.lights.len() } else { 0 };
        match (scene.streaming.method, count.checked_sub(second)) {
            (Method::InstantRadiosity, Some(photons)) => {
                let of_lights = (0u32..).take(second).map(|light| Mark::SecondBounce(LightId(light)));
                let marks = std::iter::repeat_n(Mark::Photon, photons).chain(of_lights);
                Self { statics: 0, marks: marks.enumerate().collect() }
            }
            _ => Self::default(),
        }
    }
}

fn is_spot(scene: &Scene, LightId(id): LightId) -> bool {
    matches!(scene.lights[id as usize].light.shape, LightShape::Spot { .. })
}

/// Whether a method publishes the VPLs themselves.
fn lights_statics(scene: &Scene, method: Method) -> bool {
    match method {
        Method::PhantomVpl => lights(scene).any(|light| !is_spot(scene, light)),
        Method::StaticVpl => !scene.lights.is_empty(),
        _ => false,
    }
}

fn lights(scene: &Scene) -> impl Iterator<Item = LightId> + Clone {
    (0u32..).take(scene.lights.len()).map(LightId)
}

/// What a method publishes after its VPLs, in order.
fn after_statics(scene: &Scene, method: Method, second: bool) -> Vec<Mark> {
    let (spots, others): (Vec<_>, Vec<_>) = match method {
        Method::PhantomVpl => lights(scene).partition(|&light| is_spot(scene, light)),
        _ => (Vec::new(), lights(scene).collect()),
    };
    let phantoms = spots.iter().map(|&light| Mark::Phantom(light));
    let bounced = others.iter().chain(&spots).map(|&light| Mark::SecondBounce(light)).filter(|_| second);
    phantoms.chain(bounced).collect()
}

/// Whether at least half of the first records, as far as there are VPLs for them, are where those are: what is being
/// moved is published a little later.
fn are_there(published: &Published, set: &VplSet, statics: usize) -> bool {
    let places = Places::of(published);
    let near = NEAR * f64::from(published.scene.bounds.radius);
    let pairs = set.vpls.iter().zip(published.frame.vsls.iter().take(statics));
    let (mut pairs_seen, mut there) = (0, 0);
    for (vpl, record) in pairs {
        pairs_seen += 1;
        let at = Vec3::from(record.position).as_dvec3();
        there += usize::from(places.vpl(vpl).0.distance(at) <= near);
    }
    pairs_seen > 0 && 2 * there >= pairs_seen
}
