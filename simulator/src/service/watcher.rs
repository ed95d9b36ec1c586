//! Turns changes of a config file and its assets into scenes, or into the reason why there is none.
//!
//! The folder is watched, not the file, which editors replace. After a change the file is read once it has been quiet for
//! a moment, twice, until both readings are equal; an empty file is one that is being saved. Its assets are read again where
//! they have changed meanwhile. Where the system tells nothing
//! (network folders, a folder that was removed and made again) a look at sizes and times every half second finds it.

use super::{config_source, config_source::ConfigSource, spawn, stamp::Stamp};
use crate::error::SimulatorError;
use notify::{RecommendedWatcher, RecursiveMode, Watcher};
use photonstream_scene::{Scene, SceneError};
use std::{
    io,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// What has become of the config.
pub(super) enum News {
    /// It is another scene; with its text, where that alone has changed.
    Scene(Box<Scene>, Option<String>),
    /// It is no scene: why, with file, line and column.
    Broken(String),
}

/// So long nothing must happen before the file is read.
const QUIET: Duration = Duration::from_millis(100);
/// A file that is saved without pause is read after this time all the same.
const PATIENCE: Duration = Duration::from_millis(250);
/// Time between two readings that have to be equal.
const BETWEEN: Duration = Duration::from_millis(10);
/// How often assets are read that change meanwhile, before others get their turn.
const READINGS: u32 = 3;
/// Time between two looks for changes that nobody told of.
const LOOK: Duration = Duration::from_millis(500);
/// A file that is not there for so many looks is gone, and not being replaced.
const GONE_AFTER: u32 = 2;

/// Watches until `stop` is closed. `loaded` is the scene as it was loaded at the start; what was saved since is news.
pub(super) fn start(
    source: ConfigSource,
    loaded: &Scene,
    news: flume::Sender<News>,
    stop: flume::Receiver<()>,
) -> Result<std::thread::JoinHandle<()>, SimulatorError> {
    let (tell, told) = flume::bounded(1);
    let watch = Watch {
        files: loaded.files.to_vec(),
        watcher: watcher(tell),
        watched: false,
        told,
        tried: source.text().map(str::to_owned),
        config_seen: Stamp::default(),
        assets_seen: Vec::new(),
        told_last: Told::Scene(loaded.hash),
        missing: 0,
        source,
    };
    spawn("config watcher", move || watch.run(&news, &stop))
}

fn watcher(tell: flume::Sender<()>) -> Option<RecommendedWatcher> {
    let told = move |event: notify::Result<notify::Event>| {
        let only_read = event.is_ok_and(|event| event.kind.is_access());
        if !only_read {
            // One message is enough.
            let _ = tell.try_send(());
        }
    };
    notify::recommended_watcher(told)
        .inspect_err(|error| tracing::info!("changes of the config are looked for by time: {error}"))
        .ok()
}

struct Watch {
    source: ConfigSource,
    files: Vec<PathBuf>,
    watcher: Option<RecommendedWatcher>,
    watched: bool,
    told: flume::Receiver<()>,
    /// The text that was tried last.
    tried: Option<String>,
    /// The config as it was looked at last, and its assets as they were read.
    config_seen: Stamp,
    assets_seen: Vec<Stamp>,
    told_last: Told,
    missing: u32,
}

/// What was told last.
#[derive(Clone, Debug, PartialEq)]
enum Told {
    /// A scene of this hash.
    Scene(u64),
    /// That there is none, and why.
    Broken(String),
}

enum Heard {
    Change,
    Nothing,
    Stop,
}

impl Watch {
    fn run(mut self, news: &flume::Sender<News>, stop: &flume::Receiver<()>) {
        self.listen();
        // Somebody may have saved the config or an asset while the scene was made ready.
        let since = self.source.since();
        let read = |stamp: Stamp| if stamp.is_since(since) { Stamp::default() } else { stamp };
        self.assets_seen = self.assets().into_iter().map(read).collect();
        loop {
            let was_told = match self.hear(LOOK, stop) {
                Heard::Stop => return,
                Heard::Change if !self.wait_for_quiet(stop) => return,
                Heard::Change => true,
                Heard::Nothing => false,
            };
            let config = Stamp::of(&self.source.path);
            let assets_changed = self.assets() != self.assets_seen;
            let is_missing = config.is_of_nothing();
            self.missing = if is_missing { self.missing + 1 } else { 0 };
            if is_missing {
                self.watched = false;
            } else if !self.watched {
                self.listen();
            }
            let is_gone = self.missing == GONE_AFTER;
            // Two saves may have one time.
            if config == self.config_seen && !assets_changed && !is_gone && !was_told {
                continue;
            }
            if let Some(message) = self.look(assets_changed, is_gone)
                && news.send(message).is_err()
            {
                return;
            }
            self.config_seen = config;
        }
    }

    /// Watches the folders of all files; again, where one was removed.
    fn listen(&mut self) {
        let Some(watcher) = &mut self.watcher else { return };
        let folders = self.files.iter().filter_map(|file| file.parent());
        let mut folders: Vec<&Path> = folders.chain([self.source.folder()]).collect();
        folders.sort();
        folders.dedup();
        self.watched = true;
        for folder in folders {
            // What cannot be watched is looked at by time.
            let _ = watcher.unwatch(folder);
            self.watched &= watcher.watch(folder, RecursiveMode::NonRecursive).is_ok();
        }
    }

    fn hear(&self, timeout: Duration, stop: &flume::Receiver<()>) -> Heard {
        flume::Selector::new()
            .recv(&self.told, |told| if told.is_ok() { Heard::Change } else { Heard::Nothing })
            .recv(stop, |_| Heard::Stop)
            .wait_timeout(timeout)
            .unwrap_or(Heard::Nothing)
    }

    /// Until nothing has happened for a moment; false where it is time to end.
    fn wait_for_quiet(&self, stop: &flume::Receiver<()>) -> bool {
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            match self.hear(QUIET, stop) {
                Heard::Stop => return false,
                Heard::Nothing => return true,
                Heard::Change => {}
            }
        }
        true
    }

    fn assets(&self) -> Vec<Stamp> {
        self.files.iter().map(|file| Stamp::of(file)).collect()
    }

    /// The scene of a text with its assets as they were all the while they were read; `None` where they go on changing.
    fn load(&mut self, text: &str) -> Option<Result<Scene, SceneError>> {
        for _ in 0..READINGS {
            let before = self.assets();
            // Two writes of one size within a tick have one time.
            std::thread::sleep(BETWEEN);
            let loaded = self.source.load_text(text);
            let has_same_files = self.follow(&loaded);
            let is_whole = has_same_files && self.assets() == before;
            self.assets_seen = before;
            if is_whole {
                return Some(loaded);
            }
        }
        None
    }

    /// Looks from now on at the files that were read, and those that were missed; true where it does already.
    fn follow(&mut self, loaded: &Result<Scene, SceneError>) -> bool {
        let files = match loaded {
            Ok(scene) => scene.files.to_vec(),
            Err(error) => {
                let is_new = |file: &PathBuf| !file.as_os_str().is_empty() && !self.files.contains(file);
                let missing = config_source::missing(error).into_iter().filter(is_new);
                self.files.iter().cloned().chain(missing).collect()
            }
        };
        let has_same_files = files == self.files;
        if !has_same_files {
            self.files = files;
            self.watched = false;
            self.listen();
        }
        has_same_files
    }

    /// What there is to tell after a change.
    fn look(&mut self, assets_changed: bool, is_gone: bool) -> Option<News> {
        let text = match read_twice(&self.source) {
            Ok(text) if text.trim().is_empty() => return None,
            Ok(text) => text,
            // It is being replaced, until it is gone for longer.
            Err(error) if error.kind() == io::ErrorKind::NotFound && !is_gone => return None,
            Err(error) => {
                self.tried = None;
                let path = self.source.path.display();
                return self.tell_broken(format!("{path}: cannot be read ({error}); restore it"));
            }
        };
        if self.tried.as_ref() == Some(&text) && !assets_changed {
            return None;
        }
        let assets_before = self.assets_seen.clone();
        let loaded = self.load(&text)?;
        let is_text_alone = !assets_changed && self.assets_seen == assets_before;
        self.tried = Some(text.clone());
        match loaded {
            Ok(scene) => match std::mem::replace(&mut self.told_last, Told::Scene(scene.hash)) {
                Told::Scene(hash) if hash == scene.hash => None,
                _ => Some(News::Scene(Box::new(scene), is_text_alone.then_some(text))),
            },
            Err(error) => self.tell_broken(error.to_string()),
        }
    }

    fn tell_broken(&mut self, reason: String) -> Option<News> {
        let told = Told::Broken(reason.clone());
        (std::mem::replace(&mut self.told_last, told.clone()) != told).then_some(News::Broken(reason))
    }
}

