//! Turns a scene into static virtual point lights (VPLs): where light can come to, few for many reflections.
//!
//! Source: paper B (METHODS §6), §5.2; deviates: reflectance is compared by material, so that a texture counts by its mean;
//! the area that a VPL stands for can be measured; a cluster's mean is put back on the surface.

mod area;
mod cluster;
mod error;
mod explore;
mod file;
mod grid;
mod settings;
#[cfg(test)]
mod tests;
mod trace;

pub use error::VplPlacementError;
pub use file::{VplFile, VplFileCounts, VplMergeError};
pub use settings::{PlacedWeights, VplPlacementSettings};

use crate::scene::{ObjectId, Scene};
use area::Share;
use cluster::{Cluster, are_together, clusters};
use glam::Vec3;
use photonstream_shading::sobol::Sequence;
use trace::{Kinds, Reflection};

/// A virtual point light that placement proposes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedVpl {
    /// On the surface, in the scene's space at time 0, m.
    pub position: Vec3,
    /// Unit normal of the side.
    pub normal: Vec3,
    /// Mean reflectance, linear RGB.
    pub albedo: Vec3,
    /// Area that it stands for, m²; `None` where that is left to automatic weights.
    pub area_m2: Option<f32>,
    /// How many reflections it stands for.
    pub population: u32,
    /// The object it lies on.
    pub object: ObjectId,
    /// Whether that object moves, and it with it.
    pub is_attached: bool,
}

/// A virtual point light that is there already: none is put where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VplSite {
    /// In the scene's space at time 0, m.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Whether surface is shared out to it; not where one was taken away.
    pub takes_surface: bool,
}

/// What placement found.
#[derive(Clone, Debug, PartialEq)]
pub struct VplPlacement {
    /// By object, those of most reflections first.
    pub vpls: Vec<PlacedVpl>,
    /// Distance within which reflections were put together, m.
    pub spacing_m: f32,
    /// Points that paths started from.
    pub origins: u32,
    /// Reflections found.
    pub reflections: u32,
    /// Clusters beyond the limit of number, left out.
    pub left_out: u32,
    /// Clusters left out for what is there already.
    pub taken: u32,
    /// Clusters left out because all surface around them is nearer to others.
    pub without_surface: u32,
    /// Whether the spacing is what the reflections bear, and more of them would give more VPLs, up to the limit of number.
    pub wants_population: bool,
}

/// Steps of the spacing that is looked for: each is 2^⅛ finer, from the radius of the scene down to a 1024th of it.
const SPACINGS: i32 = 80;

/// Reflections of a cluster in the mean, at the finest spacing that they bear: the circle of a cluster holds no reflection
/// once in some thousand, where they lie as dense as in the mean.
const BORNE_BY: usize = 8;

/// Places VPLs: explores free space, traces diffuse paths from there and from the lights, puts together what lies near and
/// looks the same way, and keeps the most populous. Equal for any number of threads.
///
/// # Errors
/// If a setting is outside its domain, nothing that reflects is found, or no VPL has surface around it.
pub fn place_vpls(
    scene: &Scene,
    settings: &VplPlacementSettings,
    taken: &[VplSite],
) -> Result<VplPlacement, VplPlacementError> {
    settings.check()?;
    let origins = origins(scene, settings);
    let kinds = Kinds::of(scene);
    let streams = origins.len() as u32;
    let first = settings.starts.len().max(1) as u32 + 1;
    let reflections =
        trace::reflections(scene, &kinds, &origins, (settings.population, settings.depth), |origin| {
            Sequence::new(settings.seed, first + origin)
        });
    if reflections.is_empty() {
        return Err(VplPlacementError::NothingFound { paths: settings.population });
    }
    let borne = (reflections.len() / BORNE_BY).max(1);
    let most = settings.most as usize;
    let (spacing_m, (found, of)) = match settings.spacing_m {
        Some(spacing) => (spacing as f32, clusters(&reflections, spacing as f32)),
        None => fitting(&reflections, scene.bounds.radius, most.min(borne)),
    };
    let lies_free = |cluster: &Cluster| {
        let here = (cluster.position(), cluster.normal());
        !taken.iter().any(|site| are_together((site.position, site.normal), here, spacing_m))
    };
    let mut kept: Vec<u32> = (0..found.len() as u32).filter(|&i| lies_free(&found[i as usize])).collect();
    let free = kept.len();
    kept.sort_by_key(|&i| std::cmp::Reverse(found[i as usize].population));
    kept.truncate(most);
    let bases = bases(&reflections, &found, &of);
    let mut vpls: Vec<PlacedVpl> =
        kept.iter().map(|&i| placed(scene, &found[i as usize], &bases[i as usize])).collect();
    vpls.sort_by_key(|vpl| (vpl.object, std::cmp::Reverse(vpl.population)));
    if settings.weights == PlacedWeights::Surface {
        let own = vpls.iter().map(|vpl| Share {
            position: vpl.position,
            normal: vpl.normal,
            kind: Some(kinds.get(vpl.object)),
        });
        let others = taken.iter().filter(|site| site.takes_surface);
        let others = others.map(|site| Share { position: site.position, normal: site.normal, kind: None });
        let shares: Vec<Share> = own.chain(others).collect();
        let sequence = Sequence::new(settings.seed, first + streams);
        // Where clusters are of few reflections, these leave gaps wider than the spacing.
        let reach_m = match found.len() > borne {
            true => spacing_m.max(fitting(&reflections, scene.bounds.radius, borne).0),
            false => spacing_m,
        };
        let areas = area::areas(scene, &kinds, (&reflections, reach_m), &shares, sequence);
        vpls.iter_mut().zip(areas).for_each(|(vpl, area)| vpl.area_m2 = Some(area));
        // It would never shine.
        vpls.retain(|vpl| vpl.area_m2 != Some(0.0));
        if vpls.is_empty() && !kept.is_empty() {
            return Err(VplPlacementError::NoSurface { clusters: kept.len() as u32, spacing_m });
        }
    }
    let bias = settings.normal_bias_m as f32;
    vpls.iter_mut().for_each(|vpl| vpl.position -= vpl.normal * bias);
    Ok(VplPlacement {
        spacing_m,
        origins: streams,
        reflections: reflections.len() as u32,
        left_out: (free - kept.len()) as u32,
        taken: (found.len() - free) as u32,
        without_surface: (kept.len() - vpls.len()) as u32,
        wants_population: settings.spacing_m.is_none() && borne < most,
        vpls,
    })
}

