//! Turns the Cornell box into a running simulation on a channel of its own.

use glam::{DAffine3, DVec3};
use photonstream_protocol::{AccessMode, ChannelName, Liveness, Subscriber, VslFrame};
use photonstream_scene::{Scene, SceneConfig};
use photonstream_simulator::{
    cli::Overrides,
    service::{self, ConfigSource, Options},
    simulation::Simulation,
};
use std::{path::Path, sync::Arc, thread::JoinHandle, time::Duration};

/// A simulation in a thread of the test; 200 lights, 4 096 paths, on one tracer.
pub(crate) struct Simulator {
    channel: ChannelName,
    scene: Arc<Scene>,
    running: Option<(std::sync::mpsc::Sender<()>, JoinHandle<()>)>,
    subscriber: Subscriber,
    config: Option<Config>,
}

/// A file that is simulated, and the folder that goes with the test.
struct Config {
    source: ConfigSource,
    _folder: tempfile::TempDir,
}

impl Simulator {
    pub(crate) fn start(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/cornell-box.toml");
        let mut config = SceneConfig::from_file(&path).unwrap();
        config.streaming.vsls = Some(200);
        config.streaming.pool_paths = Some(4096);
        Self::of(name, config.build().unwrap(), None)
    }

    /// The box with `more` in its file, which is simulated where it lies.
    pub(crate) fn start_file(name: &str, more: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/cornell-box.toml");
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("box.toml");
        std::fs::write(&file, std::fs::read_to_string(path).unwrap() + more).unwrap();
        let mut source = ConfigSource::new(&file, Overrides::default());
        let scene = source.load().unwrap();
        Self::of(name, scene, Some(Config { source, _folder: folder }))
    }

    fn of(name: &str, scene: Scene, config: Option<Config>) -> Self {
        let scene = Arc::new(scene);
        let channel: ChannelName = format!("window-{name}-{}", std::process::id()).parse().unwrap();
        let running = Some(run(&scene, &channel, config.as_ref()));
        let forever = Duration::from_secs(60);
        let subscriber = Subscriber::attach_wait(&channel, AccessMode::Mapped, forever, &|| false).unwrap();
        Self { channel, scene, running, subscriber, config }
    }

    /// What the file that is simulated says.
    pub(crate) fn text(&self) -> String {
        let Some(config) = &self.config else { panic!("there is no file") };
        std::fs::read_to_string(&config.source.path).unwrap()
    }

    pub(crate) fn channel(&self) -> &ChannelName {
        &self.channel
    }

    /// The scene as it was loaded.
    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The newest frame.
    pub(crate) fn newest(&mut self) -> &VslFrame {
        for _ in 0..3000 {
            self.subscriber.read().unwrap();
            if self.subscriber.frame().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        self.subscriber.frame().expect("a frame within 30 s")
    }

    /// Whether the light has converged in a simulation that runs.
    pub(crate) fn is_at_rest(&mut self) -> bool {
        // Reading finds the next run, too.
        let is_converged = self.newest().statistics.converged != 0;
        is_converged && self.subscriber.liveness() == Liveness::Live
    }

    /// Where the middle of an object is now, in the scene's space.
    pub(crate) fn place_of(&mut self, object: &str) -> DVec3 {
        let id = self.scene.object(object).unwrap().0;
        let record = *self.newest().objects.iter().find(|o| o.id == id).unwrap();
        DAffine3::from_cols_array(&record.world_from_object).translation
    }

    /// Ends the simulation and starts it again on the same channel.
    pub(crate) fn restart(&mut self) {
        self.stop();
        std::thread::sleep(Duration::from_millis(300));
        self.running = Some(run(&self.scene, &self.channel, self.config.as_ref()));
    }

    fn stop(&mut self) {
        if let Some((stop, thread)) = self.running.take() {
            stop.send(()).unwrap();
            thread.join().unwrap();
        }
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.stop();
        }
        // What remains of a failed test is found by the next `clean`.
        let _ = photonstream_protocol::clean_one(&self.channel);
    }
}

fn run(
    scene: &Arc<Scene>,
    channel: &ChannelName,
    config: Option<&Config>,
) -> (std::sync::mpsc::Sender<()>, JoinHandle<()>) {
    let (scene, channel) = (Arc::clone(scene), channel.clone());
    let config = config.map(|config| config.source.clone());
    let (stop, stopped) = std::sync::mpsc::channel();
    let thread = std::thread::spawn(move || {
        let (sender, receiver) = flume::bounded(1);
        let bridge = std::thread::spawn(move || {
            // Ends the service also when the test is gone.
            let _ = stopped.recv();
            let _ = sender.send(());
        });
        let options = Options { channel, threads: Some(1), config, ..Options::default() };
        service::run(Simulation::new(scene), &options, &receiver).unwrap();
        bridge.join().unwrap();
    });
    (stop, thread)
}
