//! Turns what was asked for into commands that ask for it again.

use crate::{
    evaluate::Options,
    plan::Effort,
    point::{Method, Point},
};
use std::path::Path;

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let path = path.display().to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    if path.chars().all(is_plain) { path } else { format!("'{}'", path.replace('\'', r"'\''")) }
}

fn with_arguments(command: String, arguments: &str) -> String {
    if arguments.is_empty() { command } else { format!("{command} {arguments}") }
}

/// The whole evaluation; `arguments` choose the graphics device.
pub(crate) fn whole(options: &Options, arguments: &str) -> String {
    let mut command = String::from("photonstream evaluate");
    for config in &options.configs {
        command.push_str(&format!(" {}", quoted(config)));
    }
    command.push_str(" --out again");
    if options.effort == Effort::Quick {
        command.push_str(" --quick");
    }
    let mut add = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            command.push_str(&format!(" --{name} {value}"));
        }
    };
    add("size", options.size.map(|(width, height)| format!("{width}x{height}")));
    add("spp", options.reference_spp.map(|n| n.to_string()));
    add("time", options.time_s.map(|t| t.to_string()));
    add("threads", options.threads.map(|n| n.to_string()));
    add("seed", options.seed.map(|n| n.to_string()));
    for point in &options.points {
        add("point", Some(point.clone()));
    }
    with_arguments(command, arguments)
}

/// One point of `config`, at a moment if one is given, in a picture of so many pixels, against a reference of `spp` paths per pixel.
pub(crate) fn of_point(
    (config, time_s): (&Path, Option<f64>),
    (width, height): (u32, u32),
    spp: u64,
    point: &Point,
    arguments: &str,
) -> String {
    let config = quoted(config);
    let time = time_s.map_or(String::new(), |t| format!(" --time {t}"));
    let command = format!(
        "photonstream evaluate {config} --out again --size {width}x{height} --spp {spp}{time} --point {point}"
    );
    with_arguments(command, if point.method == Method::PhotonStreamingGpu { arguments } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn everything_that_was_asked_for_is_asked_for_again() {
        let options = Options {
            configs: vec!["a.toml".into(), PathBuf::from("it's b.toml")],
            out: "out".into(),
            cache: "cache".into(),
            effort: Effort::Quick,
            size: Some((8, 6)),
            reference_spp: Some(4),
            time_s: None,
            threads: Some(2),
            seed: Some(7),
            points: vec!["path-tracing:spp=3".into()],
        };
        let expected = r"photonstream evaluate a.toml 'it'\''s b.toml' --out again --quick --size 8x6 --spp 4 --threads 2 --seed 7 --point path-tracing:spp=3 --software";
        assert_eq!(whole(&options, "--software"), expected);
    }
}
