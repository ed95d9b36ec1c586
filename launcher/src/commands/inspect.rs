//! Turns a running simulation into a report: rates, latency, age, versions, features and why.

use super::check::Feature;
use crate::{
    cli::Global,
    error::LauncherError,
    exit, follow,
    output::{self, grouped, si},
    signals::Listener,
};
use photonstream_protocol::{
    ABI_MAJOR, ABI_MINOR, ChannelName, ControlClient, Liveness, Reading, Reply, Request, Subscriber,
    VslFrame, monotonic_ns,
};
use photonstream_renderer::telemetry::{ChangeTimes, LightAge};
use photonstream_scene::Scene;
use serde::{Deserialize, Serialize};
use std::{
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

/// Arguments of `photonstream inspect`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
With --watch a report follows every second until Ctrl-C; with --json as well, each is one line.

JSON: { \"channel\", \"state\": live | paused | stalled | gone | retired, \"state_reason\", \"abi\", \"epoch\", \"frame\",
  \"config_generation\", \"notice\": what is wrong with the simulation, or null, \"frame_age_ms\", \"scene\", \"scene_hash\",
  \"method\", \"shining\": lights of a method of few lights that shine, and \"update_us\": what its last update took; all three
  as the simulator answers, or null, \"vsls\", \"objects\", \"lights\", \"threads\", \"converged\", \"simulation_time_s\",
  \"paths_total\", \"rays_total\",
  \"deposits_total\", \"escaped\", \"rejected\", \"truncated\", \"absorbed_back\", \"paths_per_s\", \"rays_per_s\",
  \"deposits_per_s\", \"pool_paths\": slots of the pool in use, \"pool_capacity\": at most, \"pool_valid\",
  \"refined_paths\": samples beyond the pool, \"stale_share\": of the pool, in [0, 1], \"mean_age_s\" and \"greatest_age_s\": of
  the paths behind lit VSLs, \"relative_error\": standard error of the flux, weighted by flux, \"target_error\": or null,
  \"retraced_paths\" and \"rays_saved\": because of edits, since the start, \"latency_ms\": from the last change until all its
  light was traced, as the simulator measured it, or null, \"latency_target_ms\": or null, \"change\": null before the first,
  or { \"age_ms\", \"traced_ms\", \"published_ms\", \"settled_ms\": from the arrival of the last change until its light was
  traced, a frame with it published, and one with all its light; null where that is not over, or was before this report
  began (--watch sees it) }, \"total_flux_w\": [r, g, b],
  \"decisions\": [ { \"what\", \"modelled\", \"reason\" } ] }")]
pub(crate) struct Args {
    /// Channel of the simulation
    #[arg(long, default_value_t)]
    channel: ChannelName,
    /// Report every second
    #[arg(long)]
    watch: bool,
}

#[derive(Serialize)]
struct Report {
    channel: String,
    state: &'static str,
    state_reason: Option<String>,
    abi: String,
    epoch: u64,
    frame: u64,
    config_generation: u64,
    notice: Option<String>,
    frame_age_ms: f64,
    scene: String,
    scene_hash: String,
    #[serde(flatten)]
    method: Told,
    vsls: usize,
    objects: usize,
    lights: usize,
    threads: u64,
    converged: bool,
    simulation_time_s: f64,
    paths_total: u64,
    rays_total: u64,
    deposits_total: u64,
    escaped: u64,
    rejected: u64,
    truncated: u64,
    absorbed_back: u64,
    paths_per_s: f64,
    rays_per_s: f64,
    deposits_per_s: f64,
    pool_paths: u64,
    pool_capacity: u64,
    pool_valid: u64,
    refined_paths: u64,
    stale_share: f64,
    mean_age_s: f64,
    greatest_age_s: f64,
    relative_error: f64,
    target_error: Option<f64>,
    retraced_paths: u64,
    rays_saved: u64,
    latency_ms: Option<f64>,
    latency_target_ms: Option<f64>,
    change: Option<Change>,
    total_flux_w: [f64; 3],
    decisions: Vec<Feature>,
}

/// What the simulator says of its method, if it answers.
#[derive(Default, Serialize, Deserialize)]
struct Told {
    method: Option<String>,
    shining: Option<usize>,
    update_us: Option<f64>,
}

impl Told {
    /// Asks a simulator that is there.
    fn by(channel: &ChannelName, liveness: &Liveness) -> Self {
        if !matches!(liveness, Liveness::Live | Liveness::Paused) {
            return Self::default();
        }
        let state =
            ControlClient::connect(channel).and_then(|mut client| client.request(&Request::Query, PATIENCE));
        match state {
            Ok(Reply::State { state }) => serde_json::from_value(state).unwrap_or_default(),
            // The frame says all else.
            _ => Self::default(),
        }
    }
}

