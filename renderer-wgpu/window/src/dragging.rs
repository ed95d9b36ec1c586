//! Turns the way of the cursor into the way of what it holds.

use crate::picking::Eye;
use glam::{DVec3, Vec3};

/// In which directions something is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Along {
    /// Parallel to the screen.
    Screen,
    /// Up and down this unit vector.
    Vertical(Vec3),
}

/// A hold on something in the scene, from where it was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hold {
    /// The point that was taken hold of, in metres from the scene's origin.
    point: Vec3,
    /// Where the cursor was.
    cursor: [f32; 2],
    /// Where the thing stood, in the coordinates of its config.
    start_m: DVec3,
}

impl Hold {
    /// Takes hold at `point` with the cursor at `cursor` of something that stands at `start_m`.
    pub(crate) fn new(point: Vec3, cursor: [f32; 2], start_m: DVec3) -> Self {
        Self { point, cursor, start_m }
    }

    /// Where the thing stood at the start.
    pub(crate) fn start_m(&self) -> DVec3 {
        self.start_m
    }

    /// Where it has to stand for the cursor at `cursor` to hold it at the same point; `None` where the cursor points
    /// past the horizon of that motion.
    pub(crate) fn position_m(&self, eye: &Eye<'_>, cursor: [f32; 2], along: Along) -> Option<DVec3> {
        let (from, to) = (self.place(eye, self.cursor, along)?, self.place(eye, cursor, along)?);
        let moved = self.start_m + (to - from).as_dvec3();
        moved.is_finite().then_some(moved)
    }

    fn place(&self, eye: &Eye<'_>, cursor: [f32; 2], along: Along) -> Option<Vec3> {
        let (origin, direction) = (eye.camera.position, eye.direction(cursor));
        let d = self.point - origin;
        match along {
            Along::Screen => {
                let t = d.dot(eye.camera.forward) / direction.dot(eye.camera.forward);
                (t > 0.0 && t.is_finite()).then(|| origin + direction * t)
            }
            Along::Vertical(axis) => {
                // The point of the axis that is nearest to the ray of the cursor.
                let cosine = axis.dot(direction);
                let sine_sq = 1.0 - cosine * cosine;
                // Seen from above, the whole axis is under the cursor.
                (sine_sq > 1e-3).then(|| {
                    let s = (cosine * direction.dot(d) - axis.dot(d)) / sine_sq;
                    self.point + axis * s
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::project;
    use photonstream_shading::Camera;

    const START: DVec3 = DVec3::new(1e6, 2.0, 3.0);

    fn camera() -> Camera {
        Camera::look_at(Vec3::new(1.0, 2.0, 4.0), Vec3::new(0.2, 1.0, 0.0), Vec3::Y, 40.0).unwrap()
    }

    #[test]
    fn the_point_stays_under_the_cursor() {
        let camera = camera();
        let eye = Eye { camera: &camera, width: 800, height: 600 };
        let point = Vec3::new(0.4, 0.3, 0.2);
        let cursor = project(&camera, point, 800, 600).unwrap();
        let hold = Hold::new(point, cursor, START);
        for to in [[100.0, 100.0], [799.0, 0.0], [420.5, 310.25], [-300.0, 900.0]] {
            let moved = hold.position_m(&eye, to, Along::Screen).unwrap() - START;
            let [x, y] = project(&camera, point + moved.as_vec3(), 800, 600).unwrap();
            // Metres at 1e6 m in f64 have 1e-10; the rest is f32 rounding over a thousand pixels.
            assert!((x - to[0]).abs() < 0.02 && (y - to[1]).abs() < 0.02, "{x} {y} {to:?}");
            assert!(moved.as_vec3().dot(camera.forward).abs() < 1e-5, "parallel to the screen");
        }
    }

    #[test]
    fn vertically_it_only_rises_and_sinks_to_the_height_of_the_cursor() {
        let camera = camera();
        let eye = Eye { camera: &camera, width: 800, height: 600 };
        let point = Vec3::new(0.4, 0.3, 0.2);
        let cursor = project(&camera, point, 800, 600).unwrap();
        let hold = Hold::new(point, cursor, START);
        for rise in [-0.5f32, 0.25, 1.0] {
            let to = project(&camera, point + Vec3::Y * rise, 800, 600).unwrap();
            let moved = hold.position_m(&eye, to, Along::Vertical(Vec3::Y)).unwrap() - START;
            assert!((moved - DVec3::Y * f64::from(rise)).length() < 1e-4, "{moved}");
        }
        let above = Camera::look_at(Vec3::new(0.4, 5.0, 0.2), point, Vec3::Z, 40.0).unwrap();
        let eye = Eye { camera: &above, width: 800, height: 600 };
        let hold = Hold::new(point, [400.0, 300.0], START);
        assert_eq!(hold.position_m(&eye, [410.0, 300.0], Along::Vertical(Vec3::Y)), None);
    }

    #[test]
    fn a_hold_that_is_not_moved_leaves_all_where_it_is_although_the_icon_was_taken_at_its_rim() {
        let camera = camera();
        let eye = Eye { camera: &camera, width: 800, height: 600 };
        let point = Vec3::new(0.4, 0.3, 0.2);
        let [x, y] = project(&camera, point, 800, 600).unwrap();
        let rim = [x + 9.0, y - 4.0];
        let hold = Hold::new(point, rim, START);
        assert_eq!(hold.position_m(&eye, rim, Along::Screen), Some(START));
        assert_eq!(hold.position_m(&eye, rim, Along::Vertical(Vec3::Y)), Some(START));
    }
}
