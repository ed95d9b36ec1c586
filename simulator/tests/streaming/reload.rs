//! Configs that are saved while they are simulated: every valid text is shown, and no broken one.
#![allow(clippy::unwrap_used)]

use crate::{
    service::{PATIENCE, Service, start_with},
    service_edits::{flux, frame_where, is_converged},
};
use photonstream_protocol::{Reply, Request, Subscriber, VslFrame};
use photonstream_simulator::{
    service::{ConfigSource, Options},
    simulation::Simulation,
};
use serde_json::json;
use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

/// A closed room with a ball; `x` is where the ball is.
fn text(x: f64, vsls: u32, albedo: f64) -> String {
    format!(
        "[camera]\nposition_m = [0, 0, 5]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n\
         [material.a]\nalbedo = [{albedo:?}, 0.5, 0.3]\n\
         [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
         [object.ball]\nmaterial = \"a\"\nposition_m = [{x:?}, 0, 0]\nsphere = {{ radius_m = 0.3, segments = 12 }}\n\
         [light.bulb]\npower_w = 3\npoint = {{ position_m = [0.7, 0.7, 0.7] }}\n\
         [streaming]\nvsls = {vsls}\npool_paths = 3000\npublish_period_ms = 2\n"
    )
}

fn write(path: &Path, text: &str) {
    fs::write(path, text).unwrap();
}

/// As editors do: another file takes the place of the old one.
fn replace(path: &Path, text: &str) {
    let other = path.with_extension("tmp");
    write(&other, text);
    fs::rename(other, path).unwrap();
}

struct Edited {
    _folder: tempfile::TempDir,
    path: PathBuf,
    service: Service,
    subscriber: Subscriber,
}

fn start(name: &str) -> Edited {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("scenes")).unwrap();
    let path = folder.path().join("scenes/room.toml");
    write(&path, &text(0.0, 80, 0.8));
    let mut source = ConfigSource::new(&path, Default::default());
    let simulation = Simulation::new(Arc::new(source.load().unwrap()));
    let options = Options { threads: Some(2), config: Some(source), ..Options::default() };
    let service = start_with(name, &simulation, options);
    let mut subscriber = service.attach();
    frame_where(&mut subscriber, 1, |_| (), is_converged);
    Edited { _folder: folder, path, service, subscriber }
}

impl Edited {
    /// The light that a simulation of `text` converges to.
    fn expected(&self, text: &str) -> Vec<[f32; 3]> {
        let config = photonstream_scene::SceneConfig::from_text(text, &self.path).unwrap();
        let simulation = Simulation::new(Arc::new(config.build().unwrap()));
        simulation.fill().readings(&simulation.scene).map(|r| r.flux.to_array()).collect()
    }

    /// Waits until the light is that of `text`; every frame on the way has light.
    fn wait_for(&mut self, text: &str) -> VslFrame {
        let expected = self.expected(text);
        let is_lit = |frame: &VslFrame| {
            assert!(flux(frame).iter().flatten().sum::<f32>() > 0.1, "frame {} is dark", frame.frame);
        };
        frame_where(&mut self.subscriber, 1, is_lit, |f| is_converged(f) && flux(f) == expected)
    }

    fn wait_for_notice(&mut self, part: &str) -> VslFrame {
        frame_where(&mut self.subscriber, 1, |_| (), |f| f.notice.contains(part))
    }

    fn end(self) {
        self.service.end();
    }
}

/// A saved place, size of the set of lights and colour are shown; a broken text is told with its line, and the last valid
/// one goes on, whichever way the file was saved.
#[test]
fn what_is_saved_is_simulated() {
    let mut edited = start("saved");
    let path = edited.path.clone();
    write(&path, &text(0.3, 80, 0.8));
    let frame = edited.wait_for(&text(0.3, 80, 0.8));
    assert_eq!((frame.config_generation, &*frame.notice), (2, ""));
    // Another number of lights: the segment grows, and no path is traced again.
    let before = frame.statistics.paths_total;
    replace(&path, &text(0.3, 150, 0.8));
    let frame = edited.wait_for(&text(0.3, 150, 0.8));
    assert_eq!((frame.vsls.len(), frame.statistics.paths_total), (150, before));
    replace(&path, &text(0.3, 150, 0.1));
    edited.wait_for(&text(0.3, 150, 0.1));

    write(&path, &text(0.3, 150, 0.1).replace("segments", "segmnts"));
    let broken = edited.wait_for_notice("room.toml:14:");
    assert!(broken.notice.contains("did you mean \"segments\"?"), "{}", broken.notice);
    assert_eq!(flux(&broken), edited.expected(&text(0.3, 150, 0.1)));
    // Saved again as it was: nothing is to be said any more.
    write(&path, &text(0.3, 150, 0.1));
    let restored = frame_where(&mut edited.subscriber, 1, |_| (), |f| f.notice.is_empty());
    assert_eq!(restored.config_generation, broken.config_generation);

    // Emptied, as an editor does before it writes; then all of it.
    write(&path, "");
    std::thread::sleep(Duration::from_millis(300));
    write(&path, &text(-0.2, 150, 0.1));
    let frame = edited.wait_for(&text(-0.2, 150, 0.1));
    assert_eq!(frame.config_generation, broken.config_generation + 1, "an empty file is no scene");

    // The file goes and comes back; then its folder.
    fs::remove_file(&path).unwrap();
    edited.wait_for_notice("cannot be read");
    write(&path, &text(0.1, 60, 0.5));
    edited.wait_for(&text(0.1, 60, 0.5));
    let folder = path.parent().unwrap();
    fs::rename(folder, folder.with_extension("old")).unwrap();
    edited.wait_for_notice("cannot be read");
    fs::create_dir(folder).unwrap();
    write(&path, &text(0.2, 60, 0.5));
    edited.wait_for(&text(0.2, 60, 0.5));
    // The new folder is watched again.
    replace(&path, &text(0.25, 60, 0.5));
    edited.wait_for(&text(0.25, 60, 0.5));
    edited.end();
}

