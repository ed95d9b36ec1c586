//! Gathers what the window knows and what the user has done with it, without window or device.

use crate::{
    Args,
    choices::Choices,
    commands::Told,
    flaws::Flaws,
    following::{Connection, News, Published},
    gizmos::{Edits, Gizmo, Kind},
    keys::Motion,
    latency::Latency,
    navigation::Navigation,
    notices::Notices,
    overlay::Draft,
    picking::{Eye, Target},
    pointer::Pointer,
};
use photonstream_protocol::{Liveness, Request};
use photonstream_renderer::{
    distance_map_edge,
    telemetry::{ChangeTimes, LightAge},
};
use photonstream_renderer_wgpu::{PassTime, View};
use photonstream_scene::{LightId, ObjectId, Scene, bvh::Ray};
use std::time::{Duration, Instant};

/// What is selected, by its name in the scene: numbers change with the scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Selected {
    /// A light.
    Light(String),
    /// An object.
    Object(String),
    /// A VPL, blocker or proxy.
    Gizmo(Gizmo),
}

/// What the last picture took.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Effort {
    /// From the start of drawing until all was handed to the device, in ms.
    pub(crate) frame_ms: f64,
    /// Time of each pass on the device.
    pub(crate) passes: Vec<PassTime>,
}

/// The state of the window; it survives the loss of surface and device.
#[derive(Debug)]
pub(crate) struct Session {
    pub(crate) args: Args,
    /// Whether what was not asked for is at first what software draws soonest.
    pub(crate) eases: bool,
    pub(crate) published: Option<Published>,
    pub(crate) connection: Connection,
    pub(crate) problem: Option<String>,
    pub(crate) navigation: Option<Navigation>,
    pub(crate) choices: Option<Choices>,
    /// The last ones that could be drawn.
    good_choices: Option<Choices>,
    pub(crate) selected: Option<Selected>,
    pub(crate) draft: Draft,
    /// VPLs, blockers and proxies as they are edited.
    pub(crate) gizmos: Edits,
    pub(crate) shows_gizmos: bool,
    /// What the next click adds.
    pub(crate) placing: Option<Kind>,
    pub(crate) shows_overlay: bool,
    pub(crate) shows_help: bool,
    pub(crate) notices: Notices,
    pub(crate) latency: Latency,
    /// How old and how noisy the published light is.
    pub(crate) light: LightAge,
    /// When the last change arrived, was traced and was published.
    pub(crate) changes: ChangeTimes,
    pub(crate) effort: Effort,
    pub(crate) flaws: Flaws,
    /// Whether the picture is of an earlier frame, since the device refused the published one.
    pub(crate) is_behind: bool,
    pub(crate) motion: Motion,
    pub(crate) pointer: Pointer,
    pub(crate) wants_screenshot: bool,
    pub(crate) wants_fullscreen: bool,
    pub(crate) wants_end: bool,
    /// Requests for the simulator, in order.
    pub(crate) outbox: Vec<Request>,
    /// Size of the picture in pixels.
    pub(crate) size: (u32, u32),
    /// Pixels per point of the interface.
    pub(crate) scale: f32,
    /// Segment and number of the last frame that was shown.
    last_shown: Option<(u64, u64)>,
    shown_frames: u64,
}

impl Session {
    /// A window on a channel of which nothing is known yet.
    pub(crate) fn new(args: Args) -> Self {
        Self {
            args,
            eases: false,
            published: None,
            connection: Connection::default(),
            problem: None,
            navigation: None,
            choices: None,
            good_choices: None,
            selected: None,
            draft: Draft::default(),
            gizmos: Edits::default(),
            shows_gizmos: false,
            placing: None,
            shows_overlay: true,
            shows_help: false,
            notices: Notices::default(),
            latency: Latency::default(),
            light: LightAge::default(),
            changes: ChangeTimes::default(),
            effort: Effort::default(),
            flaws: Flaws::default(),
            is_behind: false,
            motion: Motion::default(),
            pointer: Pointer::default(),
            wants_screenshot: false,
            wants_fullscreen: false,
            wants_end: false,
            outbox: Vec::new(),
            size: (0, 0),
            scale: 1.0,
            last_shown: None,
            shown_frames: 0,
        }
    }

    /// Takes in what the channel has brought.
    pub(crate) fn accept(&mut self, news: News) {
        (self.connection, self.problem) = (news.connection, news.problem);
        let Some(published) = news.published else { return };
        self.light = LightAge::of(&published.frame);
        self.changes.see(&published.frame);
        let scene = &published.scene;
        let is_moved = self.navigation.as_ref().is_none_or(|n| *n.home() != scene.camera);
        if is_moved {
            let direction = scene.camera.forward;
            let ray = Ray { origin: scene.camera.position, direction, t_max: f32::INFINITY };
            let distance = scene.bvh.closest(&ray).map_or(scene.bounds.radius, |hit| hit.t);
            // The middle of the scene, as seen from the camera, rather than the wall behind it.
            let middle = (scene.bounds.centre - scene.camera.position).dot(direction);
            let distance = if middle > 0.0 { middle.min(distance) } else { distance };
            self.navigation = Some(Navigation::new(scene.camera, distance, scene.bounds.radius));
        }
        if self.choices.is_none() {
            self.choices = Some(Choices::new(&scene.render, &scene.camera, &self.args));
            if self.eases {
                let frame = &published.frame;
                let has_maps = distance_map_edge(frame.distances.len(), frame.vsls.len()).is_some();
                self.choices
                    .iter_mut()
                    .for_each(|choices| choices.ease(&self.args, has_maps, frame.vsls.len()));
            }
        }
        if self.gizmos.follow(&published) && self.pointer.is_holding_gizmo() {
            self.pointer.let_go();
        }
        self.published = Some(published);
        self.deselect_what_is_gone();
    }

