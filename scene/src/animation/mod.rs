//! Turns a time into where the lights and objects of a scene are, and what the lights emit.

mod freeze;
mod read;
mod rig;
mod track;

use crate::{
    config::{AnimatedProperty, Document, Field},
    edit::{SceneEdit, Values},
    error::SceneError,
    scene::{Object, SceneLight},
};
pub(crate) use read::read;
pub(crate) use rig::{
    Rider, RiderKind, Rig, Shape, Skeleton,
    channel::{Between, Channel},
    hierarchy::{Hierarchy, Joint, Local, Parent},
    light_at,
};
use std::collections::BTreeSet;
use track::Track;

/// What moves and dims the lights and objects of a scene: a pure function of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Animation {
    targets: Vec<Target>,
    /// What files animate themselves.
    rigs: Vec<Rig>,
}

/// A light or object with all that changes of it.
#[derive(Clone, Debug, PartialEq)]
struct Target {
    kind: Kind,
    name: String,
    tracks: Vec<(AnimatedProperty, Track)>,
}

/// What an animation changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Object,
    /// A rectangular light: moved as the object that shows it.
    Rectangle,
    Spot,
    Point,
    Directional,
    Sky,
}

/// Common multiples of periods are looked for up to so many times the longest of them.
const MOST_ROUNDS: u32 = 1000;

impl Animation {
    /// Whether nothing changes with time.
    pub fn is_empty(&self) -> bool {
        self.targets.is_empty() && self.rigs.is_empty()
    }

    /// Adds what imports move of `objects`; what they have left out is not there to be moved.
    pub(crate) fn carry(&mut self, rigs: Vec<Rig>, objects: &[Object]) {
        self.rigs = rigs;
        let is_there = |rider: &Rider| match rider.kind {
            RiderKind::Object(_) => objects.binary_search_by(|o| o.name.cmp(&rider.name)).is_ok(),
            RiderKind::Light { .. } => true,
        };
        self.rigs.iter_mut().for_each(|rig| rig.riders.retain(is_there));
        // What has no duration stands where it was loaded.
        self.rigs.retain(|rig| rig.skeleton.hierarchy.duration_s > 0.0 && !rig.riders.is_empty());
    }

    /// After what time everything begins again, s; `None` where something ends (`repeat = "once"`), nothing changes, or
    /// the periods have no common multiple within 1 000 times the longest.
    pub fn period_s(&self) -> Option<f64> {
        let mut periods = Vec::new();
        for (_, track) in self.targets.iter().flat_map(|target| &target.tracks) {
            periods.push(track.period()?);
        }
        periods.extend(self.rigs.iter().map(|rig| rig.skeleton.hierarchy.duration_s));
        periods.retain(|period| *period > 0.0);
        let longest = periods.iter().copied().reduce(f64::max)?;
        let fits = |all: f64| {
            periods.iter().all(|period| {
                let rounds = all / period;
                (rounds - rounds.round()).abs() <= 1e-9 * rounds
            })
        };
        (1..=MOST_ROUNDS).map(|rounds| longest * f64::from(rounds)).find(|all| fits(*all))
    }

    /// From what time on nothing changes any more, s; `None` where something is repeated for ever.
    pub fn end_s(&self) -> Option<f64> {
        let tracks = self.targets.iter().flat_map(|target| &target.tracks);
        let rigs = self.rigs.iter().map(|_| None);
        tracks.map(|(_, track)| track.end()).chain(rigs).try_fold(0.0, |last, end| Some(end?.max(last)))
    }

    /// Puts everything that is animated where it is at `time_s`, in simulated seconds since the scene's beginning, by
    /// edits as [`SceneEdit::set_light`] and [`SceneEdit::move_object`] make them; what is not animated stays. What was
    /// applied before does not matter.
    ///
    /// # Errors
    /// If the time is not finite, a moved object comes to lie beyond what f32 can hold, a spot comes to stand at its own
    /// target, or the scene has no such light or object; nothing is changed then.
    pub fn apply(&self, time_s: f64, edit: &mut SceneEdit) -> Result<(), SceneError> {
        check_time(time_s)?;
        edit.all_or_nothing(|edit| {
            self.targets.iter().try_for_each(|target| target.apply(time_s, edit))?;
            // Where the import stands by now, dragged or animated, its nodes move.
            self.rigs.iter().try_for_each(|rig| {
                let placement = edit.import(&rig.import).expect("invariant: what a file moves is imported");
                rig.apply(time_s, &placement, edit)
            })
        })
    }