/// So long a simulator may take to say what its method is.
const PATIENCE: Duration = Duration::from_secs(1);

/// Times from the arrival of the last change, in ms.
#[derive(Serialize)]
struct Change {
    age_ms: f64,
    traced_ms: Option<f64>,
    published_ms: Option<f64>,
    settled_ms: Option<f64>,
}

const PERIOD: Duration = Duration::from_secs(1);

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let mut subscriber = follow::present_frame(&args.channel)?;
    let mut changes = ChangeTimes::default();
    subscriber.frame().into_iter().for_each(|frame| changes.see(frame));
    if !args.watch {
        return output::report(global.json, &report(args, &subscriber, &changes)?, text);
    }
    let ended = Listener::flag_only()?;
    while !ended.load(Ordering::Relaxed) {
        let report = report(args, &subscriber, &changes)?;
        if global.json {
            let line = serde_json::to_string(&report).map_err(|e| LauncherError::Output(e.into()))?;
            output::line(line)?;
        } else {
            output::line(format!("{}\n", text(&report)))?;
        }
        if report.state == "retired" {
            return Ok(());
        }
        let next = Instant::now() + PERIOD;
        while Instant::now() < next && !ended.load(Ordering::Relaxed) {
            subscriber.wait((next - Instant::now()).min(Duration::from_millis(50)));
            if subscriber.read()? == Reading::New {
                subscriber.frame().into_iter().for_each(|frame| changes.see(frame));
            }
        }
    }
    // To watch until Ctrl-C is what was asked for.
    std::process::exit(i32::from(exit::OK));
}

fn report(args: &Args, subscriber: &Subscriber, changes: &ChangeTimes) -> Result<Report, LauncherError> {
    let frame = subscriber.frame().expect("invariant: present_frame waits for one");
    let scene = Scene::from_resolved(&frame.scene_text)?;
    let liveness = subscriber.liveness();
    let method = Told::by(&args.channel, &liveness);
    let (state, state_reason) = match liveness {
        Liveness::Live => ("live", None),
        Liveness::Paused => ("paused", None),
        Liveness::Stalled { age } => ("stalled", Some(format!("no sign of life for {} ms", age.as_millis()))),
        Liveness::Gone { reason } => ("gone", Some(reason)),
        Liveness::Retired => ("retired", None),
    };
    let s = &frame.statistics;
    let now_ns = monotonic_ns();
    let light = LightAge::of(frame);
    let some = |value: f64| (value > 0.0).then_some(value);
    Ok(Report {
        channel: args.channel.to_string(),
        state,
        state_reason,
        abi: format!("{ABI_MAJOR}.{ABI_MINOR}"),
        epoch: frame.epoch,
        frame: frame.frame,
        config_generation: frame.config_generation,
        notice: (!frame.notice.is_empty()).then(|| frame.notice.to_string()),
        frame_age_ms: now_ns.saturating_sub(frame.publish_time_ns) as f64 * 1e-6,
        scene: scene.name.clone(),
        scene_hash: format!("{:016x}", frame.scene_hash),
        method,
        vsls: frame.vsls.len(),
        objects: frame.objects.len(),
        lights: frame.lights.len(),
        threads: s.threads,
        converged: s.converged == 1,
        simulation_time_s: s.simulation_time_s,
        paths_total: s.paths_total,
        rays_total: s.rays_total,
        deposits_total: s.deposits_total,
        escaped: s.escaped,
        rejected: s.rejected,
        truncated: s.truncated,
        absorbed_back: s.absorbed_back,
        paths_per_s: s.paths_per_s,
        rays_per_s: s.rays_per_s,
        deposits_per_s: s.deposits_per_s,
        pool_paths: s.pool_paths,
        pool_capacity: s.pool_capacity,
        pool_valid: s.pool_valid,
        refined_paths: s.refined_paths,
        stale_share: s.stale_share,
        mean_age_s: light.mean_s,
        greatest_age_s: light.greatest_s,
        relative_error: light.relative_error,
        target_error: some(s.target_error),
        retraced_paths: s.retraced_paths,
        rays_saved: s.rays_saved,
        latency_ms: some(s.latency_ms),
        latency_target_ms: some(s.latency_target_ms),
        change: changes.ago_ms(now_ns).map(|age_ms| Change {
            age_ms,
            traced_ms: changes.traced_ms(),
            published_ms: changes.published_ms(),
            settled_ms: changes.settled_ms(),
        }),
        total_flux_w: total_flux(frame),
        decisions: scene.features.decisions().into_iter().map(Feature::from).collect(),
    })
}

