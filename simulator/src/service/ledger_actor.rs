//! Runs the ledger: hands out tasks, takes in batches, and decides when a frame is due.

mod fade;
mod few;
mod messages;
mod moves;
mod progress;
mod telemetry;

pub use telemetry::State;

use super::{
    placer::Moved,
    published_maps::MapUpdate,
    publisher_actor::{PlacedRecords, Snapshot, Still},
    tracer_actor::{PathWork, Work},
};
use crate::{
    change::Change as SceneChange,
    counters::Counters,
    distance_maps::Schedule,
    ledger::Ledger,
    records,
    simulation::Simulation,
    tracer::{PathBatch, Tracer},
};
use crossbeam::queue::ArrayQueue;
use fade::Fade;
use few::{Few, Passing};
pub(super) use messages::{Asked, Change, FromLedger, LightsWanted, ToLedger, Version};
use moves::Moves;
use photonstream_protocol::monotonic_ns;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// A frame that is to be shown whole is shown after this time all the same.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// Publishing may take at most this share of the ledger's time.
const PUBLISHING_SHARE: u32 = 10;

/// Runs the ledger until it is stopped or everybody it works with is gone.
pub(super) struct LedgerActor {
    /// The first version.
    pub(super) simulation: Simulation,
    pub(super) still: Arc<Still>,
    pub(super) threads: usize,
    pub(super) inbox: flume::Receiver<ToLedger>,
    pub(super) work: flume::Sender<Work>,
    pub(super) snapshots: flume::Sender<Snapshot>,
    pub(super) emptied: Arc<ArrayQueue<PlacedRecords>>,
    /// Stop handing out work after this many paths.
    pub(super) after_paths: Option<u64>,
    /// Lights that move are shown where they are at once.
    pub(super) has_no_fade: bool,
    /// Publish the first version only once its light is whole, as [`Version::only_whole`].
    pub(super) only_whole: bool,
    pub(super) director: flume::Sender<FromLedger>,
}

struct Progress {
    simulation: Simulation,
    still: Arc<Still>,
    ledger: Ledger,
    tracer: Arc<Tracer>,
    /// Counts the versions in which objects moved, and those with other virtual surface lights.
    places: u64,
    placements: u64,
    /// Their patches, once they were published.
    patches: Option<progress::Placed>,
    /// Their distance maps, where the scene asks for them.
    maps: Option<Schedule>,
    /// Rays traced for maps.
    map_rays: u64,
    /// Time of the simulated scene.
    time_s: f64,
    only_whole: bool,
    /// Versions after the first.
    versions: u64,
    /// The present version was not yet published whole.
    unsettled: bool,
    /// When the oldest change came whose light is not traced yet, monotonic ns.
    waiting_since_ns: Option<u64>,
    latency_ms: f64,
    /// Paths traced before that change.
    paths_before_change: u64,
    /// Paths that a change had traced in a ms, with all that it takes beside.
    paths_per_ms: Option<f64>,
    /// Of the frame published last.
    relative_error: f64,
    /// How long the last frame took to be made.
    publishing: Duration,
    spare: Vec<PathBatch>,
    started: Instant,
    paused: bool,
    stepping: bool,
    /// Something differs from the last published frame.
    changed: bool,
    /// Paths were traced since it was last decided how the pool is split.
    split_is_due: bool,
    /// Where virtual surface lights are to lie.
    moves: Moves,
    /// They come from where they were.
    fade: Option<Fade>,
    /// What is shown instead, by a method of few lights.
    few: Option<Few>,
    /// The last frame was of a simulation that goes on, and of the whole light.
    shown_running: bool,
    shown_whole: bool,
    next_frame: Instant,
    /// When the last frame was shown, or the first change after it came.
    shown_at: Instant,
    /// Snapshots sent, each of which becomes a frame.
    frames: u64,
    edit_received_ns: u64,
    traced_ns: u64,
    paths_given: u64,
    /// Time in which there was work, and since when there is.
    active: Duration,
    active_since: Option<Instant>,
}

