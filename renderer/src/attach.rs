//! Turns the frames of a channel into picture files: the renderer process.

use crate::{FrameRenderer, RenderError, RenderStats, Rendered, Watch, cli::Args, published::PublishedScene};
use photonstream_film::Film;
use photonstream_protocol::{AccessMode, Liveness, ProtocolError, Reading, Subscriber, VslFrame};
use photonstream_scene::RenderSettings;
use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

/// What a run of the renderer has done.
#[derive(Clone, Debug)]
pub struct Report {
    /// Pictures written.
    pub pictures: u32,
    /// The frame of the last one.
    pub last_frame: Option<u64>,
    /// Why it ended.
    pub ended: Ended,
}

/// Why a run of the renderer has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// All pictures asked for are written.
    Done,
    /// The simulator closed the channel for good; its last frame is written.
    ChannelClosed,
    /// Somebody asked to stop.
    Cancelled,
}

/// A picture that has just been written.
#[derive(Clone, Copy, Debug)]
pub struct Written<'a> {
    /// Its number, from `Args::first`.
    pub number: u64,
    /// The published frame that it shows.
    pub frame: u64,
    /// Its files, the EXR first.
    pub files: &'a [PathBuf],
    /// What it took.
    pub stats: &'a RenderStats,
}

/// Attaches to the channel that `args` name, waits for it where needed, and writes pictures until there are enough,
/// the simulator closes the channel, or `cancelled` is set.
///
/// A simulator that dies leaves its last frame; the renderer waits for the next one and follows it. With `--frames`,
/// once the light has converged and no newer frame comes, the remaining pictures repeat the last one. A scene that
/// cannot be loaded (an asset is being written) is told, and tried again; the last picture stays until then.
///
/// # Errors
/// [`RenderError`]: an option out of range, a scene that cannot be loaded before there is any picture, a file that
/// cannot be written, a channel that is insecure or of another release.
pub fn run(
    args: &Args,
    renderer: &mut dyn FrameRenderer,
    cancelled: &AtomicBool,
    written: &mut dyn FnMut(&Written<'_>),
) -> Result<Report, RenderError> {
    let stop = || cancelled.load(Ordering::Relaxed);
    let mut run = Run::new(args, renderer, cancelled, written);
    let Some(mut subscriber) = attach(args, &stop)? else { return Ok(run.report(Ended::Cancelled)) };
    loop {
        if let Some(ended) = run.turn(&mut subscriber)? {
            return Ok(run.report(ended));
        }
        subscriber.wait(Duration::from_millis(100));
    }
}

/// So long without a newer frame, a converged light is taken to be at rest.
const QUIET: Duration = Duration::from_millis(500);
/// Time between two attempts to load a scene that cannot be loaded.
const TRY_AGAIN: Duration = Duration::from_millis(200);

fn attach(args: &Args, stop: &dyn Fn() -> bool) -> Result<Option<Subscriber>, RenderError> {
    match Subscriber::attach(&args.channel, AccessMode::Mapped) {
        Ok(subscriber) => return Ok(Some(subscriber)),
        Err(error) => tracing::info!("{error}; waiting for it"),
    }
    // As long as it takes; insecure folders, another release and the like end the wait at once.
    let forever = Duration::from_secs(10 * 365 * 24 * 3600);
    match Subscriber::attach_wait(&args.channel, AccessMode::Mapped, forever, stop) {
        Ok(subscriber) => Ok(Some(subscriber)),
        Err(ProtocolError::Cancelled { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// Logs `message` unless it was the last one.
fn tell(told: &mut Option<String>, message: String) {
    if told.as_ref() != Some(&message) {
        tracing::warn!("{message}");
        *told = Some(message);
    }
}

/// Logs what is wrong with the simulation, once for as long as it stays wrong.
fn tell_notice(noticed: &mut String, args: &Args, notice: &str) {
    if noticed == notice {
        return;
    }
    let channel = &args.channel;
    if notice.is_empty() {
        tracing::info!("channel {channel}: what was wrong with the simulation is not any more");
    } else {
        tracing::warn!("channel {channel}: {notice}");
    }
    notice.clone_into(noticed);
}

fn tell_liveness(told: &mut Option<String>, args: &Args, liveness: &Liveness) {
    let channel = &args.channel;
    match liveness {
        Liveness::Gone { .. } => {
            tell(
                told,
                format!(
                    "channel {channel}: the simulator has ended; keeping its last frame, waiting for the next run"
                ),
            );
        }
        Liveness::Stalled { .. } => {
            tell(told, format!("channel {channel}: the simulator does not respond; keeping its last frame"));
        }
        Liveness::Live | Liveness::Paused | Liveness::Retired => {}
    }
}

struct Run<'a> {
    args: &'a Args,
    renderer: &'a mut dyn FrameRenderer,
    cancelled: &'a AtomicBool,
    written: &'a mut dyn FnMut(&Written<'_>),
    scene: PublishedScene,
    pictures: u32,
    last: Option<Last>,
    /// What was last said of the channel, of the simulation, and of the scene.
    told: Option<String>,
    noticed: String,
    refused: Option<String>,
    /// A frame has been read and not been shown.
    pending: bool,
    newest: Instant,
    /// Not before then a refused scene is tried again.
    try_again: Instant,
}

/// The last picture.
struct Last {
    frame: u64,
    rendered: Rendered,
    settings: RenderSettings,
}

impl<'a> Run<'a> {
    fn new(
        args: &'a Args,
        renderer: &'a mut dyn FrameRenderer,
        cancelled: &'a AtomicBool,
        written: &'a mut dyn FnMut(&Written<'_>),
    ) -> Self {
        let now = Instant::now();
        Self {
            args,
            renderer,
            cancelled,
            written,
            scene: PublishedScene::default(),
            pictures: 0,
            last: None,
            told: None,
            noticed: String::new(),
            refused: None,
            pending: false,
            newest: now,
            try_again: now,
        }
    }

    fn report(&self, ended: Ended) -> Report {
        Report { pictures: self.pictures, last_frame: self.last.as_ref().map(|l| l.frame), ended }
    }

    /// Looks at the channel once and writes a picture if one is due; why the run is over, if it is.
    fn turn(&mut self, subscriber: &mut Subscriber) -> Result<Option<Ended>, RenderError> {
        if self.cancelled.load(Ordering::Relaxed) {
            return Ok(Some(Ended::Cancelled));
        }
        // Asked before reading: what was published before the channel was closed is then read.
        let liveness = subscriber.liveness();
        match subscriber.read() {
            Ok(Reading::New) => {
                (self.pending, self.newest) = (true, Instant::now());
                let notice = subscriber.frame().map_or("", |frame| &frame.notice);
                tell_notice(&mut self.noticed, self.args, notice);
            }
            Ok(_) => {}
            Err(error) => tell(&mut self.told, format!("{error}; the last frame is kept")),
        }
        tell_liveness(&mut self.told, self.args, &liveness);
        let closed = liveness == Liveness::Retired;
        if let Some(frame) = subscriber.frame() {
            let converged = frame.statistics.converged != 0;
            let due = if self.args.frames.is_some() { self.pending } else { converged || closed };
            let rests = self.refused.is_some() && Instant::now() < self.try_again && !closed;
            if due && rests {
                // The last picture stays, and is not repeated either.
            } else if due {
                match self.picture(frame) {
                    Err(RenderError::Cancelled) => return Ok(Some(Ended::Cancelled)),
                    result => result?,
                }
            } else if self.last.is_some() && converged && self.newest.elapsed() > QUIET {
                self.repeat()?;
            }
        }
        if self.pictures >= self.args.frames.unwrap_or(1) {
            return Ok(Some(Ended::Done));
        }
        Ok(closed.then_some(Ended::ChannelClosed))
    }

    /// Writes a picture of `frame`, which stays pending where its scene cannot be had for now.
    fn picture(&mut self, frame: &VslFrame) -> Result<(), RenderError> {
        let scene = match self.scene.update(frame) {
            Ok(scene) => scene,
            Err(error) if self.last.is_some() => {
                let channel = &self.args.channel;
                tell(&mut self.refused, format!("channel {channel}: {error}; keeping the last picture"));
                self.try_again = Instant::now() + TRY_AGAIN;
                return Ok(());
            }
            Err(error) => return Err(error),
        };
        if self.refused.take().is_some() {
            tracing::info!("channel {}: the published scene can be shown again", self.args.channel);
        }
        let watch = Watch { progress: None, cancelled: Some(self.cancelled) };
        let rendered = self.renderer.render(scene, frame, &self.args.options(&scene.render), watch)?;
        let settings = scene.render.clone();
        self.pending = false;
        self.write(Last { frame: frame.frame, rendered, settings })
    }

    fn repeat(&mut self) -> Result<(), RenderError> {
        match self.last.take() {
            Some(last) => self.write(last),
            None => Ok(()),
        }
    }

    fn write(&mut self, last: Last) -> Result<(), RenderError> {
        let number = u64::from(self.args.first) + u64::from(self.pictures);
        let files = write_files(self.args, number, &last.rendered.film, &last.settings)?;
        self.pictures += 1;
        (self.written)(&Written { number, frame: last.frame, files: &files, stats: &last.rendered.stats });
        self.last = Some(last);
        Ok(())
    }
}

/// Writes all layers as one EXR, and each as a PNG; the first PNG has the plain name, others that of their layer.
fn write_files(
    args: &Args,
    number: u64,
    film: &Film,
    settings: &RenderSettings,
) -> Result<Vec<PathBuf>, RenderError> {
    let exr = args.out.join(format!("frame-{number:04}.exr"));
    film.write_exr(&exr)?;
    let mut files = vec![exr];
    for (index, kind) in args.show.iter().enumerate() {
        let suffix = if index == 0 { String::new() } else { format!("-{kind}") };
        let png = args.out.join(format!("frame-{number:04}{suffix}.png"));
        film.write_png(&png, kind.name(), kind.display(settings))?;
        files.push(png);
    }
    Ok(files)
}

#[cfg(test)]
mod tests;