/// Where paths start: what is explored from each start, by default the camera's eye, and the lights.
fn origins(scene: &Scene, settings: &VplPlacementSettings) -> Vec<Vec3> {
    let eye = [scene.camera.position];
    let given: Vec<Vec3> = settings.starts.iter().map(|start| (*start - scene.origin_m).as_vec3()).collect();
    let starts = if given.is_empty() { &eye[..] } else { &given };
    let mut origins = Vec::new();
    for (stream, start) in (0..).zip(starts) {
        let sequence = Sequence::new(settings.seed, stream);
        origins.extend(explore::explore(scene, *start, settings.explore, sequence));
    }
    origins.extend(explore::of_lights(scene));
    origins
}

/// The finest spacing that needs no more than `most` clusters.
fn fitting(reflections: &[Reflection], radius_m: f32, most: usize) -> (f32, (Vec<Cluster>, Vec<u32>)) {
    let spacing = |step: i32| radius_m * (-0.125 * step as f32).exp2();
    let (mut fits, mut best) = (0, clusters(reflections, spacing(0)));
    let mut too_fine = SPACINGS + 1;
    while too_fine - fits > 1 {
        let middle = (fits + too_fine) / 2;
        let found = clusters(reflections, spacing(middle));
        if found.0.len() <= most {
            (fits, best) = (middle, found);
        } else {
            too_fine = middle;
        }
    }
    (spacing(fits), best)
}

/// The reflection of each cluster that is nearest to its mean.
fn bases(reflections: &[Reflection], clusters: &[Cluster], of: &[u32]) -> Vec<Reflection> {
    let means: Vec<Vec3> = clusters.iter().map(Cluster::position).collect();
    let mut bases: Vec<Option<(f32, &Reflection)>> = vec![None; clusters.len()];
    for (reflection, &cluster) in reflections.iter().zip(of) {
        let distance_sq = reflection.position.distance_squared(means[cluster as usize]);
        let base = &mut bases[cluster as usize];
        if base.is_none_or(|(nearest, _)| distance_sq < nearest) {
            *base = Some((distance_sq, reflection));
        }
    }
    bases.into_iter().map(|base| *base.expect("invariant: every cluster has a reflection").1).collect()
}

/// The VPL of a cluster: at its mean, moved along its normal as high as the reflection nearest to it, and out of what it
/// lies in all the same, so that it is on curved surfaces and not behind them.
fn placed(scene: &Scene, cluster: &Cluster, base: &Reflection) -> PlacedVpl {
    let (mean, normal) = (cluster.position(), cluster.normal());
    let position = mean + normal * (base.position - mean).dot(normal);
    PlacedVpl {
        position: scene.raised_onto_surface(position, normal),
        normal,
        albedo: cluster.albedo(),
        area_m2: None,
        population: cluster.population,
        object: base.object,
        is_attached: base.kind.moving.is_some(),
    }
}
