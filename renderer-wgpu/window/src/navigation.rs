//! Turns dragging, the wheel and keys into a camera that circles, flies and comes back.

use glam::{Quat, Vec3};
use photonstream_shading::Camera;

/// Smallest angle between the view and the vertical: nearer, the roll of the picture would be undefined.
const LEAST_POLAR_RAD: f32 = 0.0175;
/// Share of the distance to the pivot that one notch of the wheel leaves.
const NOTCH: f32 = 0.88;
/// Speed of flight in extents of the scene per second.
const SPEED: f32 = 0.35;
/// How much faster flight is with shift.
const FASTER: f32 = 4.0;
/// How far away from the scene the camera may go, in its extents.
const FARTHEST: f32 = 1e3;

/// A camera that the user moves. Lengths in metres from the scene's origin.
#[derive(Clone, Debug)]
pub(crate) struct Navigation {
    camera: Camera,
    home: Camera,
    home_distance: f32,
    vertical: Vec3,
    /// Distance to the point that the camera circles about.
    distance: f32,
    extent: f32,
}

impl Navigation {
    /// A camera at `home`, circling about the point `distance` ahead, in a scene of radius `extent`.
    pub(crate) fn new(home: Camera, distance: f32, extent: f32) -> Self {
        // Without roll the picture's right is level; a rolled camera keeps its own vertical.
        let is_level = home.right.y.abs() < 1e-3 && home.up.y > 0.02;
        let vertical = if is_level { Vec3::Y } else { home.up };
        let extent = if extent.is_finite() && extent > 0.0 { extent } else { 1.0 };
        let distance = if distance.is_finite() { distance.max(1e-3 * extent) } else { extent };
        Self { camera: home, home, home_distance: distance, vertical, distance, extent }
    }

    /// The camera now.
    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Where it started.
    pub(crate) fn home(&self) -> &Camera {
        &self.home
    }

    /// Unit vector that stays upright.
    pub(crate) fn vertical(&self) -> Vec3 {
        self.vertical
    }

    /// Puts the camera back where it started.
    pub(crate) fn reset(&mut self) {
        (self.camera, self.distance) = (self.home, self.home_distance);
    }

    /// Circles about the pivot: `dx` to the right and `dy` down, in radians of turning the scene by hand.
    pub(crate) fn orbit(&mut self, dx: f32, dy: f32) {
        let pivot = self.camera.position + self.camera.forward * self.distance;
        self.turn(dx, -dy);
        self.move_to(pivot - self.camera.forward * self.distance);
    }

    /// Turns the head: `right` and `up` in radians.
    pub(crate) fn turn(&mut self, right: f32, up: f32) {
        let vertical = self.vertical;
        let level = self.camera.right.cross(vertical);
        let forward = self.camera.forward;
        // Seen from the vertical the camera looks along `level`, whatever its elevation.
        let level = (-level).try_normalize().unwrap_or(forward);
        let polar = forward.dot(vertical).clamp(-1.0, 1.0).acos();
        let polar = (polar - up).clamp(LEAST_POLAR_RAD, core::f32::consts::PI - LEAST_POLAR_RAD);
        let level = Quat::from_axis_angle(vertical, -right) * level;
        let forward = (level * polar.sin() + vertical * polar.cos()).normalize();
        let right = forward.cross(vertical).normalize();
        self.camera = Camera { forward, right, up: right.cross(forward), ..self.camera };
    }

    /// Shifts camera and pivot by shares of the picture's height, so that what lies at the pivot follows the hand.
    pub(crate) fn pan(&mut self, dx: f32, dy: f32) {
        let height = 2.0 * self.camera.tan_half_fov * self.distance;
        self.move_to(self.camera.position + (self.camera.up * dy - self.camera.right * dx) * height);
    }

    /// Goes nearer by so many notches of the wheel, away from the pivot by negative ones.
    pub(crate) fn dolly(&mut self, notches: f32) {
        if !notches.is_finite() {
            return;
        }
        let distance = self.distance * NOTCH.powf(notches.clamp(-50.0, 50.0));
        self.move_to(self.camera.position + self.camera.forward * (self.distance - distance));
        // Past the pivot the camera goes on, and takes it along.
        self.distance = distance.clamp(1e-2 * self.extent, FARTHEST * self.extent);
    }

    /// Flies for `seconds`: `motion` in [-1, 1] to the right, up and ahead.
    pub(crate) fn fly(&mut self, motion: Vec3, seconds: f32, fast: bool) {
        let speed = SPEED * self.extent * if fast { FASTER } else { 1.0 };
        let along = self.camera.right * motion.x + self.vertical * motion.y + self.camera.forward * motion.z;
        self.move_to(self.camera.position + along.clamp_length_max(1.0) * (speed * seconds));
    }

    fn move_to(&mut self, position: Vec3) {
        if position.is_finite() {
            self.camera.position = position.clamp_length_max(FARTHEST * self.extent);
        }
    }
}

