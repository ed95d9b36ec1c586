//! A director whose placer is the test: what happens while lights are placed does not depend on how long it takes.
#![allow(clippy::unwrap_used)]

use super::{Director, Event, Options};
use crate::{
    service::{
        placer::{Order, Placed},
        watcher::News,
    },
    simulation::Simulation,
};
use photonstream_protocol::{ChannelName, ControlClient, Reply, Request};
use photonstream_scene::{Scene, SceneConfig};
use serde_json::{Value, json};
use std::{
    path::Path,
    sync::Arc,
    thread::JoinHandle,
    time::{Duration, Instant},
};

const PATIENCE: Duration = Duration::from_secs(60);

/// A closed room with a ball and a lamp, and whatever else is asked for.
fn scene(more: &str, vsls: u32, streaming: &str) -> Scene {
    let text = format!(
        "[camera]\nposition_m = [0, 0, 5]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n\
         [material.a]\nalbedo = 0.6\n\
         [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
         [object.ball]\nmaterial = \"a\"\nsphere = {{ radius_m = 0.3, segments = 12 }}\n\
         [light.lamp]\npower_w = 3\npoint = {{ position_m = [0.7, 0.7, 0.7] }}\n{more}\n\
         [streaming]\nvsls = {vsls}\npool_paths = 1000\npublish_period_ms = 1\n{streaming}\n"
    );
    SceneConfig::from_text(&text, Path::new("test.toml")).unwrap().build().unwrap()
}

struct Directed {
    director: Director,
    channel: ChannelName,
    orders: flume::Receiver<Order>,
    /// A placer that is there.
    _placer: flume::Sender<Option<Box<Placed>>>,
}

fn start(name: &str, scene: Scene) -> Directed {
    let channel: ChannelName = format!("u{}-{name}", std::process::id()).parse().unwrap();
    let options = Options { channel: channel.clone(), threads: Some(1), ..Options::default() };
    let mut director = Director::start(Simulation::new(Arc::new(scene)), &options).unwrap();
    let (to_placer, orders) = flume::bounded(1);
    director.to_placer = to_placer;
    let (placer, placed) = flume::bounded(1);
    director.placed = placed;
    Directed { director, channel, orders, _placer: placer }
}

fn placed_anew(simulation: Simulation) -> Box<Placed> {
    Box::new(Placed { simulation, moved: None })
}

impl Directed {
    /// Sends a request, and lets the director have it.
    fn ask(&mut self, request: Value) -> JoinHandle<Reply> {
        let (channel, request) = (self.channel.clone(), serde_json::from_value::<Request>(request).unwrap());
        let client = std::thread::spawn(move || {
            ControlClient::connect(&channel).unwrap().request(&request, PATIENCE).unwrap()
        });
        let incoming = self.director.server.requests().recv_timeout(PATIENCE).unwrap();
        assert_eq!(self.director.handle(Event::Request(incoming)), None);
        client
    }

    /// The answer that a request gets at once.
    fn answer(&mut self, request: Value) -> Reply {
        self.ask(request).join().unwrap()
    }

    fn accept(&mut self, request: Value) {
        let reply = self.answer(request);
        assert!(matches!(reply, Reply::Ok { .. }), "{reply:?}");
    }

    fn state(&mut self) -> Value {
        match self.answer(json!({ "type": "query" })) {
            Reply::State { state } => state,
            other => panic!("{other:?}"),
        }
    }

    /// The order that the placer has.
    fn order(&self) -> Order {
        self.orders.recv_timeout(PATIENCE).unwrap()
    }

    /// Answers an order, as the placer does.
    fn place(&mut self, order: &Order) {
        let placed = order.base.reloaded_unless(Arc::clone(&order.scene), &order.cancel);
        self.director.handle(Event::Placed(placed.map(placed_anew)));
    }

    fn lights(&self) -> usize {
        self.director.simulation.placement.vsls.len()
    }

    fn running(&self) -> &Scene {
        &self.director.simulation.scene
    }

    fn end(self) {
        let Self { director, channel, orders, _placer } = self;
        drop(orders);
        director.end(Some(super::Ending::Stopped)).unwrap();
        photonstream_protocol::clean_one(&channel).unwrap();
    }
}

fn ok(client: JoinHandle<Reply>) -> u64 {
    match client.join().unwrap() {
        Reply::Ok { frame } => frame,
        other => panic!("{other:?}"),
    }
}

fn move_object(name: &str, keys: Value) -> Value {
    json!({ "type": "move_object", "name": name, "values": keys })
}

