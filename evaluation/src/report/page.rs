//! Turns results into the text of the page.

use super::{SceneSheet, escape, few_lights, hard_cases, scene_section};
use crate::{EvaluateError, results::Results};

const STYLE: &str = include_str!("style.css");

/// The page.
pub(super) fn page(results: &Results, sheets: &[SceneSheet]) -> Result<String, EvaluateError> {
    let machine = &results.machine;
    let mut links = String::new();
    let mut sections = String::new();
    for (index, sheet) in sheets.iter().enumerate() {
        let id = scene_section::anchor(index);
        links.push_str(&format!("<li><a href=\"#{id}\">{}</a></li>", escape(&sheet.name)));
        let has_rows = results.rows.iter().any(|row| row.scene_hash == sheet.hash);
        if has_rows {
            sections.push_str(&scene_section::section(results, sheet, index)?);
        } else {
            let name = escape(&sheet.name);
            sections.push_str(&format!("<section id=\"{id}\"><h2>{name}</h2><p>Not measured.</p></section>"));
        }
    }
    let state = if results.complete {
        String::new()
    } else {
        "<p class=\"warning\" role=\"status\">This evaluation was interrupted: what follows is what was measured until \
         then.</p>"
            .into()
    };
    let skipped: String = results
        .skipped
        .iter()
        .map(|s| format!("<li><strong>{}</strong>: {}</li>", escape(&s.what), escape(&s.why)))
        .collect();
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\
         <link rel=\"icon\" href=\"data:,\"><title>photonstream: speed against error</title><style>{STYLE}</style></head>\
         <body><a class=\"skip\" href=\"#main\">Skip to the results</a>\
         <header><h1>Speed against error</h1>\
         <p>{cpu}, {cores} cores; {adapter}; commit <code>{commit}</code>; {points} points in {seconds:.0} s. \
         Tables as files: <a href=\"results.csv\">results.csv</a>, <a href=\"results.json\">results.json</a>.</p>\
         <p>All of it again: <code>{command}</code></p>\
         <nav aria-label=\"Sections\"><ul>{links}{methods_link}<li><a href=\"#hard-cases\">Hard cases</a></li><li><a href=\"#how\">How it is measured</a></li>\
         <li><a href=\"#skipped\">What was left out</a></li></ul></nav></header>\
         <main id=\"main\" tabindex=\"-1\">{state}{sections}{methods}{hard_cases}{HOW}\
         <section id=\"skipped\"><h2>What was left out, and why</h2><ul>{skipped}</ul></section></main></body></html>\n",
        cpu = escape(&machine.cpu),
        cores = machine.cores,
        methods_link = if results.methods.is_empty() { "" } else { METHODS_LINK },
        adapter = results.adapter.as_ref().map_or("no graphics device".into(), |name| escape(name)),
        command = escape(&results.command),
        commit = escape(&machine.commit),
        points = results.rows.len(),
        seconds = results.seconds,
        methods = few_lights::section(&results.methods, &results.command),
        hard_cases = hard_cases::section(&results.hard_cases),
    ))
}

const METHODS_LINK: &str = "<li><a href=\"#methods\">Methods of the simulator</a></li>";

const HOW: &str = "<section id=\"how\"><h2>How it is measured</h2>\
<ul><li>All errors are in linear radiance, a against the reference b, over all pixels and channels: relative RMSE = \
√mean((a−b)²)/mean(b); relMSE = mean((a−b)²/(b²+0.01 mean(b)²)); bias = mean(a−b)/mean(b), signed; worst 1 % = mean of the \
largest 1 % of |a−b| over mean(b).</li>\
<li>FLIP compares the tone-mapped pictures at 67 pixels a degree.</li>\
<li>Noise floor: the error is less than √2 times the reference's own noise, so it is mostly that noise.</li>\
<li>Time is the tracing of a whole pool of light and the rendering of the picture, direct light included; what takes less \
than 50 ms is run up to five times, and the median counts. Placing lights is done once for a scene and stated by itself. A \
still scene needs no new light, and a change rarely needs a whole pool: see the step changes.</li>\
<li>Path tracing is the reference's own code with other seeds. Instant radiosity has a virtual light at each point where a \
light path meets a surface, and shadow rays to all of them; bounded: 1/(π r² + A), A a light's share of all surfaces. Paper \
A as written: f32 sums, its placement, kernel 1/(π r²), no indirect shadows, a stream of fresh paths of which the oldest is \
taken back; read after four turns of the pool, the time is that of one.</li>\
<li>Photon streaming on the GPU is the same light in the GPU renderer, with its own shadow maps for direct light and, for \
visibility rays, 32 shadow rays a pixel; a frame is timed until the device has done it, without reading it back.</li>\
<li>Every row names the command that measures it again. Times depend on what else the machine does.</li></ul></section>";
