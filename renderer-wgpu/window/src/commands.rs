//! Turns what the user does into requests to the simulator, the newest of each kind only, from a thread of its own.

use crate::WindowError;
use glam::{DVec3, Vec3};
use photonstream_protocol::{ChannelName, ControlClient, ProtocolError, Reply, Request};
use photonstream_shading::LightShape;
use serde_json::{Map, Value, json};
use std::{
    collections::VecDeque,
    sync::{Arc, Condvar, Mutex, PoisonError},
    time::Duration,
};

/// How long the simulator may take to answer.
const REPLY_LIMIT: Duration = Duration::from_secs(3);
/// Pause before a request that the simulator had no room for is sent again.
const RETRY_AFTER: Duration = Duration::from_millis(20);
/// How often it is sent again.
const RETRIES: u32 = 50;

/// What became of a request.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Told {
    /// Done; visible from this frame on.
    Done {
        /// What was asked for.
        request: Request,
        /// Number of the frame.
        frame: u64,
    },
    /// Refused, or not delivered.
    Failed {
        /// What was asked for.
        request: Request,
        /// Why, in one sentence.
        reason: String,
    },
}

/// Requests that wait to be sent.
#[derive(Debug, Default)]
struct Queue {
    waiting: VecDeque<Request>,
    closed: bool,
}

impl Queue {
    /// Adds a request; an edit goes into one of the same light or object, or of VPLs, that still waits, whose values it
    /// replaces; what is saved is what there was when it was asked for.
    fn push(&mut self, request: Request) {
        let saved = self.waiting.iter().rposition(|waiting| matches!(waiting, Request::SaveVpls {}));
        let after = match request {
            Request::SetVpls { .. } => saved.map_or(0, |saved| saved + 1),
            _ => 0,
        };
        let same = self.waiting.iter_mut().skip(after).find_map(|waiting| match (waiting, &request) {
            (Request::SetVpls { values }, Request::SetVpls { .. }) => Some(values),
            (Request::SetLight { name, values }, Request::SetLight { name: other, .. })
            | (Request::MoveObject { name, values }, Request::MoveObject { name: other, .. })
                if name == other =>
            {
                Some(values)
            }
            _ => None,
        });
        match (same, request) {
            (
                Some(values),
                Request::SetLight { values: newer, .. }
                | Request::MoveObject { values: newer, .. }
                | Request::SetVpls { values: newer },
            ) => values.extend(newer),
            (_, request) => self.waiting.push_back(request),
        }
    }
}

/// Sends requests; never waits.
#[derive(Debug)]
pub(crate) struct Commands {
    shared: Arc<(Mutex<Queue>, Condvar)>,
}

impl Commands {
    /// Starts the thread that talks to the simulator of `channel`; `tell` is called from it with each outcome.
    ///
    /// # Errors
    /// [`WindowError::Thread`].
    pub(crate) fn start(
        channel: ChannelName,
        tell: impl Fn(Told) + Send + 'static,
    ) -> Result<Self, WindowError> {
        let shared = Arc::new((Mutex::new(Queue::default()), Condvar::new()));
        let queue = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("commands".into())
            .spawn(move || talk(&queue, &channel, &tell))
            .map_err(|e| WindowError::Thread { reason: e.to_string() })?;
        Ok(Self { shared })
    }

    /// Sends a request.
    pub(crate) fn send(&self, request: Request) {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner).push(request);
        self.shared.1.notify_one();
    }
}

impl Drop for Commands {
    /// Lets the thread end once it has sent what waits; it may be waiting for a reply, which nobody needs any more.
    fn drop(&mut self) {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner).closed = true;
        self.shared.1.notify_one();
    }
}

/// Puts a light elsewhere, in the coordinates of the config.
pub(crate) fn place_light(name: &str, position_m: DVec3) -> Request {
    Request::SetLight { name: name.into(), values: value("position_m", place(position_m)) }
}

/// Gives a light another power: W, W/m² for parallel light, or for a sky the mean radiance in W/(m² sr).
pub(crate) fn power_light(name: &str, power: Vec3, shape: &LightShape) -> Request {
    let (key, power) = match shape {
        LightShape::Directional { .. } => ("irradiance_w_m2", power),
        LightShape::Sky { sky } => ("scale", sky.scale_of(power)),
        _ => ("power_w", power),
    };
    // Six digits, so that messages and files read 12.5 and not 12.499999046325684.
    let digits = |p: f32| format!("{p:.5e}").parse::<f64>().unwrap_or(0.0);
    Request::SetLight { name: name.into(), values: value(key, json!(power.to_array().map(digits))) }
}

/// Switches a light on or off.
pub(crate) fn switch_light(name: &str, enabled: bool) -> Request {
    Request::SetLight { name: name.into(), values: value("enabled", json!(enabled)) }
}

