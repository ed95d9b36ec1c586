//! Turns a time into where the moving nodes of a file are, each through all nodes above it.

use super::channel::Channel;
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Smallest magnitude of a factor of a scale: what an animation shrinks to nothing keeps a shape that can be undone.
const SMALLEST_FACTOR: f64 = 1e-6;

/// The nodes of a file that an animation moves, by themselves or through nodes above them; these come first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hierarchy {
    pub(crate) joints: Vec<Joint>,
    /// After what time it begins again, s; 0 where nothing changes.
    pub(crate) duration_s: f64,
}

/// A node that moves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Joint {
    pub(crate) parent: Parent,
    pub(crate) local: Local,
    pub(crate) translation: Option<Channel>,
    pub(crate) rotation: Option<Channel>,
    pub(crate) scale: Option<Channel>,
}

/// What a node hangs on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Parent {
    /// The file's space, or a node that stands still, as the map from its space to the file's.
    Still(DAffine3),
    /// An earlier joint.
    Joint(usize),
}

/// The map from a node's space to that of its parent, where no channel changes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Local {
    Matrix(DAffine3),
    Parts { translation: DVec3, rotation: DQuat, scale: DVec3 },
}

impl Local {
    pub(crate) fn matrix(&self) -> DAffine3 {
        match *self {
            Self::Matrix(matrix) => matrix,
            Self::Parts { translation, rotation, scale } => {
                DAffine3 { matrix3: DMat3::from_quat(rotation) * DMat3::from_diagonal(scale), translation }
            }
        }
    }
}

impl Joint {
    fn channels(&self) -> impl Iterator<Item = &Channel> {
        [&self.translation, &self.rotation, &self.scale].into_iter().flatten()
    }

    fn local_at(&self, time_s: f64) -> DAffine3 {
        let Local::Parts { translation, rotation, scale } = self.local else { return self.local.matrix() };
        let or = |channel: &Option<Channel>, still| channel.as_ref().map_or(still, |c| c.vector(time_s));
        let scale = or(&self.scale, scale);
        let scale = scale.map(|x| if x.abs() < SMALLEST_FACTOR { SMALLEST_FACTOR.copysign(x) } else { x });
        let rotation = self.rotation.as_ref().map_or(rotation, |channel| channel.rotation(time_s));
        Local::Parts { translation: or(&self.translation, translation), rotation, scale }.matrix()
    }
}

impl Hierarchy {
    /// The map from each joint's space to the file's at a finite time in s, repeated for ever: a pure function.
    pub(crate) fn worlds(&self, time_s: f64) -> Vec<DAffine3> {
        let time = if self.duration_s > 0.0 { time_s.rem_euclid(self.duration_s) } else { 0.0 };
        let mut worlds: Vec<DAffine3> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let parent = match joint.parent {
                Parent::Still(world) => world,
                Parent::Joint(index) => worlds[index],
            };
            worlds.push(parent * joint.local_at(time));
        }
        worlds
    }

    /// Up to `most` moments, in order: keyframes, and the middles between them.
    pub(crate) fn moments(&self, most: usize) -> Vec<f64> {
        let mut keys: Vec<f64> =
            self.joints.iter().flat_map(Joint::channels).flat_map(|c| &c.times).copied().collect();
        keys.push(0.0);
        keys.retain(|time| *time < self.duration_s || *time == 0.0);
        keys.sort_by(f64::total_cmp);
        keys.dedup();
        let next = keys[1..].iter().copied().chain([self.duration_s]);
        let all: Vec<f64> = keys.iter().zip(next).flat_map(|(&a, b)| [a, 0.5 * (a + b)]).collect();
        let stride = all.len().div_ceil(most.max(1)).max(1);
        all.into_iter().step_by(stride).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::channel::Between;
    use super::*;
    use glam::DVec4;

    /// A wheel on an arm: the arm turns a quarter in 1 s, the wheel rolls out from 1 to 3 along it. 1e-15: a few roundings.
    #[test]
    fn nodes_move_with_those_above_them() {
        let parts = Local::Parts { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let channel = |values: [DVec4; 2]| {
            Some(Channel { times: vec![0.0, 1.0], values: values.to_vec(), between: Between::Linear })
        };
        let arm = Joint {
            parent: Parent::Still(DAffine3::from_translation(DVec3::Z)),
            local: parts,
            translation: None,
            rotation: channel([DVec4::W, quarter.into()]),
            scale: None,
        };
        let wheel = Joint {
            parent: Parent::Joint(0),
            local: parts,
            translation: channel([DVec4::X, DVec4::X * 3.0]),
            rotation: None,
            scale: channel([DVec4::ONE, DVec4::ZERO]),
        };
        let hierarchy = Hierarchy { joints: vec![arm, wheel], duration_s: 1.0 };
        let half = 2.0 * std::f64::consts::FRAC_1_SQRT_2;
        for time in [0.5, 1.5, -0.5] {
            let wheel = hierarchy.worlds(time)[1];
            assert!((wheel.translation - DVec3::new(half, half, 1.0)).length() < 1e-15, "{wheel}");
            assert!((wheel.matrix3.determinant() - 0.125).abs() < 1e-15);
        }
        // Shrunk to a millionth at the very end, which comes round as the beginning.
        assert_eq!(hierarchy.joints[1].local_at(1.0).matrix3, DMat3::from_diagonal(DVec3::splat(1e-6)));
        assert_eq!(hierarchy.moments(10), [0.0, 0.5]);
    }
}