/// Reads until two readings are equal, a few times.
fn read_twice(source: &ConfigSource) -> io::Result<String> {
    let mut last = source.read();
    for _ in 0..20 {
        std::thread::sleep(BETWEEN);
        let now = source.read();
        match (last, now) {
            (Ok(a), Ok(b)) if a == b => return Ok(b),
            (Err(_), Err(error)) => return Err(error),
            (_, now) => last = now,
        }
    }
    last
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use std::{
        fs,
        io::Write,
        sync::atomic::{AtomicBool, Ordering},
    };

    const TEXT: &str = "[camera]\nposition_m = [0, 0, 5]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n\
         [material.a]\nalbedo = 0.5\n[object.mesh]\nmaterial = \"a\"\nobj = { path = \"mesh.obj\" }\n";

    /// A mesh is written again and again, row by row, valid after every row, in 40 passes of 12 rows: whenever it was read
    /// and not changed since, as far as its stamp says, the scene that was made of it is that of the file.
    #[test]
    fn no_half_of_a_mesh_is_taken_for_all_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        let mesh = folder.path().join("mesh.obj");
        let row = |i: u32| format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1\nf -3 -2 -1\n");
        fs::write(&mesh, row(0)).unwrap();
        fs::write(&path, TEXT).unwrap();
        let mut source = ConfigSource::new(&path, Default::default());
        let scene = source.load().unwrap();
        let mut watch = Watch {
            files: scene.files.to_vec(),
            watcher: None,
            watched: false,
            told: flume::bounded(1).1,
            tried: None,
            config_seen: Stamp::default(),
            assets_seen: Vec::new(),
            told_last: Told::Scene(scene.hash),
            missing: 0,
            source,
        };
        let written = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for pass in 0..40 {
                    let mut file = fs::File::create(&mesh).unwrap();
                    for i in 0..12 {
                        file.write_all(row(pass + i).as_bytes()).unwrap();
                        std::thread::sleep(Duration::from_millis(1 + u64::from(pass % 4) * 4));
                    }
                }
                written.store(true, Ordering::Release);
            });
            let mut last = None;
            loop {
                let is_over = written.load(Ordering::Acquire);
                if watch.assets() != watch.assets_seen {
                    last = watch.load(TEXT).map(|loaded| loaded.map(|scene| scene.hash).ok());
                }
                if is_over && watch.assets() == watch.assets_seen {
                    break;
                }
                std::thread::yield_now();
            }
            let whole = watch.source.load_text(TEXT).unwrap();
            assert_eq!(whole.geometry.triangles.len(), 12);
            assert_eq!(last, Some(Some(whole.hash)));
        });
    }
}