/// Where `point` is in a picture of `width` × `height` pixels; `None` behind the camera.
pub(crate) fn project(camera: &Camera, point: Vec3, width: u32, height: u32) -> Option<[f32; 2]> {
    let d = point - camera.position;
    let depth = d.dot(camera.forward);
    if depth.is_nan() || depth <= 1e-6 * d.length() {
        return None;
    }
    let scale = height as f32 / (2.0 * camera.tan_half_fov * depth);
    let place =
        [0.5 * width as f32 + d.dot(camera.right) * scale, 0.5 * height as f32 - d.dot(camera.up) * scale];
    place.iter().all(|x| x.is_finite()).then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn navigation() -> Navigation {
        let home =
            Camera::look_at(Vec3::new(0.0, 1.0, 4.0), Vec3::new(0.0, 1.0, 0.0), Vec3::Y, 40.0).unwrap();
        Navigation::new(home, 4.0, 2.0)
    }

    fn assert_orthonormal(camera: &Camera) {
        let Camera { forward, right, up, .. } = *camera;
        // Rounding of unit vectors in f32.
        for (a, b, dot) in [(forward, forward, 1.0), (right, right, 1.0), (up, up, 1.0)].into_iter().chain([
            (forward, right, 0.0),
            (forward, up, 0.0),
            (right, up, 0.0),
        ]) {
            assert!((a.dot(b) - dot).abs() < 1e-5, "{camera:?}");
        }
        assert!(right.cross(forward).dot(up) > 0.99);
    }

    #[test]
    fn a_camera_at_rest_is_the_scenes_own_bit_for_bit() {
        let mut navigation = navigation();
        let home = *navigation.camera();
        navigation.orbit(0.3, 0.2);
        navigation.dolly(2.0);
        assert_ne!(*navigation.camera(), home);
        navigation.reset();
        assert_eq!(*navigation.camera(), home);
    }

    #[test]
    fn circling_keeps_the_pivot_in_the_middle_and_the_camera_upright() {
        let mut navigation = navigation();
        let pivot = Vec3::new(0.0, 1.0, 0.0);
        // 500 steps through all azimuths, beyond both poles.
        for i in 0..500 {
            navigation.orbit(0.07, if i < 250 { 0.05 } else { -0.05 });
            let camera = navigation.camera();
            assert_orthonormal(camera);
            // 500 roundings of metres in f32.
            assert!((camera.position.distance(pivot) - 4.0).abs() < 1e-3, "{i}");
            assert!((camera.forward - (pivot - camera.position).normalize()).length() < 1e-3);
            assert!(camera.right.y.abs() < 1e-5 && camera.up.y > 0.0);
        }
    }

    #[test]
    fn the_scene_follows_the_hand() {
        let mut navigation = navigation();
        let point = Vec3::new(0.0, 1.0, 1.0);
        let [x0, y0] = project(navigation.camera(), point, 800, 600).unwrap();
        navigation.orbit(0.1, 0.1);
        let [x1, y1] = project(navigation.camera(), point, 800, 600).unwrap();
        assert!(x1 > x0 + 1.0 && y1 > y0 + 1.0, "a point before the pivot goes right and down");
        let mut navigation = self::navigation();
        navigation.pan(0.25, 0.5);
        let [x, y] = project(navigation.camera(), Vec3::new(0.0, 1.0, 0.0), 800, 600).unwrap();
        // A quarter and a half of 600 px from the middle; rounding of f32 in pixels.
        assert!((x - 550.0).abs() < 0.01 && (y - 600.0).abs() < 0.01, "{x} {y}");
    }

    #[test]
    fn turning_looks_where_it_says() {
        let mut navigation = navigation();
        navigation.turn(core::f32::consts::FRAC_PI_2, 0.0);
        assert!((navigation.camera().forward - Vec3::X).length() < 1e-6);
        navigation.turn(0.0, 0.5);
        assert!(navigation.camera().forward.y > 0.4);
        assert_eq!(navigation.camera().position, Vec3::new(0.0, 1.0, 4.0));
        assert_orthonormal(navigation.camera());
    }

    #[test]
    fn flight_goes_where_the_keys_say_and_no_number_breaks_it() {
        let mut navigation = navigation();
        navigation.fly(Vec3::Z, 1.0, false);
        assert!((navigation.camera().position - Vec3::new(0.0, 1.0, 3.3)).length() < 1e-6);
        navigation.fly(Vec3::Y, 1.0, true);
        assert!((navigation.camera().position - Vec3::new(0.0, 3.8, 3.3)).length() < 1e-6);
        for value in [f32::NAN, f32::INFINITY, -1e38] {
            navigation.fly(Vec3::splat(value), value, true);
            navigation.dolly(value);
            navigation.pan(value, value);
            assert!(navigation.camera().position.is_finite());
        }
    }

    #[test]
    fn the_wheel_goes_nearer_and_past_the_pivot() {
        let mut navigation = navigation();
        navigation.dolly(1.0);
        let first = navigation.camera().position.z;
        assert!((first - (4.0 - 4.0 * (1.0 - NOTCH))).abs() < 1e-5);
        for _ in 0..200 {
            navigation.dolly(1.0);
        }
        assert!(navigation.camera().position.z < 0.0, "it does not stick to the pivot");
    }

    #[test]
    fn points_are_projected_to_where_their_rays_come_from() {
        let camera = *navigation().camera();
        for (x, y) in [(0.0, 0.0), (799.5, 12.0), (400.0, 300.0), (123.0, 456.0)] {
            let point = camera.position + camera.direction(x, y, 800, 600) * 3.0;
            let [px, py] = project(&camera, point, 800, 600).unwrap();
            // 1e-7 relative rounding over 800 px, several operations.
            assert!((px - x).abs() < 2e-3 && (py - y).abs() < 2e-3);
        }
        assert_eq!(project(&camera, camera.position - camera.forward, 800, 600), None);
        assert_eq!(project(&camera, camera.position, 800, 600), None);
    }
}