fn total_flux(frame: &VslFrame) -> [f64; 3] {
    let add = |sum: [f64; 3], flux: [f32; 3]| std::array::from_fn(|c| sum[c] + f64::from(flux[c]));
    frame.vsls.iter().fold([0.0; 3], |sum, vsl| add(sum, vsl.flux))
}

fn text(r: &Report) -> String {
    let reason = r.state_reason.as_ref().map_or_else(String::new, |reason| format!(" ({reason})"));
    let mut out = format!(
        "channel {}: {}{reason}; {}, ABI {}, epoch {}, frame {}, config {}\n",
        r.channel,
        r.state,
        if r.converged { "light has converged" } else { "light is settling" },
        r.abi,
        r.epoch,
        r.frame,
        r.config_generation,
    );
    out.extend(r.notice.iter().map(|notice| format!("notice   {}\n", notice.replace('\n', "\n         "))));
    out.push_str(&format!(
        "scene    {} (hash {}): {} VSLs, {} objects, {} lights\n",
        r.scene,
        r.scene_hash,
        grouped(r.vsls as u64),
        r.objects,
        r.lights
    ));
    if let Some(method) = &r.method.method {
        out.push_str(&format!("method   {method}{}\n", update(&r.method)));
    }
    if r.method.update_us.is_none() {
        out.push_str(&photons(r));
    }
    out.push_str(&change(r));
    out.push_str(&format!("age      {:.1} ms since the last frame\n", r.frame_age_ms));
    out.push_str("modelled:\n");
    out.extend(r.decisions.iter().map(Feature::line));
    out
}

/// What a method of few lights does.
fn update(told: &Told) -> String {
    let (Some(shining), Some(us)) = (told.shining, told.update_us) else { return String::new() };
    format!(": {} lights shine, the last update took {us:.1} µs", grouped(shining as u64))
}

/// What photons have done, and how exact their light is.
fn photons(r: &Report) -> String {
    let [red, green, blue] = r.total_flux_w;
    let mut out = String::new();
    out.push_str(&format!(
        "rates    {}paths/s, {}rays/s, {}deposits/s on {} threads\n",
        si(r.paths_per_s),
        si(r.rays_per_s),
        si(r.deposits_per_s),
        r.threads
    ));
    out.push_str(&format!(
        "total    {} paths, {} rays, {} deposits in {:.1} s; {} escaped, {} on black sides, {} truncated, {} rejected\n",
        grouped(r.paths_total),
        grouped(r.rays_total),
        grouped(r.deposits_total),
        r.simulation_time_s,
        grouped(r.escaped),
        grouped(r.absorbed_back),
        grouped(r.truncated),
        grouped(r.rejected)
    ));
    out.push_str(&format!(
        "pool     {} of {} paths{}, {} beyond the pool; leaving the surfaces: {red:.3}, {green:.3}, {blue:.3} W\n",
        grouped(r.pool_valid),
        grouped(r.pool_paths),
        if r.pool_capacity > r.pool_paths { format!(" (at most {})", grouped(r.pool_capacity)) } else { String::new() },
        grouped(r.refined_paths),
    ));
    out.push_str(&format!(
        "light    {:.1} % of the paths stale, {:.1} s old in the mean and {:.1} s at most; standard error {:.2} %{}\n",
        r.stale_share * 100.0,
        r.mean_age_s,
        r.greatest_age_s,
        r.relative_error * 100.0,
        r.target_error.map_or_else(String::new, |target| format!(" (target {:.2} %)", target * 100.0)),
    ));
    out
}

/// What is known of the last change and of what changes cost.
fn change(r: &Report) -> String {
    let Some(change) = &r.change else { return "change   none yet\n".into() };
    let ms =
        |what: &str, ms: Option<f64>| ms.map_or_else(String::new, |ms| format!(", {what} after {ms:.1} ms"));
    let target = r.latency_target_ms.map_or_else(String::new, |ms| format!(" (target {ms:.0} ms)"));
    format!(
        "change   {:.1} s ago{}{}{}{}{target}; {} paths traced again, {} rays saved\n",
        change.age_ms * 1e-3,
        ms("published", change.published_ms),
        ms("traced", change.traced_ms),
        ms("all its light published", change.settled_ms),
        if change.traced_ms.is_none() { ", not yet traced" } else { "" },
        grouped(r.retraced_paths),
        grouped(r.rays_saved),
    )
}