fn set_light(name: &str, power_w: f64) -> Value {
    json!({ "type": "set_light", "name": name, "values": { "power_w": power_w } })
}

fn set_vsls(vsls: u32) -> Value {
    json!({ "type": "set_streaming", "values": { "vsls": vsls } })
}

fn power(scene: &Scene, light: &str) -> f32 {
    scene.lights[scene.light(light).unwrap().0 as usize].light.power.x
}

fn place_of(scene: &Scene, object: &str) -> [f64; 3] {
    scene.objects[scene.object(object).unwrap().0 as usize].world_from_rest.translation.to_array()
}

/// Queries, pauses and edits are answered before the lights are placed; the edit is in the present scene and in the next
/// one, which is that of a new simulation.
#[test]
fn everything_is_answered_while_lights_are_placed() {
    let mut directed = start("answers", scene("", 80, ""));
    assert_eq!(directed.state()["placing"], false);
    let waits = directed.ask(set_vsls(130));
    let order = directed.order();
    assert_eq!((directed.state()["placing"].clone(), directed.lights()), (json!(true), 80));
    directed.accept(json!({ "type": "pause" }));
    directed.accept(set_light("lamp", 5.0));
    directed.accept(move_object("ball", json!({ "position_m": [0.2, 0, 0] })));
    assert_eq!((power(directed.running(), "lamp"), place_of(directed.running(), "ball")[0]), (5.0, 0.2));
    assert_eq!(power(&order.scene, "lamp"), 3.0, "the placer has the scene as it was ordered");
    assert!(!order.cancel.is_cancelled() && !waits.is_finished());
    directed.place(&order);
    ok(waits);
    assert_eq!((directed.lights(), directed.state()["placing"].clone()), (130, json!(false)));
    assert_eq!((power(directed.running(), "lamp"), place_of(directed.running(), "ball")[0]), (5.0, 0.2));
    assert_eq!(directed.state()["paused"], true);
    let anew = Simulation::new(Arc::new(scene("", 130, "")));
    assert!(directed.director.simulation.placement == anew.placement);
    assert!(directed.director.simulation.owners == anew.owners);
    directed.end();
}

/// What is outdated is cancelled, and dropped should it come all the same; who waited for it is answered with the newest.
#[test]
fn the_newest_wins() {
    let mut directed = start("newest", scene("", 80, ""));
    let first = directed.ask(set_vsls(90));
    let order = directed.order();
    let second = directed.ask(set_vsls(100));
    let third = directed.ask(set_vsls(110));
    assert!(order.cancel.is_cancelled() && directed.orders.is_empty(), "one order at a time");
    // It was ready before it heard of that.
    let late = order.base.reloaded(Arc::clone(&order.scene));
    directed.director.handle(Event::Placed(Some(placed_anew(late))));
    assert_eq!(directed.lights(), 80);
    let order = directed.order();
    assert_eq!(order.scene.streaming.vsls, 110);
    // A config wins over settings, and settings go into a config that is to come.
    let hear = |directed: &mut Directed, scene| {
        directed.director.handle(Event::News(News::Scene(Box::new(scene), None)))
    };
    hear(&mut directed, scene("[light.other]\npower_w = 2\npoint = { position_m = [0, 0.9, 0] }", 120, ""));
    let fourth = directed.ask(json!({ "type": "set_streaming", "values": { "pool_paths": 2000 } }));
    assert!(order.cancel.is_cancelled());
    directed.place(&order);
    assert_eq!(directed.lights(), 80);
    let order = directed.order();
    directed.place(&order);
    let frames = [first, second, third, fourth].map(ok);
    assert!(frames.iter().all(|&frame| frame == frames[0]), "{frames:?}");
    let streaming = &directed.running().streaming;
    assert_eq!((directed.lights(), streaming.vsls, streaming.pool_paths), (120, 120, 2000));
    assert_eq!((directed.running().lights.len(), directed.director.still.config_generation), (2, 2));
    assert!(directed.orders.is_empty());
    directed.end();
}