/// Puts an object elsewhere, in the coordinates of the config.
pub(crate) fn place_object(name: &str, position_m: DVec3) -> Request {
    Request::MoveObject { name: name.into(), values: value("position_m", place(position_m)) }
}

fn value(key: &str, value: Value) -> Map<String, Value> {
    [(key.to_owned(), value)].into_iter().collect()
}

/// To a tenth of a micrometre.
fn place(position_m: DVec3) -> Value {
    json!(position_m.to_array().map(|x| (x * 1e7).round() / 1e7))
}

fn talk(shared: &(Mutex<Queue>, Condvar), channel: &ChannelName, tell: &dyn Fn(Told)) {
    let mut client = None;
    loop {
        let request = {
            let mut queue = shared.0.lock().unwrap_or_else(PoisonError::into_inner);
            loop {
                match queue.waiting.pop_front() {
                    Some(request) => break request,
                    None if queue.closed => return,
                    None => queue = shared.1.wait(queue).unwrap_or_else(PoisonError::into_inner),
                }
            }
        };
        tell(match ask(&mut client, channel, &request) {
            Ok(frame) => Told::Done { request, frame },
            Err(reason) => Told::Failed { request, reason },
        });
    }
}

/// Sends one request, over the connection that is there if it still is.
fn ask(client: &mut Option<ControlClient>, channel: &ChannelName, request: &Request) -> Result<u64, String> {
    for _ in 0..=RETRIES {
        let (mut connection, is_old) = match client.take() {
            Some(connection) if connection.is_alive() => (connection, true),
            _ => (ControlClient::connect(channel).map_err(|e| e.to_string())?, false),
        };
        match connection.request(request, REPLY_LIMIT) {
            Ok(reply) => {
                *client = Some(connection);
                match reply {
                    Reply::Ok { frame } => return Ok(frame),
                    Reply::State { .. } => return Ok(0),
                    Reply::Error { message, .. } => return Err(message),
                    Reply::Overloaded => std::thread::sleep(RETRY_AFTER),
                }
            }
            // The simulator has been started again since.
            Err(ProtocolError::PublisherGone { .. }) if is_old => {}
            Err(error) => return Err(error.to_string()),
        }
    }
    Err("the simulator is overloaded; try again".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place_of(name: &str, x: f64) -> Request {
        place_object(name, DVec3::X * x)
    }

    #[test]
    fn only_the_newest_edit_of_each_thing_waits() {
        let mut queue = Queue::default();
        for i in 0..100 {
            queue.push(place_of("ball", f64::from(i)));
            queue.push(switch_light("ball", i % 2 == 0));
        }
        queue.push(Request::Pause);
        queue.push(power_light(
            "ball",
            Vec3::new(0.1, 12.5, 3e-7),
            &LightShape::Point { position: Vec3::ZERO },
        ));
        queue.push(place_of("box", 1.0));
        queue.push(Request::Step);
        queue.push(Request::Step);
        let list = |key: &str, i: i32| Request::SetVpls { values: value(key, json!([i])) };
        for request in
            [list("vpl", 1), list("blocker", 2), list("vpl", 3), Request::SaveVpls {}, list("vpl", 4)]
        {
            queue.push(request);
        }
        let mut lists = value("vpl", json!([3]));
        lists.insert("blocker".into(), json!([2]));
        let mut both = value("enabled", json!(false));
        both.insert("power_w".into(), json!([0.1, 12.5, 3e-7]));
        let expected = [
            place_of("ball", 99.0),
            Request::SetLight { name: "ball".into(), values: both },
            Request::Pause,
            place_of("box", 1.0),
            Request::Step,
            Request::Step,
            Request::SetVpls { values: lists },
            Request::SaveVpls {},
            list("vpl", 4),
        ];
        assert_eq!(queue.waiting, expected);
    }

    #[test]
    fn numbers_are_sent_as_people_write_them() {
        assert_eq!(place(DVec3::new(0.1 + 0.2, -0.0, 3000.25)), json!([0.3, -0.0, 3000.25]));
    }

    #[test]
    fn without_a_simulator_every_request_gets_its_reason() {
        let (sender, told) = std::sync::mpsc::channel();
        let channel = format!("no-such-{}", std::process::id()).parse().unwrap();
        let commands = Commands::start(channel, move |t| sender.send(t).unwrap()).unwrap();
        commands.send(place_light("lamp", DVec3::ONE));
        let Told::Failed { request: Request::SetLight { name, .. }, reason } = told.recv().unwrap() else {
            panic!("sent to nobody")
        };
        assert!(name == "lamp" && reason.contains("no-such-"), "{reason}");
        commands.send(switch_light("lamp", false));
        assert!(matches!(told.recv().unwrap(), Told::Failed { .. }));
    }
}
