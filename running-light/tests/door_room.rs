//! Turns a room that the sun enters through a sliding door into the share of its VPLs that shine.
#![allow(clippy::unwrap_used)]

use photonstream_running_light::{Light, ShadowRay, UpdateSettings, Vec3, Visibility, Vpl, VplId, update};

/// VPLs along each side of the floor.
const SIDE: usize = 40;
const VPLS: usize = SIDE * SIDE;

/// A floor of 4 × 4 m behind a wall in the plane z = 0, VPLs in the middles of cells of 10 cm.
fn floor() -> [Vpl; VPLS] {
    core::array::from_fn(|i| {
        let [x, z] = [i % SIDE, i / SIDE].map(|k| (k as f32 + 0.5) * 0.1);
        Vpl { position: Vec3::new(x, 0.0, z), normal: Vec3::Y, albedo: Vec3::splat(0.5), weight: 0.01 }
    })
}

/// Flux of the floor in W and how many VPLs shine, with the door open from x = 0 to `opening` m, 2 m high. The sun of
/// 1 000 W/m² shines at 45° straight through it. No light comes through roof and walls.
fn enter(opening: f32) -> (f32, usize) {
    let sun =
        Light::Directional { direction: Vec3::new(0.0, -1.0, 1.0).normalize(), irradiance: Vec3::splat(1e3) };
    let mut door = |ray: ShadowRay| {
        let at_wall = ray.origin - ray.direction * (ray.origin.z / ray.direction.z);
        let open = (0.0..opening).contains(&at_wall.x) && (0.0..2.0).contains(&at_wall.y);
        f32::from(u8::from(open))
    };
    let (mut flux, mut active) = ([Vec3::NAN; VPLS], [VplId(0); VPLS]);
    let settings = UpdateSettings::default();
    let mut visibility = Visibility::Asked(&mut door);
    let shining = update(&floor(), &[sun], &mut visibility, &settings, &mut flux, &mut active).unwrap();
    (flux.iter().map(|flux| flux.x).sum(), shining)
}

/// Each 10 cm of the opening light a row of 20 VPLs (2 m deep at 45°), each with 0.5 · 1000 · √½ · 0.01 m² = 3.5355 W:
/// far above I_cull. Closed, all are culled. Tolerance 10⁻⁴: up to 800 additions, 6·10⁻⁸ each.
#[test]
fn light_is_proportional_to_the_opening() {
    assert_eq!(enter(0.0), (0.0, 0));
    for rows in [1u8, 2, 5, 10, 40] {
        let (flux, shining) = enter(f32::from(rows) * 0.1);
        assert_eq!(shining, usize::from(rows) * 20, "{rows} rows");
        let expected = f32::from(rows) * 20.0 * 5.0 * 0.5f32.sqrt();
        assert!((flux / expected - 1.0).abs() < 1e-4, "{rows} rows: {flux} W, expected {expected}");
    }
}