/// A config replaces what was set before it, and not what is set after it, where it has something of that name.
#[test]
fn edits_meet_a_config_that_is_to_come() {
    let lamp = "[light.other]\npower_w = 2\npoint = { position_m = [0, 0.9, 0] }\n";
    let crate_ =
        "[object.crate]\nmaterial = \"a\"\nposition_m = [0.5, 0, 0]\nbox = { size_m = [0.1, 0.1, 0.1] }\n";
    let mut directed = start("edits", scene(crate_, 80, ""));
    directed.accept(set_light("lamp", 7.0));
    directed.accept(move_object("ball", json!({ "position_m": [0.1, 0, 0] })));
    directed.director.handle(Event::News(News::Scene(Box::new(scene(lamp, 80, "")), None)));
    let order = directed.order();
    // In both, in the present one alone, in the next one alone, in none.
    directed.accept(move_object("ball", json!({ "position_m": [0, 0.2, 0] })));
    directed.accept(move_object("crate", json!({ "position_m": [0.5, 0.3, 0] })));
    let other = directed.ask(set_light("other", 4.0));
    let Reply::Error { code, .. } = directed.answer(set_light("moon", 1.0)) else { panic!() };
    assert_eq!((code.as_str(), other.is_finished()), ("unknown-name", false));
    assert_eq!(place_of(directed.running(), "crate"), [0.5, 0.3, 0.0]);
    // Broken meanwhile: that is told, and stays.
    directed.director.handle(Event::News(News::Broken("line 3".into())));
    assert_eq!(&*directed.director.still.notice, "line 3");
    directed.place(&order);
    ok(other);
    let running = directed.running();
    assert_eq!((power(running, "lamp"), power(running, "other")), (3.0, 4.0));
    assert_eq!((place_of(running, "ball"), running.object("crate")), ([0.0, 0.2, 0.0], None));
    assert_eq!(&*directed.director.still.notice, "line 3");
    directed.end();
}

/// A resized object waits for its lights, and does not cancel those of the size before: a drag shows something.
#[test]
fn sizes_are_placed_one_after_the_other() {
    let mut directed = start("sizes", scene("", 80, ""));
    let scale = |directed: &Directed| {
        let geometry = &directed.running().geometry;
        let ball = &directed.running().objects[directed.running().object("ball").unwrap().0 as usize];
        let radius = ball.triangles.clone().flat_map(|t| geometry.rest_triangle(t)).map(|p| p.length());
        (radius.fold(0.0, f32::max) / 0.03).round()
    };
    let first = directed.ask(move_object("ball", json!({ "scale": 1.5 })));
    let order = directed.order();
    let others = [2.0, 2.5].map(|scale| directed.ask(move_object("ball", json!({ "scale": scale }))));
    directed.accept(set_light("lamp", 5.0));
    assert!(!order.cancel.is_cancelled());
    assert_eq!(scale(&directed), 10.0);
    directed.place(&order);
    ok(first);
    assert_eq!((scale(&directed), power(directed.running(), "lamp")), (15.0, 5.0));
    let order = directed.order();
    directed.place(&order);
    others.into_iter().for_each(|other| _ = ok(other));
    assert_eq!((scale(&directed), power(directed.running(), "lamp")), (25.0, 5.0));
    assert!(directed.orders.is_empty() && !directed.director.placements.are_awaited());
    directed.end();
}

/// An end in the middle tells those who wait, and cancels.
#[test]
fn an_end_does_not_wait_for_lights() {
    let mut directed = start("ended", scene("", 80, ""));
    let waits = directed.ask(set_vsls(130));
    let order = directed.order();
    directed.end();
    assert!(order.cancel.is_cancelled());
    // Whether the answer or the end of the socket is first.
    let answer = waits.join();
    assert!(answer.is_err() || matches!(answer.unwrap(), Reply::Error { .. }));
}

fn spot(keyframes: &str, repeat: &str, streaming: &str) -> Scene {
    let more = format!(
        "[light.spot]\npower_w = 1\nspot = {{ position_m = [-0.5, 0.5, 0], target_m = [0, 0, 0], outer_half_angle_deg = 30 }}\n\
         [[animation]]\nlight = \"spot\"\nrepeat = \"{repeat}\"\n{keyframes}"
    );
    scene(&more, 80, streaming)
}

/// Once what moves once is over, time is not looked at any more, and edits stay; before, it is in each of 8 ticks.
#[test]
fn an_ended_animation_does_not_tick() {
    let keyframes = "property = \"power_w\"\ntimes_s = [0, 2]\nvalues = [1, 9]";
    for (repeat, most) in [("once", 8), ("loop", 100)] {
        let mut directed = start(&format!("over-{repeat}"), spot(keyframes, repeat, ""));
        let (mut now, mut ticks) = (Instant::now(), 0);
        while directed.director.due().is_some() && ticks < 100 {
            // The longest time that is made up for.
            now += Duration::from_millis(250);
            directed.director.tick(now);
            ticks += 1;
        }
        assert!(ticks == most || (repeat == "once" && ticks == most + 1), "{repeat}: {ticks} ticks");
        if repeat == "once" {
            assert_eq!(power(directed.running(), "spot"), 9.0);
            directed.accept(set_light("spot", 4.0));
            let waits = directed.ask(set_vsls(90));
            let order = directed.order();
            directed.place(&order);
            ok(waits);
            assert_eq!((power(directed.running(), "spot"), directed.director.due()), (4.0, None));
        }
        directed.end();
    }
}

