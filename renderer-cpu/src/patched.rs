//! Turns near virtual surface lights into irradiance by their polygons: kernel `patch`.

use crate::{
    cull::{Emitter, Selection},
    tile::Tile,
};
use glam::Vec3;
use photonstream_renderer::Patch;
use photonstream_shading::{
    Kernel,
    patch::{MAX_CORNERS, form_factor},
};

/// What a receiver sees of a light.
pub(crate) struct Seen {
    /// Irradiance over the light's flux, in m⁻².
    pub(crate) transfer: f32,
    /// From where the receiver's rays leave to the middle of what it sees, in m.
    pub(crate) middle: Vec3,
}

/// What a receiver of normal `normal` sees of a light at `d`, in m: its polygon where it is near, else a point.
///
/// `d_origin` leads to the light from where the receiver's rays leave, off its own surface and towards the viewer: from there
/// nothing of the receiver's own plane is above the horizon, and a receiver on the line where two walls meet lies before the
/// other wall, whatever rounding has made of its place.
#[inline]
pub(crate) fn seen(light: &Emitter, patch: &Patch, d: Vec3, d_origin: Vec3, normal: Vec3) -> Seen {
    if !Kernel::Patch.is_near(d.length_squared(), patch.area) {
        return Seen {
            transfer: Kernel::Patch.transfer(d, normal, -light.inverse_normal, 0.0),
            middle: d_origin,
        };
    }
    let mut middle = d_origin;
    // Behind the polygon's plane there is nothing to see.
    if light.inverse_normal.dot(d_origin) <= 0.0 {
        return Seen { transfer: 0.0, middle };
    }
    // Nor in it: a receiver there that looks the same way is of that plane, and its shading normal may lean over it.
    let height = light.inverse_normal.dot(d);
    if height * height <= d.distance_squared(d_origin) && light.inverse_normal.dot(normal) < 0.0 {
        return Seen { transfer: 0.0, middle };
    }
    let mut corners = [Vec3::ZERO; MAX_CORNERS];
    let count = patch.corners().len();
    for (corner, offset) in corners.iter_mut().zip(patch.corners()) {
        *corner = d_origin + *offset;
    }
    Seen { transfer: form_factor(&corners[..count], normal, &mut middle) / patch.area, middle }
}