    fn deselect_what_is_gone(&mut self) {
        let Some(scene) = self.scene() else { return };
        let is_gone = match &self.selected {
            Some(Selected::Light(name)) => scene.light(name).is_none(),
            Some(Selected::Object(name)) => scene.object(name).is_none(),
            Some(Selected::Gizmo(gizmo)) => !self.gizmos.has(*gizmo),
            None => false,
        };
        if is_gone {
            self.selected = None;
            self.pointer.let_go();
        }
    }

    /// Takes in what became of a request.
    pub(crate) fn hear(&mut self, told: &Told, now: Instant) {
        match told {
            Told::Done { request: Request::SetVpls { values }, .. } => {
                if let Some(published) = self.published.clone() {
                    self.gizmos.accept(&published.scene, values);
                }
            }
            Told::Done { request: Request::SaveVpls {}, .. } => {
                self.notices.say("VPLs, blockers and proxies are saved in the file that is simulated", now);
            }
            Told::Done { .. } => {}
            Told::Failed { request, reason } => {
                self.notices.warn(format!("{}: {reason}", title(request)), now);
                if let (Request::SetVpls { .. }, Some(published)) = (request, self.published.clone()) {
                    self.gizmos.refuse(&published.scene);
                    self.deselect_what_is_gone();
                }
            }
        }
    }

    /// Moves the camera on by `elapsed`; whether it has to go on.
    pub(crate) fn advance(&mut self, elapsed: Duration) -> bool {
        // A long picture must not throw the camera out of the room.
        let seconds = elapsed.as_secs_f32().min(0.25);
        let Some(navigation) = &mut self.navigation else { return false };
        self.motion.advance(navigation, seconds)
    }

    /// What the renderer has to draw; `None` before the first frame and without pixels.
    pub(crate) fn view(&self) -> Option<View> {
        let (published, navigation, choices) =
            (self.published.as_ref()?, self.navigation.as_ref()?, self.choices.as_ref()?);
        let (width, height) = self.size;
        let lights = published.scene.lights.len();
        (width > 0 && height > 0).then(|| choices.view(navigation.camera(), width, height, lights))
    }

    /// From where the scene is seen.
    pub(crate) fn eye(&self) -> Option<Eye<'_>> {
        let (width, height) = self.size;
        let camera = self.navigation.as_ref()?.camera();
        (width > 0 && height > 0).then_some(Eye { camera, width, height })
    }

    /// Counts the frame that has just been shown at `now_ns`; whether these are as many as were asked for.
    pub(crate) fn count_shown(&mut self, now_ns: u64) -> bool {
        if let Some(published) = self.published.as_ref().filter(|_| !self.is_behind) {
            let frame = &published.frame;
            let this = Some((frame.epoch, frame.frame));
            if std::mem::replace(&mut self.last_shown, this) != this {
                self.shown_frames += 1;
                self.latency.shown(frame, now_ns);
            }
        }
        self.args.frames.is_some_and(|frames| self.shown_frames >= frames)
    }

    /// Frames that were shown.
    pub(crate) fn shown_frames(&self) -> u64 {
        self.shown_frames
    }

    pub(crate) fn scene(&self) -> Option<&Scene> {
        self.published.as_ref().map(|p| &*p.scene)
    }

    pub(crate) fn select(&mut self, target: Option<Target>) {
        self.selected = self.scene().zip(target).and_then(|(scene, target)| match target {
            Target::Light(LightId(id)) => {
                scene.lights.get(id as usize).map(|l| Selected::Light(l.name.clone()))
            }
            Target::Object(ObjectId(id)) => {
                scene.objects.get(id as usize).map(|o| Selected::Object(o.name.clone()))
            }
            Target::Gizmo(gizmo) => Some(Selected::Gizmo(gizmo)),
        });
    }

    /// What is chosen now can be drawn.
    pub(crate) fn keep_choices(&mut self) {
        if self.good_choices != self.choices {
            self.good_choices.clone_from(&self.choices);
        }
    }

    /// What is chosen now cannot be drawn; whether there is something else to try.
    pub(crate) fn put_back_choices(&mut self) -> bool {
        let refused = self.choices.clone();
        if self.good_choices.is_some() {
            self.choices.clone_from(&self.good_choices);
        } else if let (Some(choices), Some(published)) = (&mut self.choices, &self.published) {
            choices.view = View::from_settings(&published.scene.render, &published.scene.camera);
        }
        self.choices != refused
    }

    pub(crate) fn is_paused(&self) -> bool {
        self.connection == Connection::Attached(Liveness::Paused)
    }

    /// Stops simulated time, or lets it run.
    pub(crate) fn toggle_pause(&mut self) {
        self.outbox.push(if self.is_paused() { Request::Resume } else { Request::Pause });
    }
}

/// What a request is called in messages.
fn title(request: &Request) -> String {
    match request {
        Request::SetLight { name, .. } => format!("light \"{name}\" not changed"),
        Request::MoveObject { name, .. } => format!("object \"{name}\" not moved"),
        Request::SetVpls { .. } => "VPLs, blockers or proxies not changed".into(),
        Request::SaveVpls {} => "VPLs, blockers and proxies not saved".into(),
        Request::Pause => "not paused".into(),
        Request::Resume => "not resumed".into(),
        Request::Step => "no step made".into(),
        other => format!("{other:?} not done"),
    }
}