/// In steps of 0.5 s a spot meets its own target at 1 s, where it cannot be: it stands still there, and goes on.
#[test]
fn an_impossible_instant_is_passed_over() {
    let keyframes = "property = \"position_m\"\ntimes_s = [0, 2]\nvalues = [[-0.5, 0, 0], [0.5, 0, 0]]";
    let mut directed = start("instant", spot(keyframes, "once", "fixed_step_ms = 500"));
    let mut seen = Vec::new();
    while directed.director.is_moving() {
        while directed.director.due().is_none() {
            let told = directed.director.from_ledger.recv_timeout(PATIENCE).unwrap();
            directed.director.handle(Event::Ledger(told));
        }
        directed.director.tick(Instant::now());
        let spot = directed.running().light("spot").unwrap().0 as usize;
        let photonstream_shading::LightShape::Spot { position, .. } =
            directed.running().lights[spot].light.shape
        else {
            panic!()
        };
        seen.push(position.x + directed.running().origin_m.x as f32);
    }
    assert_eq!(seen, [-0.25, -0.25, 0.25, 0.5]);
    assert!(
        directed.director.animation_error.contains("light.spot"),
        "{}",
        directed.director.animation_error
    );
    directed.end();
}

/// A resized object that is animated is shown as it was when its lights began to be placed, whatever time it is; a step
/// is answered once it is shown.
#[test]
fn animated_sizes_are_placed_too() {
    let more = "[[animation]]\nobject = \"ball\"\nproperty = \"scale\"\ntimes_s = [0, 4]\nvalues = [1, 2]";
    let mut directed = start("animated", scene(more, 80, ""));
    let mut now = Instant::now();
    let mut tick = |directed: &mut Directed| {
        now += Duration::from_millis(250);
        directed.director.tick(now);
    };
    tick(&mut directed);
    let order = directed.order();
    for _ in 0..3 {
        tick(&mut directed);
    }
    assert!(directed.orders.is_empty() && !order.cancel.is_cancelled());
    let then_s = directed.director.clock.time_s();
    assert!(directed.director.animated_s == 0.0 && then_s >= 0.75);
    directed.place(&order);
    assert!((directed.director.animated_s - 0.25).abs() < 0.25 && directed.director.animated_s > 0.0);
    tick(&mut directed);
    let order = directed.order();
    directed.place(&order);
    assert!(directed.director.animated_s > then_s);
    directed.accept(json!({ "type": "pause" }));
    let step = directed.ask(json!({ "type": "step" }));
    let order = directed.order();
    let Reply::Error { code, .. } = directed.answer(json!({ "type": "step" })) else { panic!() };
    assert!(code == "busy" && !step.is_finished());
    directed.place(&order);
    ok(step);
    assert_eq!(directed.director.animated_s, directed.director.clock.time_s());
    directed.end();
}

/// A watcher that dies is told of, once; everything else goes on.
#[test]
fn a_dead_watcher_is_told() {
    let mut directed = start("unwatched", scene("", 80, ""));
    let (told, news) = flume::bounded::<News>(1);
    let (never, _stopped) = flume::bounded(1);
    let watcher = std::thread::spawn(move || drop(told));
    directed.director.news = news;
    directed.director.watching = Some((never, watcher));
    let (stop, stopped) = flume::bounded(1);
    loop {
        let event = directed.director.wait(&stopped);
        let is_it = matches!(event, Event::Unwatched);
        // The placer that was replaced may be first.
        assert!(is_it || matches!(event, Event::Ledger(_) | Event::ActorGone));
        directed.director.handle(event);
        if is_it {
            break;
        }
    }
    assert!(directed.director.still.notice.contains("changes need --reload"));
    // It is not asked again: what comes next is something else.
    stop.send(()).unwrap();
    while !matches!(directed.director.wait(&stopped), Event::Stop) {}
    let notice = directed.state()["notice"].as_str().unwrap().to_owned();
    assert!(notice.contains("watcher"), "{notice}");
    directed.end();
}
