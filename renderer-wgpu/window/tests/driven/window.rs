//! Turns the window's program into a process that is pushed, dragged and listened to.

use crate::{display::Display, simulator::Simulator};
use glam::Vec3;
use photonstream_film::Film;
use photonstream_protocol::ChannelName;
use photonstream_shading::Camera;
use std::{
    io::{BufRead, BufReader},
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

/// A watchdog, not a limit: an idle machine needs a hundredth.
const WATCHDOG: Duration = Duration::from_secs(120);
/// So long without a new picture, the window is taken to be at rest.
const QUIET: Duration = Duration::from_millis(700);

/// A window on a virtual display.
pub(crate) struct Window<'a> {
    display: &'a Display,
    process: Child,
    lines: Arc<Mutex<Vec<String>>>,
    folder: tempfile::TempDir,
    id: Option<String>,
    shots: u32,
}

/// A screenshot, and from where it was taken.
pub(crate) struct Shot {
    pub(crate) film: Film,
    pub(crate) camera: Camera,
}

impl<'a> Window<'a> {
    pub(crate) fn open(display: &'a Display, channel: &ChannelName, size: (u32, u32), more: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut process = Command::new(env!("CARGO_BIN_EXE_photonstream-window"))
            .args(["--channel", channel.as_str(), "--software", "--size", &format!("{}x{}", size.0, size.1)])
            .arg("--out")
            .arg(folder.path())
            .args(more)
            .env("DISPLAY", &display.name)
            .env_remove("WAYLAND_DISPLAY")
            .env("RUST_LOG", "info,photonstream_window=debug")
            .env("NO_COLOR", "1")
            .env("PHOTONSTREAM_CACHE", "off")
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = Arc::new(Mutex::new(Vec::new()));
        let (heard, stderr) = (Arc::clone(&lines), process.stderr.take().unwrap());
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                heard.lock().unwrap().push(line);
            }
        });
        Self { display, process, lines, folder, id: None, shots: 0 }
    }

    fn id(&mut self) -> String {
        let display = self.display;
        let id = self.id.get_or_insert_with(|| {
            let found = display.hands(&["search", "--sync", "--onlyvisible", "--name", "photonstream"]);
            let id = found.lines().next().unwrap().to_owned();
            // Nobody manages windows here: the keyboard is given by hand.
            display.hands(&["windowmove", "--sync", &id, "10", "10", "windowfocus", "--sync", &id]);
            id
        });
        id.clone()
    }

    /// Pictures shown so far.
    pub(crate) fn presented(&self) -> usize {
        self.lines.lock().unwrap().iter().filter(|line| line.contains("presented ")).count()
    }

    /// Whether the program has said so.
    pub(crate) fn said(&self, what: &str) -> bool {
        self.lines.lock().unwrap().iter().any(|line| line.contains(what))
    }

    /// Waits until `is_done`.
    pub(crate) fn wait(&mut self, what: &str, mut is_done: impl FnMut(&Self) -> bool) {
        let start = Instant::now();
        while !is_done(self) {
            let ended = self.process.try_wait().unwrap();
            let lines = self.lines.lock().unwrap();
            let last = lines[lines.len().saturating_sub(30)..].join("\n");
            assert!(ended.is_none(), "the window has ended ({ended:?}) while waiting for {what}:\n{last}");
            assert!(start.elapsed() < WATCHDOG, "no {what}:\n{last}");
            drop(lines);
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until the light has converged and the window has shown it.
    pub(crate) fn rest(&mut self, simulator: &mut Simulator) {
        let mut last = (0, 0, Instant::now());
        self.wait("rest", |window| {
            let is_at_rest = simulator.is_at_rest();
            let now = (window.presented(), simulator.newest().frame);
            if !is_at_rest || now.0 == 0 || now != (last.0, last.1) {
                last = (now.0, now.1, Instant::now());
            }
            last.2.elapsed() > QUIET
        });
    }

    pub(crate) fn key(&mut self, key: &str) {
        self.id();
        self.display.hands(&["key", key]);
    }

    /// Holds a key down until so many pictures were shown meanwhile, however long each takes.
    pub(crate) fn hold_key(&mut self, key: &str, pictures: usize) {
        self.id();
        let before = self.presented();
        self.display.hands(&["keydown", key]);
        self.wait("pictures while a key is held", |window| window.presented() >= before + pictures);
        self.display.hands(&["keyup", key]);
    }

    /// Puts the cursor at a place of the window.
    pub(crate) fn point(&mut self, (x, y): (i32, i32)) {
        let id = self.id();
        self.display.hands(&["mousemove", "--window", &id, &x.to_string(), &y.to_string()]);
    }

    /// Presses a button at one place of the window and releases it at another, in eight steps.
    pub(crate) fn drag(&mut self, from: (i32, i32), to: (i32, i32), button: u32) {
        let (id, button) = (self.id(), button.to_string());
        let go = |(x, y): (i32, i32)| {
            self.display.hands(&["mousemove", "--window", &id, &x.to_string(), &y.to_string()]);
            std::thread::sleep(Duration::from_millis(30));
        };
        go(from);
        self.display.hands(&["mousedown", &button]);
        for step in 1..=8 {
            go((from.0 + (to.0 - from.0) * step / 8, from.1 + (to.1 - from.1) * step / 8));
        }
        self.display.hands(&["mouseup", &button]);
    }

    pub(crate) fn resize(&mut self, width: u32, height: u32) {
        let id = self.id();
        self.display.hands(&["windowsize", &id, &width.to_string(), &height.to_string()]);
    }

    /// Gives it the keyboard.
    pub(crate) fn focus(&mut self) {
        let id = self.id();
        self.display.hands(&["windowfocus", "--sync", &id]);
    }

    /// Takes it off the screen.
    pub(crate) fn unmap(&mut self) {
        let id = self.id();
        self.display.hands(&["windowunmap", "--sync", &id]);
    }

    /// Puts it back.
    pub(crate) fn map(&mut self) {
        let id = self.id();
        self.display.hands(&["windowmap", "--sync", &id]);
    }

    /// Asks the window manager to make an icon of it.
    pub(crate) fn minimise(&mut self) {
        let id = self.id();
        self.display.hands(&["windowminimize", "--sync", &id]);
    }

    /// Asks the window manager to put it back and before all others.
    pub(crate) fn restore(&mut self) {
        let id = self.id();
        self.display.hands(&["windowactivate", "--sync", &id]);
    }

    /// Presses the key for a screenshot and reads the file.
    pub(crate) fn screenshot(&mut self) -> Shot {
        self.shots += 1;
        let path =
            |end: &str| -> PathBuf { self.folder.path().join(format!("screenshot-{:04}.{end}", self.shots)) };
        let (exr, png) = (path("exr"), path("png"));
        let said = format!("{}: frame", exr.display());
        self.key("p");
        self.wait("screenshot", |window| window.said(&said) && png.exists());
        let lines = self.lines.lock().unwrap();
        let line = lines.iter().find(|line| line.contains(&said)).unwrap();
        Shot { film: Film::read_exr(&exr).unwrap(), camera: camera(line) }
    }

    /// Asks the program to end.
    pub(crate) fn terminate(&self) {
        let pid = self.process.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    }

    /// Waits until the program has ended well.
    pub(crate) fn expect_end(&mut self) {
        let start = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait().unwrap() {
                assert_eq!(status.code(), Some(0), "{}", self.lines.lock().unwrap().join("\n"));
                return;
            }
            assert!(start.elapsed() < WATCHDOG, "the window does not end");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The camera that a line tells: `Camera { position: Vec3(x, y, z), …, tan_half_fov: t }`.
fn camera(line: &str) -> Camera {
    let text = line.split("Camera {").nth(1).unwrap().replace("Vec3", "");
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | 'e');
    let numbers = text.split(|c| !is_number(c)).filter_map(|word| word.parse::<f32>().ok());
    let numbers: Vec<_> = numbers.collect();
    assert_eq!(numbers.len(), 13, "{line}");
    let vector = |i: usize| Vec3::from_slice(&numbers[3 * i..3 * i + 3]);
    Camera {
        position: vector(0),
        forward: vector(1),
        right: vector(2),
        up: vector(3),
        tan_half_fov: numbers[12],
    }
}

/// The pixel of a window of `size` that shows `point`.
pub(crate) fn on_screen(camera: &Camera, point: Vec3, size: (u32, u32)) -> (i32, i32) {
    let d = point - camera.position;
    let scale = size.1 as f32 / (2.0 * camera.tan_half_fov * d.dot(camera.forward));
    let x = 0.5 * size.0 as f32 + d.dot(camera.right) * scale;
    let y = 0.5 * size.1 as f32 - d.dot(camera.up) * scale;
    (x as i32, y as i32)
}