impl LedgerActor {
    pub(super) fn run(self) -> Counters {
        let started = Instant::now();
        let mut progress = Progress {
            simulation: self.simulation.clone(),
            still: Arc::clone(&self.still),
            ledger: self.simulation.ledger(),
            tracer: Arc::new(self.simulation.tracer.clone()),
            places: 0,
            placements: 0,
            patches: None,
            maps: Schedule::new(&self.simulation, 0),
            map_rays: 0,
            time_s: 0.0,
            only_whole: self.only_whole,
            versions: 0,
            unsettled: true,
            waiting_since_ns: None,
            latency_ms: 0.0,
            paths_before_change: 0,
            paths_per_ms: None,
            relative_error: 0.0,
            publishing: Duration::ZERO,
            spare: Vec::new(),
            started,
            paused: false,
            stepping: false,
            changed: true,
            split_is_due: true,
            moves: Moves::new(started),
            fade: None,
            few: self.simulation.few_lights().map(Few::new),
            shown_running: true,
            shown_whole: false,
            next_frame: started + period(&self.simulation),
            shown_at: started,
            frames: 0,
            edit_received_ns: 0,
            traced_ns: 0,
            paths_given: 0,
            active: Duration::ZERO,
            active_since: None,
        };
        progress.hold_or_refine();
        loop {
            if !self.hand_out(&mut progress) {
                break;
            }
            let now = Instant::now();
            progress.note_activity(now);
            let done = self.is_done(&progress);
            let settled = progress.in_flight() == 0;
            // Of a step, and of fixed steps, the whole light is shown; in a drag that is faster than light not for ever.
            let wants_whole = (progress.only_whole && !progress.paused) || progress.stepping;
            let has_waited = progress.changed && now >= progress.shown_at + LONGEST_WAIT;
            let may_be_shown = !wants_whole || progress.is_whole() || done || has_waited;
            let is_at_rest = settled && (done || progress.paused);
            let is_due = now >= progress.next_frame || is_at_rest;
            if progress.changed && may_be_shown && is_due {
                match self.publish(&mut progress, done) {
                    Published::Yes => {}
                    Published::Later => progress.next_frame = now + Duration::from_millis(1),
                    Published::Gone => break,
                }
            }
            self.tell(&mut progress);
            let decision = progress.next_decision();
            let message = if progress.changed {
                let late = progress.shown_at + LONGEST_WAIT;
                let due = if may_be_shown { progress.next_frame } else { late };
                match self.inbox.recv_deadline(due) {
                    Ok(message) => message,
                    Err(flume::RecvTimeoutError::Timeout) => continue,
                    Err(flume::RecvTimeoutError::Disconnected) => break,
                }
            } else if let Some(due) = decision {
                match self.inbox.recv_deadline(due) {
                    Ok(message) => message,
                    Err(flume::RecvTimeoutError::Timeout) => continue,
                    Err(flume::RecvTimeoutError::Disconnected) => break,
                }
            } else {
                match self.inbox.recv() {
                    Ok(message) => message,
                    Err(flume::RecvError::Disconnected) => break,
                }
            };
            if !self.handle(message, &mut progress) {
                break;
            }
        }
        progress.ledger.counters()
    }

    /// Once a frame is out, tells the director what follows from it: that lights had better lie elsewhere, before that its
    /// light was whole, so that in fixed steps of time the former comes first.
    fn tell(&self, progress: &mut Progress) {
        if progress.changed {
            return;
        }
        if let Some(wish) = progress.follow_light() {
            // Whoever does not listen does not move lights.
            let _ = self.director.send(FromLedger::Wants(wish));
        }
        if progress.unsettled && progress.shown_whole {
            progress.unsettled = false;
            // Whoever does not listen does not wait for it.
            let _ = self.director.send(FromLedger::Settled(progress.versions));
        }
    }

    /// Keeps the tracers busy. False if there are none any more.
    fn hand_out(&self, progress: &mut Progress) -> bool {
        if !progress.paused && !self.is_at_limit(progress) {
            progress.follow_variance();
        }
        let room = 2 * self.threads as u64 + 2;
        let has_maps = progress.maps.as_ref().is_some_and(|maps| !maps.is_whole());
        let most = if has_maps { room / 2 } else { room };
        while progress.ledger.in_flight() < most && (!progress.paused || progress.stepping) {
            // An edit is followed to its end, whatever the limit.
            let task = match self.is_at_limit(progress) {
                true => progress.ledger.next_stale_task(),
                false => progress.ledger.next_task(),
            };
            let Some(task) = task else { break };
            progress.paths_given += task.draws.len() as u64;
            let batch = progress.spare.pop().unwrap_or_default();
            let tracer = Arc::clone(&progress.tracer);
            let work = Work::Paths(Box::new(PathWork { tracer, task, batch }));
            if self.work.send(work).is_err() {
                return false;
            }
        }
        let Some(maps) = progress.maps.as_mut().filter(|_| !progress.paused || progress.stepping) else {
            return true;
        };
        while maps.in_flight() as u64 + progress.ledger.in_flight() < room {
            let Some(task) = maps.next_task() else { break };
            if self.work.send(Work::Map(Box::new(task))).is_err() {
                return false;
            }
        }
        true
    }

    fn is_at_limit(&self, progress: &Progress) -> bool {
        self.after_paths.is_some_and(|limit| progress.paths_given >= limit)
    }

    fn is_done(&self, progress: &Progress) -> bool {
        let ledger = &progress.ledger;
        let rests = self.is_at_limit(progress) && ledger.in_flight() == 0 && ledger.stale_paths() == 0;
        (ledger.is_done() || rests) && progress.has_whole_maps() && progress.has_lights_at_rest()
    }

