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
    ABI_MAJOR, ABI_MINOR, ChannelName, Liveness, Subscriber, VslFrame, monotonic_ns,
};
use photonstream_scene::Scene;
use serde::Serialize;
use std::{
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

/// Arguments of `photonstream inspect`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
With --watch a report follows every second until Ctrl-C; with --json as well, each is one line.

JSON: { \"channel\", \"state\": live | paused | stalled | gone | retired, \"state_reason\", \"abi\", \"epoch\", \"frame\",
  \"config_generation\", \"frame_age_ms\", \"latency_ms\": from the last tracing to its publication, \"scene\", \"scene_hash\",
  \"vsls\", \"objects\", \"lights\", \"threads\", \"converged\", \"simulation_time_s\", \"paths_total\", \"rays_total\",
  \"deposits_total\", \"escaped\", \"rejected\", \"truncated\", \"absorbed_back\", \"paths_per_s\", \"rays_per_s\",
  \"deposits_per_s\", \"pool_paths\", \"pool_valid\", \"stale_share\", \"total_flux_w\": [r, g, b],
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
    frame_age_ms: f64,
    latency_ms: f64,
    scene: String,
    scene_hash: String,
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
    pool_valid: u64,
    stale_share: f64,
    total_flux_w: [f64; 3],
    decisions: Vec<Feature>,
}

const PERIOD: Duration = Duration::from_secs(1);

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let mut subscriber = follow::present_frame(&args.channel)?;
    if !args.watch {
        return output::report(global.json, &report(args, &subscriber)?, text);
    }
    let ended = Listener::flag_only()?;
    while !ended.load(Ordering::Relaxed) {
        let report = report(args, &subscriber)?;
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
            subscriber.read()?;
        }
    }
    // To watch until Ctrl-C is what was asked for.
    std::process::exit(i32::from(exit::OK));
}

fn report(args: &Args, subscriber: &Subscriber) -> Result<Report, LauncherError> {
    let frame = subscriber.frame().expect("invariant: present_frame waits for one");
    let scene = Scene::from_resolved(&frame.scene_text)?;
    let (state, state_reason) = match subscriber.liveness() {
        Liveness::Live => ("live", None),
        Liveness::Paused => ("paused", None),
        Liveness::Stalled { age } => ("stalled", Some(format!("no sign of life for {} ms", age.as_millis()))),
        Liveness::Gone { reason } => ("gone", Some(reason)),
        Liveness::Retired => ("retired", None),
    };
    let s = &frame.statistics;
    let ms = |from: u64, to: u64| to.saturating_sub(from) as f64 * 1e-6;
    Ok(Report {
        channel: args.channel.to_string(),
        state,
        state_reason,
        abi: format!("{ABI_MAJOR}.{ABI_MINOR}"),
        epoch: frame.epoch,
        frame: frame.frame,
        config_generation: frame.config_generation,
        frame_age_ms: ms(frame.publish_time_ns, monotonic_ns()),
        latency_ms: ms(s.traced_ns, s.published_ns.max(s.traced_ns)),
        scene: scene.name.clone(),
        scene_hash: format!("{:016x}", frame.scene_hash),
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
        pool_valid: s.pool_valid,
        stale_share: s.stale_share,
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
    let [red, green, blue] = r.total_flux_w;
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
    out.push_str(&format!(
        "scene    {} (hash {}): {} VSLs, {} objects, {} lights\n",
        r.scene,
        r.scene_hash,
        grouped(r.vsls as u64),
        r.objects,
        r.lights
    ));
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
        "pool     {} of {} paths, {:.1} % stale; leaving the surfaces: {red:.3}, {green:.3}, {blue:.3} W\n",
        grouped(r.pool_valid),
        grouped(r.pool_paths),
        r.stale_share * 100.0
    ));
    out.push_str(&format!(
        "age      {:.1} ms, published {:.2} ms after tracing\n",
        r.frame_age_ms, r.latency_ms
    ));
    out.push_str("modelled:\n");
    out.extend(r.decisions.iter().map(Feature::line));
    out
}