/// Adds the irradiance of the near lights to `tile`, without shadows. Returns the sum of the upper bounds of what was skipped, in
/// W m⁻² sr⁻¹.
pub(crate) fn accumulate(selection: &Selection, tile: &mut Tile) -> f64 {
    let mut skipped = 0.0;
    for (light, patch) in &selection.patched {
        for i in 0..tile.used {
            let Some(surface) = &tile.surfaces[i] else { continue };
            let d = light.position - tile.position.get(i);
            let d_origin = light.position - surface.ray_origin;
            let transfer = seen(light, patch, d, d_origin, tile.normal.get(i)).transfer;
            let r_sq = d.length_squared();
            if transfer > 0.0 && r_sq > light.range_sq {
                skipped += f64::from(light.bound / r_sq);
            } else if transfer > 0.0 {
                tile.irradiance.set(i, tile.irradiance.get(i) + light.flux * (transfer * light.weight(r_sq)));
            }
        }
    }
    skipped
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_protocol::PatchRecord;
    use photonstream_renderer::{Vsl, VslSet};

    /// A wall of 1 m² in 64 lights of equal radiosity that stands on a floor: at 0.1 mm to 2 m from its foot the lights add up
    /// to the wall's own form factor (Howell B-4) within 1 %, where kernel `disc` is wrong by a third and more beside it.
    #[test]
    fn many_patches_light_as_the_wall_that_they_make_up() {
        let n = 8;
        let edge = 1.0 / n as f32;
        let half = 0.5 * edge;
        let (mut vsls, mut records) = (Vec::new(), Vec::new());
        for i in 0..n * n {
            let place = |k: usize| (k as f32 + 0.5) * edge;
            let position = Vec3::new(place(i % n), 0.0, place(i / n));
            let (normal, flux, area) = (Vec3::NEG_Y, Vec3::splat(edge * edge), edge * edge);
            vsls.push(Vsl { position, normal, flux, area, object: 0 });
            let mut record = PatchRecord { count: 4, area, ..PatchRecord::default() };
            // Counter-clockwise for who looks along +y.
            for (k, (x, z)) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].into_iter().enumerate() {
                record.corners[3 * k..3 * k + 3].copy_from_slice(&[x * half, 0.0, z * half]);
            }
            records.push(record);
        }
        let set = VslSet::new(vsls).unwrap().with_patches(&records);
        for distance in [1e-4f32, 1e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 2.0] {
            // At the end of the wall's foot, where B-4 holds.
            let at = Vec3::new(0.0, -distance, 0.0);
            let c = f64::from(distance);
            let root = (1.0 + c * c).sqrt();
            let exact = ((1.0 / c).atan() - c / root * (1.0 / root).atan()) / core::f64::consts::TAU;
            let sum = |kernel: Kernel| -> f64 {
                (0..set.len())
                    .map(|i| {
                        let emitter = Emitter {
                            position: set.position()[i],
                            inverse_normal: -set.normal()[i],
                            flux: set.flux()[i],
                            index: i as u32,
                            area_term: 0.0,
                            range_sq: f32::INFINITY,
                            weight_slope: 0.0,
                            bound: 0.0,
                        };
                        let d = set.position()[i] - at;
                        let transfer = match kernel {
                            Kernel::Patch => seen(&emitter, set.patch(i).unwrap(), d, d, Vec3::Z).transfer,
                            _ => kernel.transfer(d, Vec3::Z, set.normal()[i], set.area()[i]),
                        };
                        f64::from(set.flux()[i].x * transfer)
                    })
                    .sum()
            };
            let error = sum(Kernel::Patch) / exact - 1.0;
            assert!(error.abs() < 0.01, "{distance}: {error}");
            let disc = sum(Kernel::Disc) / exact - 1.0;
            assert!(distance > 0.01 || disc.abs() > 0.33, "{distance}: {disc}");
        }
    }

    /// A receiver on a light, whose normal leans by 30°, gets nothing of it; one just before the light's plane and one that
    /// stands on it do.
    #[test]
    fn a_light_does_not_shine_along_its_own_plane() {
        let (position, normal, flux, area) = (Vec3::ZERO, Vec3::Y, Vec3::ONE, 1.0);
        let mut record = PatchRecord { count: 4, area, ..PatchRecord::default() };
        for (k, [x, z]) in [[-0.5, 0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]].into_iter().enumerate() {
            record.corners[3 * k..3 * k + 3].copy_from_slice(&[x, 0.0, z]);
        }
        let set = VslSet::new([Vsl { position, normal, flux, area, object: 0 }]).unwrap();
        let set = set.with_patches(&[record]);
        let light = Emitter {
            position,
            flux,
            inverse_normal: -normal,
            area_term: 0.0,
            range_sq: f32::INFINITY,
            bound: 0.0,
            weight_slope: 0.0,
            index: 0,
        };
        let patch = set.patch(0).unwrap();
        let off = Vec3::Y * 1e-5;
        let transfer = |place: Vec3, normal: Vec3| seen(&light, patch, -place, -place - off, normal).transfer;
        let leaning = Vec3::new(0.5, 0.75f32.sqrt(), 0.0);
        assert_eq!(transfer(Vec3::new(0.1, 0.0, 0.2), leaning), 0.0);
        assert_eq!(transfer(Vec3::new(0.1, 1e-6, 0.2), leaning), 0.0);
        // The plane fills what the leaning horizon shows of it: (1 - cos 30°)/2, and half of the sky where the normal lies in it.
        assert!((transfer(Vec3::new(0.0, 1e-4, 0.0), leaning) - 0.067).abs() < 1e-3);
        assert!((transfer(Vec3::ZERO, Vec3::X) - 0.5).abs() < 1e-3);
    }
}