    /// False where it is time to end.
    fn handle(&self, message: ToLedger, progress: &mut Progress) -> bool {
        match message {
            ToLedger::Finished(finished) => {
                let (task, batch) = *finished;
                let birth_ms = progress.now_ms();
                progress.traced_ns = monotonic_ns();
                progress.spare.extend(progress.ledger.apply(task, batch, birth_ms));
                progress.note_whole_light();
                progress.changed = true;
            }
            ToLedger::Mapped(traced) => {
                progress.map_rays += traced.rays;
                if let Some(maps) = &mut progress.maps {
                    maps.finish(*traced);
                }
                progress.changed = true;
            }
            ToLedger::Change(change, reply) => {
                match change {
                    Change::Pause => progress.paused = true,
                    Change::Resume => {
                        progress.paused = false;
                        if let Some(few) = &mut progress.few {
                            few.resume();
                        }
                    }
                    Change::Step => {}
                }
                progress.stepping = progress.paused && matches!(change, Change::Step);
                // A frame follows in any case, so that whoever waits for it does not wait for ever.
                progress.changed = true;
                let _ = reply.send(progress.frames + 1);
            }
            ToLedger::Edit(version, reply) => {
                // Whoever asked does not wait while the pool is moved to other lights.
                let _ = reply.send(progress.frames + 1);
                progress.edit(*version, self.has_no_fade);
            }
            ToLedger::Time(time_s) => {
                progress.time_s = time_s;
                // What fades goes on with time; else there is nothing to be shown.
                progress.changed |= progress.is_on_its_way();
                progress.unsettled = true;
            }
            ToLedger::Query(reply) => {
                // Whoever asked may have gone.
                let _ = reply.send(self.state(progress));
            }
            ToLedger::Stop => return false,
        }
        true
    }

    fn publish(&self, progress: &mut Progress, converged: bool) -> Published {
        let Some(mut vsls) = self.emptied.pop() else { return Published::Later };
        let begun = Instant::now();
        let scene = &progress.simulation.scene;
        let (now_ms, time_s, is_in_steps) = (progress.now_ms(), progress.time_s, progress.is_in_steps());
        if let Some(few) = &mut progress.few {
            let passing = Passing::of(progress.paused, progress.stepping, is_in_steps);
            few.go_on(scene, begun, time_s, passing);
            vsls.records = few.lights.records(progress.placements as u32);
            (vsls.placement, vsls.version) = (progress.placements, progress.places);
        } else if vsls.placement != progress.placements {
            vsls.records = records::vsl_records(scene, &progress.simulation.placement);
            let generation = progress.placements as u32;
            vsls.records.iter_mut().for_each(|record| record.generation = generation);
            (vsls.placement, vsls.version) = (progress.placements, progress.places);
        }
        if progress.few.is_none() && vsls.version != progress.places {
            vsls.version = progress.places;
            records::write_places(&mut vsls.records, scene, &progress.simulation.placement);
        }
        match &mut progress.fade {
            _ if progress.few.is_some() => {}
            None => records::write_flux(&mut vsls.records, progress.ledger.readings(scene), now_ms),
            Some(fade) => {
                fade.go_on(begun, time_s, is_in_steps);
                records::write_flux(&mut vsls.records, fade.readings(&progress.ledger, scene), now_ms);
            }
        }
        let still = Arc::clone(&progress.still);
        let patches = match &progress.few {
            Some(few) => few.lights.patches().into(),
            None => progress.patches(),
        };
        progress.relative_error = records::relative_error(&vsls.records);
        // What goes on by itself has begun to only now.
        let is_at_rest = progress.paused || !progress.is_on_its_way();
        let has_converged = is_at_rest && (converged || progress.has_converged());
        let statistics = self.statistics(progress, has_converged);
        let placements = progress.placements;
        let of_few = progress.few.as_mut().and_then(|few| few.lights.take_changed_maps());
        let maps = match of_few {
            Some(changed) => Some(MapUpdate::of_few(changed, placements)),
            None => progress.maps.as_mut().map(|maps| MapUpdate::of(maps, placements)),
        };
        let snapshot = Snapshot {
            room: progress.room(),
            vsls,
            patches,
            maps,
            still,
            statistics,
            paused: progress.paused,
        };
        if self.snapshots.send(snapshot).is_err() {
            return Published::Gone;
        }
        let now = Instant::now();
        progress.publishing = now - begun;
        progress.next_frame = now + period(&progress.simulation).max(progress.publishing * PUBLISHING_SHARE);
        progress.frames += 1;
        progress.shown_at = now;
        progress.shown_running = !progress.paused || progress.stepping;
        progress.stepping = false;
        // While lights fade every frame is another one, and where they go then has to be decided.
        progress.changed = match progress.end_fade_if_over() {
            true => true,
            false => progress.is_on_its_way() && !progress.paused && !is_in_steps,
        };
        progress.shown_whole = progress.is_whole();
        Published::Yes
    }
}

enum Published {
    Yes,
    /// The publisher still has the memory.
    Later,
    Gone,
}

/// Time between two frames: half of the time that a change may take, where the scene says so.
fn period(simulation: &Simulation) -> Duration {
    let streaming = &simulation.scene.streaming;
    let wanted = f64::from(streaming.publish_period_ms.max(0.1));
    let half = if streaming.latency_ms > 0.0 { 0.5 * streaming.latency_ms } else { f64::INFINITY };
    Duration::from_secs_f64(wanted.min(half) / 1e3)
}