    /// Whether an object is ever moved.
    pub(crate) fn moves_object(&self, object: &Object) -> bool {
        let rides = |rider: &Rider| matches!(rider.kind, RiderKind::Object(_)) && rider.name == object.name;
        self.rigs.iter().flat_map(|rig| &rig.riders).any(rides)
            || self.targets.iter().any(|target| {
                let moves = |property| target.kind.moves_surface(property);
                object.is_called(&target.name) && target.tracks.iter().any(|(property, _)| moves(*property))
            })
    }

    /// The numbers of objects and of lights that move; lights move with the objects that show them.
    pub(crate) fn moving(&self, objects: &[Object], lights: &[SceneLight]) -> (u32, u32) {
        let moves = |target: &Target, surface: bool| {
            target.tracks.iter().any(|(property, _)| {
                let dims = matches!(property, AnimatedProperty::Power | AnimatedProperty::Irradiance)
                    || target.kind == Kind::Sky;
                !dims && target.kind.moves_surface(*property) == surface
            })
        };
        let riders: BTreeSet<(&str, bool)> = self
            .rigs
            .iter()
            .flat_map(|rig| &rig.riders)
            .map(|rider| (rider.name.as_str(), matches!(rider.kind, RiderKind::Object(_))))
            .collect();
        let rides = |name: &str, is_object| riders.contains(&(name, is_object));
        let moving: Vec<bool> = objects
            .iter()
            .map(|object| {
                rides(&object.name, true)
                    || self.targets.iter().any(|t| moves(t, true) && object.is_called(&t.name))
            })
            .collect();
        let is_of =
            |light: &str, import: &str| light.strip_prefix(import).is_some_and(|rest| rest.starts_with('/'));
        let light_moves = |light: &SceneLight| match light.object {
            Some(object) => moving[object.0 as usize],
            None => {
                rides(&light.name, false)
                    || self.targets.iter().any(|t| moves(t, false) && t.name == light.name)
                    || self.targets.iter().any(|t| moves(t, true) && is_of(&light.name, &t.name))
            }
        };
        let count = |moving: &mut dyn Iterator<Item = bool>| moving.filter(|moves| *moves).count() as u32;
        (count(&mut moving.iter().copied()), count(&mut lights.iter().map(light_moves)))
    }
}

impl Target {
    fn apply(&self, time_s: f64, edit: &mut SceneEdit) -> Result<(), SceneError> {
        let (mut light, mut object) = (Values::new(), Values::new());
        for (property, track) in &self.tracks {
            let values = if self.kind.moves_surface(*property) { &mut object } else { &mut light };
            values.insert(property.name().to_owned(), track.at(time_s).to_array().to_vec().into());
        }
        if !light.is_empty() {
            edit.set_light(&self.name, &light)?;
        }
        if !object.is_empty() {
            edit.move_object(&self.name, &object)?;
        }
        Ok(())
    }
}

impl Kind {
    /// Whether a property belongs to the object that shows it, if it has one.
    fn moves_surface(self, property: AnimatedProperty) -> bool {
        use AnimatedProperty::{Position, Rotation, Scale};
        matches!(self, Self::Object | Self::Rectangle) && matches!(property, Position | Rotation | Scale)
    }

    /// The properties that it has.
    fn properties(self) -> &'static [AnimatedProperty] {
        use AnimatedProperty::{Direction, Irradiance, Position, Power, Rotation, Scale, Target};
        match self {
            Self::Object => &[Position, Rotation, Scale],
            Self::Rectangle => &[Power, Position, Rotation, Scale],
            Self::Spot => &[Power, Position, Target, Direction],
            Self::Point => &[Power, Position],
            Self::Directional => &[Irradiance, Direction],
            Self::Sky => &[Scale],
        }
    }
}

fn check_time(time_s: f64) -> Result<(), SceneError> {
    if time_s.is_finite() {
        return Ok(());
    }
    let document = Document::default();
    let field = Field::root(&document).key("time_s");
    Err(field.invalid(time_s, "a finite time in s", "ask for another time"))
}