/// N = 300 saves, 100 a second, in three ways, every third broken, some cut in the middle: every frame has light, and the
/// last valid text wins.
#[test]
fn a_storm_of_saves_ends_in_the_last_valid_text() {
    let mut edited = start("saves");
    let path = edited.path.clone();
    let saver = std::thread::spawn(move || {
        for save in 0..300 {
            let good = text(f64::from(save % 50) * 0.01 - 0.25, 40 + save % 60, 0.8);
            let saved = match save % 3 {
                0 => good[..good.len() * (save as usize % 97) / 97].to_owned(),
                _ => good,
            };
            match save % 4 {
                0 => write(&path, &saved),
                1 => replace(&path, &saved),
                2 => {
                    fs::remove_file(&path).unwrap();
                    write(&path, &saved);
                }
                _ => {
                    // In two parts.
                    let mut file = fs::File::create(&path).unwrap();
                    let (first, second) = saved.as_bytes().split_at(saved.len() / 2);
                    std::io::Write::write_all(&mut file, first).unwrap();
                    std::thread::sleep(Duration::from_millis(3));
                    std::io::Write::write_all(&mut file, second).unwrap();
                }
            }
            std::thread::sleep(Duration::from_millis(7));
        }
        // The last valid one, and one that is not.
        replace(&path, &text(0.33, 90, 0.6));
        std::thread::sleep(Duration::from_secs(1));
        write(&path, "[object.");
    });
    let last = edited.wait_for(&text(0.33, 90, 0.6));
    saver.join().unwrap();
    let broken = edited.wait_for_notice("not valid TOML");
    assert_eq!((flux(&broken), broken.vsls.len()), (flux(&last), 90));
    edited.end();
}

/// Settings by the control socket: another number of lights gives the deposits to other owners and traces nothing; another
/// pool traces what is missing; what cannot be is refused.
#[test]
fn settings_change_while_light_goes_on() {
    let mut edited = start("settings");
    let mut client = edited.service.connect();
    let mut set = |keys: serde_json::Value| {
        let values = keys.as_object().unwrap().clone();
        client.request(&Request::SetStreaming { values }, PATIENCE).unwrap()
    };
    let before = edited.subscriber.frame().unwrap().statistics.paths_total;
    assert!(matches!(set(json!({ "vsls": 57 })), Reply::Ok { .. }));
    let frame = edited.wait_for(&text(0.0, 57, 0.8));
    assert_eq!((frame.vsls.len(), frame.statistics.paths_total), (57, before));
    assert!(matches!(set(json!({ "pool_paths": 5000 })), Reply::Ok { .. }));
    let larger = text(0.0, 57, 0.8).replace("3000", "5000");
    assert_eq!(edited.wait_for(&larger).statistics.paths_total, before + 2000);
    for (keys, code, part) in [
        (json!({ "vsl": 5 }), "unknown-key", "vsl"),
        (json!({ "vsls": "many" }), "unknown-key", "expected u32"),
        (json!({ "vsls": 0 }), "invalid-value", "vsls"),
        (json!({ "threads": 3 }), "invalid-value", "restart"),
    ] {
        let Reply::Error { code: found, message } = set(keys) else { panic!() };
        assert!(found == code && message.contains(part), "{found}: {message}");
    }
    assert!(matches!(set(json!({ "target_error": 0.02 })), Reply::Ok { .. }));
    let refined = frame_where(
        &mut edited.subscriber,
        1,
        |_| (),
        |f| is_converged(f) && f.statistics.target_error == 0.02,
    );
    let (error, more) = (refined.statistics.relative_error, refined.statistics.refined_paths);
    assert!(error <= 0.02 && more > 0, "{error} after {more} paths more");
    // Once it is refined, nothing changes any more.
    std::thread::sleep(Duration::from_millis(300));
    edited.subscriber.read().unwrap();
    assert_eq!(edited.subscriber.frame().unwrap().frame, refined.frame);
    edited.end();
}

