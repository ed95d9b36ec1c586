//! Turns a torch that is swung through a room into the lights that an engine adds to its frame: a whole use of this crate.
//!
//! 200 VPLs on the walls, floor and ceiling of a room of 8 × 3 × 6 m, 20 blockers along a row of columns and one on a
//! thing that moves, one spot light. An engine does once what `Room::new` does, and each frame what `Room::frame` does;
//! here, a line for every tenth of a second says what it would draw. `cargo run -p photonstream-running-light --example
//! embed`.
#![allow(clippy::print_stdout)]

use photonstream_running_light::{
    AmortisedWeights, Blocker, LengthError, Light, Phantom, PhantomSettings, SecondBounce, Spot,
    UpdateSettings, Vec3, VirtualLight, Visibility, Vpl, VplId, automatic_weights, update,
};

const HALF: Vec3 = Vec3::new(4.0, 1.5, 3.0);
const VPLS: usize = 200;
const BLOCKERS: usize = 20;

/// All that the engine keeps: arrays of a fixed size, so nothing is allocated at any time.
struct Room {
    vpls: [Vpl; VPLS],
    weights: AmortisedWeights,
    blockers: [Blocker; BLOCKERS],
    flux: [Vec3; VPLS],
    active: [VplId; VPLS],
    settings: UpdateSettings,
    bounce: SecondBounce,
    phantom: Phantom,
}

impl Room {
    /// Once: an engine reads VPLs and blockers from the scene's file. The walls are red and green, the rest is grey.
    fn new() -> Self {
        let mut vpls = core::array::from_fn(|i| {
            // Six faces in turn; points of a face by the plastic number's sequence.
            let (face, k) = (i % 6, (i / 6) as f32);
            let [u, v] = [k * 0.754_878, k * 0.569_840].map(|x| (x + 0.5).fract() * 2.0 - 1.0);
            let side = if face % 2 == 0 { 1.0 } else { -1.0 };
            let (position, normal) = match face / 2 {
                0 => (Vec3::new(side, u, v), Vec3::X * -side),
                1 => (Vec3::new(u, side, v), Vec3::Y * -side),
                _ => (Vec3::new(u, v, side), Vec3::Z * -side),
            };
            let albedo = match face {
                0 => Vec3::new(0.6, 0.1, 0.1),
                1 => Vec3::new(0.1, 0.5, 0.1),
                _ => Vec3::splat(0.6),
            };
            Vpl { position: position * HALF, normal, albedo, weight: 0.0 }
        });
        let settings = UpdateSettings::default();
        automatic_weights(&mut vpls, settings.area_per_weight);
        Self {
            vpls,
            weights: AmortisedWeights::new(),
            // Five columns of four spheres.
            blockers: core::array::from_fn(|i| {
                Blocker::new(Vec3::new((i / 4) as f32 - 2.0, (i % 4) as f32 * 0.75 - 1.1, 1.5), 0.3)
            }),
            flux: [Vec3::ZERO; VPLS],
            active: [VplId(0); VPLS],
            settings,
            bounce: SecondBounce { average_albedo: 0.4, distance: 3.0 },
            phantom: Phantom::new(),
        }
    }

    /// Each frame: `cart` is the place of a thing with a blocker on it. Returns how many of `active` shine, and the
    /// second bounce.
    fn frame(&mut self, torch: Spot, cart: Vec3) -> Result<(usize, Option<VirtualLight>), LengthError> {
        // What is attached to objects moves with them; the areas of VPLs follow one comparison per frame.
        self.blockers[0] = Blocker::new(cart, 0.5);
        self.weights.step(&mut self.vpls, self.settings.area_per_weight);

        let light = Light::Spot(torch);
        // An engine with a physics world can ask it instead: Visibility::Asked(&mut |ray| …).
        let mut visibility = Visibility::Blockers(&self.blockers);
        let shining =
            update(&self.vpls, &[light], &mut visibility, &self.settings, &mut self.flux, &mut self.active)?;
        Ok((shining, self.bounce.of_constellation(&self.vpls, &self.flux, &light)?))
    }

    /// Instead, where one light has to be enough: the engine casts one ray along the axis. `dt` in seconds.
    fn phantom_frame(&mut self, torch: Spot, dt: f32) -> Option<(VirtualLight, Option<VirtualLight>)> {
        let settings = PhantomSettings::default();
        let hit = Some(wall_along(torch.position, torch.direction));
        let light = self.phantom.update(&torch, hit, &self.vpls, &settings, dt)?;
        Some((light, self.bounce.of_phantom(&light, &torch)))
    }
}

/// The engine's ray against its proxies; here, from inside the box of the room.
fn wall_along(from: Vec3, direction: Vec3) -> Vec3 {
    let to_walls = (HALF * direction.signum() - from) / direction;
    from + direction * to_walls.min_element()
}

fn main() -> Result<(), LengthError> {
    let mut room = Room::new();
    println!("time   static VPLs: shining, W, second bounce W   phantom: position, W, second bounce W");
    for frame in 0..90u16 {
        let dt = 1.0 / 90.0;
        let time = f32::from(frame) * dt;
        let (sin, cos) = (time * core::f32::consts::TAU).sin_cos();
        let torch = Spot::new(Vec3::Y * 0.2, Vec3::new(cos, -0.3, sin), [0.25, 0.4], Vec3::splat(20.0));
        let (shining, second) = room.frame(torch, Vec3::new(0.0, -1.0, 2.0 * cos))?;
        let phantom = room.phantom_frame(torch, dt);

        // Here the engine sets its lights: positions and normals from `vpls`, intensity along the normal Φ/π.
        if frame % 9 == 0 {
            let watts = |light: Option<VirtualLight>| light.map_or(0.0, |light| light.flux.element_sum());
            let total: f32 =
                room.active[..shining].iter().map(|id| room.flux[id.0 as usize].element_sum()).sum();
            let (light, bounce) = phantom.unzip();
            let place = light.map_or(Vec3::NAN, |light| light.position);
            let (second, bounce) = (watts(second), watts(bounce.flatten()));
            let light = watts(light);
            println!(
                "{time:.2} s {shining:5} {total:9.3} {second:9.3}   {place:9.2} {light:9.3} {bounce:9.3}"
            );
        }
    }
    Ok(())
}
