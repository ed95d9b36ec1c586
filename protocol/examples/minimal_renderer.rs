//! Turns a channel's frames into JSON lines and a picture from above: a whole plug-in renderer.
//!
//! Installed as `photonstream-renderer-NAME` on the PATH it is run by `photonstream run --renderer NAME`.

use std::io::Write;
use std::sync::{Arc, atomic::AtomicBool, atomic::Ordering::Relaxed};
use std::time::Duration;

use photonstream_protocol::{AccessMode, ChannelName, Liveness, Reading, Subscriber, VslFrame};

/// A PPM of 256 × 256 pixels: each light a dot at its place seen from above (x to the right, z down), in its colour.
fn picture(frame: &VslFrame) -> Vec<u8> {
    let brightest = frame.vsls.iter().flat_map(|vsl| vsl.flux).fold(f32::MIN_POSITIVE, f32::max);
    let extent =
        frame.vsls.iter().fold(f32::MIN_POSITIVE, |e, v| e.max(v.position[0].abs()).max(v.position[2].abs()));
    let mut pixels = vec![0; 256 * 256 * 3];
    for vsl in &frame.vsls {
        let place = |metres: f32| ((metres / extent + 1.0) * 127.5) as usize;
        let at = 3 * (place(vsl.position[2]) * 256 + place(vsl.position[0]));
        for (pixel, flux) in pixels[at..at + 3].iter_mut().zip(vsl.flux) {
            *pixel = (*pixel).max(((flux / brightest).max(0.0).sqrt() * 255.0) as u8);
        }
    }
    [b"P6 256 256 255\n".to_vec(), pixels].concat()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1));
    let channel: ChannelName = value("--channel").map_or("default", String::as_str).parse()?;
    let frames: u64 = value("--frames").map_or(Ok(u64::MAX), |n| n.parse())?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let cancelled = || stop.load(Relaxed);
    let mut subscriber =
        Subscriber::attach_wait(&channel, AccessMode::Mapped, Duration::from_secs(30), &cancelled)?;
    let mut shown = 0;
    while shown < frames && !cancelled() && subscriber.liveness() != Liveness::Retired {
        if subscriber.read()? != Reading::New {
            subscriber.wait(Duration::from_millis(100));
            continue;
        }
        let changed = subscriber.changed_chunks().len();
        let Some(frame) = subscriber.frame() else { continue };
        let flux_w =
            frame.vsls.iter().fold([0.0; 3], |sum, vsl| [0, 1, 2].map(|c| sum[c] + f64::from(vsl.flux[c])));
        let (number, lights) = (frame.frame, frame.vsls.len());
        let line =
            format!(r#""frame":{number},"vsls":{lights},"changed_chunks":{changed},"flux_w":{flux_w:?}"#);
        writeln!(std::io::stdout(), "{{{line}}}")?;
        if let Some(path) = value("--out") {
            std::fs::write(std::path::Path::new(path).join("above.ppm"), picture(frame))?;
        }
        shown += 1;
    }
    Ok(())
}
