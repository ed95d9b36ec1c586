//! Turns the lines of the simulator's methods into a section after paper B's figure 12.

use super::{escape, figure, tables::framed, time};
use crate::motion::MethodLine;

/// The section; empty where there are no lines.
pub(super) fn section(lines: &[MethodLine], command: &str) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let head = [
        "scene",
        "method",
        "update",
        "lights",
        "frame",
        "FLIP",
        "rel. RMSE",
        "rel. RMSE, indirect",
        "flicker",
    ];
    let body: String = lines
        .iter()
        .enumerate()
        .map(|(index, line)| {
            let is_first = index == 0 || lines[index - 1].scene != line.scene;
            let scene = if is_first { escape(&line.scene) } else { String::new() };
            let cells = [
                micro(line.update_us),
                line.lights.to_string(),
                time(line.frame_ms),
                figure(line.flip),
                figure(line.rel_rmse),
                figure(line.rel_rmse_indirect),
                line.flicker.map_or("–".into(), figure),
            ];
            let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
            format!("<tr><th scope=\"row\">{scene}</th><td>{}</td>{cells}</tr>", escape(&line.method))
        })
        .collect();
    format!(
        "<section id=\"methods\"><h2>Methods of the simulator</h2><p>After figure 12 of paper B. Update: the whole light anew \
         (of photon streaming all paths of the pool, on all threads; of the others on one, of which paper B reports none). \
         Lights: those that shine, or are placed. Frame: the picture by the CPU renderer. Errors are against the path-traced \
         reference, of all bounces: what a method of one or two bounces leaves out counts. Flicker: the root of the mean square \
         of the second differences of indirect light from frame to frame over its mean, at 30 frames a second while the scene \
         moves; light that changes evenly has none, and what truly jumps counts in every method.</p>{}\
         <p class=\"note\">Measured again by <code>{}</code></p></section>",
        framed("Methods of the simulator", &head, &body),
        escape(command)
    )
}

/// A time for people, from µs.
fn micro(us: f64) -> String {
    match us {
        us if us >= 995.0 => time(us * 1e-3),
        us if us >= 9.95 => format!("{us:.0} µs"),
        us => format!("{us:.1} µs"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_scene_is_named_once() {
        let line = |scene: &str, update_us, flicker| MethodLine {
            scene: scene.into(),
            method: "static-vpl".into(),
            update_us,
            lights: 7,
            frame_ms: 12.0,
            flip: 0.1,
            rel_rmse: 0.2,
            rel_rmse_indirect: 0.3,
            flicker,
        };
        let lines = [line("A<", 3.21, None), line("A<", 2e5, Some(0.0123)), line("B", 45.0, None)];
        let html = section(&lines, "photonstream evaluate a.toml");
        assert_eq!(html.matches("A&lt;").count(), 1);
        for part in [">3.2 µs<", ">200 ms<", ">45 µs<", ">0.0123<", ">–<"] {
            assert!(html.contains(part), "{part}: {html}");
        }
        assert_eq!(section(&[], ""), "");
    }
}