/// What cannot be read is told, a file that a config waits for is waited for, and an edited mesh or material library is
/// simulated, though the config's text is the same.
#[test]
fn files_that_a_config_names_are_watched_too() {
    let mut edited = start("assets");
    let (path, folder) = (edited.path.clone(), edited.path.parent().unwrap().to_owned());
    fs::write(&path, [b'#', 0xFF, b'\n']).unwrap();
    edited.wait_for_notice("cannot be read");
    let mesh = "[object.mesh]\nposition_m = [0, -0.6, 0]\nobj = { path = \"mesh.obj\" }\n";
    let with_mesh = text(0.0, 80, 0.8).replace("[light.bulb]", &format!("{mesh}[light.bulb]"));
    write(&path, &with_mesh);
    edited.wait_for_notice("mesh.obj");
    let plate = |size: f64| {
        format!(
            "mtllib mesh.mtl\nusemtl m\nv {0} 0 {0}\nv {0} 0 -{0}\nv -{0} 0 -{0}\nv -{0} 0 {0}\nf 1 2 3\nf 1 3 4\n",
            size
        )
    };
    write(&folder.join("mesh.mtl"), "newmtl m\nKd 0.5 0.5 0.5\n");
    write(&folder.join("mesh.obj"), &plate(0.3));
    let first = edited.wait_for(&with_mesh);
    assert!(first.notice.is_empty());
    write(&folder.join("mesh.obj"), &plate(0.5));
    let larger = edited.wait_for(&with_mesh);
    assert_eq!(larger.config_generation, first.config_generation + 1);
    write(&folder.join("mesh.mtl"), "newmtl m\nKd 0.9 0.1 0.1\n");
    let red = edited.wait_for(&with_mesh);
    assert!(red.config_generation == larger.config_generation + 1 && red.scene_hash != larger.scene_hash);
    edited.end();
}

/// While 100 000 lights are placed, which takes seconds, pauses, queries and edits are answered and shown, and what was
/// edited is in the scene that comes: the light is that of a new simulation. An end in the middle of it does not wait.
#[test]
fn everything_goes_on_while_many_lights_are_placed() {
    let mut edited = start("many");
    let set_vsls = |edited: &Edited, vsls: u32| {
        let mut client = edited.service.connect();
        let values = json!({ "vsls": vsls }).as_object().unwrap().clone();
        let waits = std::thread::spawn(move || client.request(&Request::SetStreaming { values }, PATIENCE));
        let mut client = edited.service.connect();
        loop {
            let Reply::State { state } = client.request(&Request::Query, PATIENCE).unwrap() else { panic!() };
            if state["placing"] == true {
                return (waits, client);
            }
            assert!(!waits.is_finished(), "placed before it was seen");
        }
    };
    let (waits, mut client) = set_vsls(&edited, 100_000);
    assert!(matches!(client.request(&Request::Pause, PATIENCE).unwrap(), Reply::Ok { .. }));
    let values = json!({ "power_w": 6 }).as_object().unwrap().clone();
    let request = Request::SetLight { name: "bulb".into(), values };
    let Reply::Ok { frame: number } = client.request(&request, PATIENCE).unwrap() else { panic!() };
    let shown = frame_where(&mut edited.subscriber, number, |_| (), |_| true);
    assert_eq!((shown.vsls.len(), shown.lights[0].power), (80, [6.0; 3]));
    let Reply::State { state } = client.request(&Request::Query, PATIENCE).unwrap() else { panic!() };
    assert_eq!(
        (&state["placing"], &state["paused"], &state["vsls"]),
        (&json!(true), &json!(true), &json!(80))
    );
    assert!(!waits.is_finished());
    assert!(matches!(client.request(&Request::Resume, PATIENCE).unwrap(), Reply::Ok { .. }));
    assert!(matches!(waits.join().unwrap().unwrap(), Reply::Ok { .. }));
    let many = edited.wait_for(&text(0.0, 100_000, 0.8).replace("power_w = 3", "power_w = 6"));
    assert_eq!(many.vsls.len(), 100_000);

    let (waits, _client) = set_vsls(&edited, 99_999);
    edited.end();
    let answer = waits.join().unwrap();
    assert!(!matches!(answer, Ok(Reply::Ok { .. })), "{answer:?}");
}
