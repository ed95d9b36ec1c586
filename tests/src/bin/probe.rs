//! Turns each frame of a channel into one line of JSON: a plug-in renderer, as somebody else would write it.
#![forbid(unsafe_code)]

use photonstream_protocol::{AccessMode, ChannelName, Liveness, ProtocolError, Reading, Subscriber};
use std::{
    error::Error,
    io::Write,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name: &str| {
        let at = arguments.iter().position(|a| a == name);
        let next = at.and_then(|i| arguments.get(i + 1)).cloned();
        next.or_else(|| arguments.iter().find_map(|a| a.strip_prefix(&format!("{name}="))).map(str::to_owned))
    };
    let channel: ChannelName = value("--channel").unwrap_or_else(|| "default".into()).parse()?;
    let frames: u64 = value("--frames").map_or(Ok(u64::MAX), |n| n.parse())?;
    let out = PathBuf::from(value("--out").unwrap_or_else(|| ".".into())).join("probe.jsonl");
    let stop = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGTERM, Arc::clone(&stop))?;
    let ended = || stop.load(Ordering::Relaxed);
    let mut subscriber =
        match Subscriber::attach_wait(&channel, AccessMode::Mapped, Duration::from_secs(600), &ended) {
            Err(ProtocolError::Cancelled { .. }) => return Ok(()),
            result => result?,
        };
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(out)?;
    let mut seen = 0;
    let mut alive = true;
    while !ended() && seen < frames {
        // Asked first: what was published before the end is then read.
        let liveness = subscriber.liveness();
        if subscriber.read()? == Reading::New
            && let Some(frame) = subscriber.frame()
        {
            let flux: f64 = frame.vsls.iter().flat_map(|v| v.flux).map(f64::from).sum();
            let (pid, epoch, number) = (std::process::id(), frame.epoch, frame.frame);
            let line = format!("{{\"pid\":{pid},\"epoch\":{epoch},\"frame\":{number},\"flux_w\":{flux}}}\n");
            file.write_all(line.as_bytes())?;
            seen += 1;
        }
        if liveness == Liveness::Retired {
            break;
        }
        let was_alive = std::mem::replace(&mut alive, !matches!(liveness, Liveness::Gone { .. }));
        if was_alive && !alive {
            // What is drawn while the simulator is gone: the last frame.
            let kept = subscriber.frame().map_or(0, |frame| frame.vsls.len());
            file.write_all(format!("{{\"gone\":true,\"kept_vsls\":{kept}}}\n").as_bytes())?;
        }
        subscriber.wait(Duration::from_millis(20));
    }
    Ok(())
}
