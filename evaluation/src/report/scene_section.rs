//! Turns what was measured of one scene into a section of the page.

use super::{
    SceneSheet, accumulation, again, bars,
    charts::{Chart, log_log},
    choose, escape, figure,
    series::{of_sweep, setting_against_error, time_against_error},
    tables, time,
};
use crate::{
    EvaluateError, plan,
    point::Method,
    results::{Results, Row},
};

/// The identifier of a scene's section.
pub(super) fn anchor(index: usize) -> String {
    format!("scene-{}", index + 1)
}

/// The section of scene number `index`.
pub(super) fn section(results: &Results, sheet: &SceneSheet, index: usize) -> Result<String, EvaluateError> {
    let rows: Vec<&Row> = results.rows.iter().filter(|row| row.scene_hash == sheet.hash).collect();
    let id = anchor(index);
    let mut out = format!("<section id=\"{id}\"><h2>{}</h2>", escape(&sheet.name));
    let size = rows.first().map_or(String::new(), |r| format!("{} × {} pixels, ", r.width_px, r.height_px));
    out.push_str(&format!(
        "<p>{size}{} triangles, scene <code>{}</code>. Reference: {} paths per pixel; its own relative RMSE from noise, \
         measured between two independent halves of its samples, is {} (indirect light {}).</p>",
        sheet.triangles,
        sheet.hash,
        sheet.noise.spp,
        figure(sheet.noise.full),
        figure(sheet.noise.indirect)
    ));
    let fully_threaded = |r: &&Row| r.threads == rows[0].threads || r.spp.is_some();
    let candidates: Vec<&Row> = rows.iter().copied().filter(fully_threaded).collect();
    out.push_str(&choose::tables(&candidates, sheet.noise.full));
    // A device has cores of its own: what it draws is no point at equal cores.
    // The sweeps of one setting have points that are slower and no better; they are measured, and count.
    let timed: Vec<&Row> =
        candidates.into_iter().filter(|r| r.method != Method::PhotonStreamingGpu.name()).collect();
    out.push_str("<h3>Error against time</h3>");
    out.push_str("<p>Full picture. Time is light and picture, on the same cores, rays and scene.</p>");
    let chart = Chart {
        says: "Relative RMSE of the full picture against time, both logarithmic",
        x: "time",
        y: "relative RMSE",
        is_time: true,
        floor: Some(sheet.noise.full),
    };
    out.push_str(&log_log(chart, &time_against_error(&timed, |row| row.rel_rmse))?);
    out.push_str(&again::points("of this chart", &timed, "rel. RMSE", |row| row.rel_rmse));
    out.push_str(&tables::budgets(&timed));
    out.push_str("<h3>Indirect light alone</h3>");
    let chart = Chart {
        says: "Relative RMSE of indirect light against time, both logarithmic",
        floor: Some(sheet.noise.indirect),
        ..chart
    };
    out.push_str(&log_log(chart, &time_against_error(&timed, |row| row.rel_rmse_indirect))?);
    out.push_str(&again::points("of this chart", &timed, "rel. RMSE, indirect", |row| row.rel_rmse_indirect));
    out.push_str("<h3>Side by side</h3><p>Of each method the picture with the least error in the time that the scene's own \
                  settings take, or its fastest.</p>");
    out.push_str(&sheet.html()?);
    out.push_str(&sheet.figures_html()?);
    out.push_str(&settings_charts(&rows, sheet)?);
    out.push_str(&accumulation::part(results, &rows));
    out.push_str(&causes(results, sheet)?);
    out.push_str(&modelled(sheet));
    out.push_str(&format!(
        "<details><summary>All {} measurements, with the commands that repeat them</summary>{}</details></section>",
        rows.len(),
        tables::all(&rows)
    ));
    Ok(out)
}

fn settings_charts(rows: &[&Row], sheet: &SceneSheet) -> Result<String, EvaluateError> {
    let mut out = String::new();
    let chart = Chart {
        says: "",
        x: "",
        y: "rel. RMSE, indirect",
        is_time: false,
        floor: Some(sheet.noise.indirect),
    };
    let vsls = of_sweep(rows, plan::VSLS);
    if !vsls.is_empty() {
        out.push_str("<h3>Error against the number of lights</h3>");
        let series = setting_against_error(
            &vsls,
            |r| r.vsls_placed.map(|n| n as f64),
            |r| format!("Kernel {}", r.kernel.as_deref().unwrap_or("–")),
        );
        let says = "Relative RMSE of indirect light against the number of virtual surface lights";
        out.push_str(&log_log(Chart { says, x: "virtual surface lights", ..chart }, &series)?);
        out.push_str(&again::points("of this chart", &vsls, "rel. RMSE, indirect", |row| {
            row.rel_rmse_indirect
        }));
    }
    let pool = of_sweep(rows, plan::POOL);
    if !pool.is_empty() {
        out.push_str("<h3>Error against the pool</h3>");
        let series =
            setting_against_error(&pool, |r| r.pool_paths.map(f64::from), |_| "Paths in the pool".into());
        let says = "Relative RMSE of indirect light against the paths in the pool";
        out.push_str(&log_log(Chart { says, x: "paths in the pool", ..chart }, &series)?);
        out.push_str(&again::points("of this chart", &pool, "rel. RMSE, indirect", |row| {
            row.rel_rmse_indirect
        }));
    }
    let shading = of_sweep(rows, plan::SHADING);
    if !shading.is_empty() {
        out.push_str("<h3>One setting at a time</h3>");
        let name = |r: &Row| {
            let or = |s: &Option<String>| s.clone().unwrap_or_default();
            format!("{}, {}", or(&r.kernel), or(&r.visibility))
        };
        out.push_str(&tables::sweep("Kernel, visibility", &shading, name));
        let sampling = of_sweep(rows, plan::SAMPLING);
        out.push_str(&tables::sweep("Sampling", &sampling, |r| r.sampling.clone().unwrap_or_default()));
        let mut threads = of_sweep(rows, plan::THREADS);
        threads.sort_by_key(|row| row.threads);
        out.push_str(&tables::sweep("Threads", &threads, |r| r.threads.to_string()));
    }
    Ok(out)
}

fn causes(results: &Results, sheet: &SceneSheet) -> Result<String, EvaluateError> {
    let mut out = String::new();
    let splits: Vec<_> = results.splits.iter().filter(|s| s.scene == sheet.name).collect();
    if let Some(first) = splits.first() {
        out.push_str("<h3>What causes the error</h3>");
        out.push_str(&format!(
            "<p>Mean squared error of indirect light over the squared mean of the reference, {} lights, {} paths, in a \
             picture of a quarter of the pixels. Variance: between {} pictures with independent samples. Visibility: \
             against true shadows. Discretisation: against {} lights. Bias: what those lights with true shadows still have. \
             Staleness comes on top while something moves: {} after an object has moved by its radius. Whole = all but \
             staleness; mixed terms are in the table.</p>",
            first.vsls,
            first.pool_paths,
            4,
            first.many_vsls,
            time(first.staleness_after_ms)
        ));
        out.push_str(&bars::splits(&splits)?);
        out.push_str(&tables::splits(&splits));
        out.push_str(&whole(results));
    }
    let changes: Vec<_> = results.changes.iter().filter(|c| c.scene == sheet.name).collect();
    if !changes.is_empty() {
        out.push_str("<h3>After a step change</h3><p>From the arrival of the change at a running simulator until the \
                      published light of all surfaces has gone 95 % of the way to the new one, and stays there. Medians.</p>");
        out.push_str(&bars::changes(&changes)?);
        out.push_str(&tables::changes(&changes));
        out.push_str(&whole(results));
    }
    Ok(out)
}

/// The command of numbers that no point has alone.
fn whole(results: &Results) -> String {
    format!("<p class=\"note\">Measured again by <code>{}</code></p>", escape(&results.command))
}

fn modelled(sheet: &SceneSheet) -> String {
    let mut out = String::from("<h3>What was modelled</h3><ul class=\"decisions\">");
    for decision in &sheet.decisions {
        let (class, sign) = if decision.modelled { ("yes", "modelled") } else { ("no", "left out") };
        out.push_str(&format!(
            "<li><span class=\"{class}\">{sign}</span> <strong>{}</strong>: {}</li>",
            escape(decision.what),
            escape(&decision.reason)
        ));
    }
    out.push_str("</ul>");
    if !sheet.notices.is_empty() {
        let notices: String = sheet.notices.iter().map(|n| format!("<li>{}</li>", escape(n))).collect();
        out.push_str(&format!("<p>While loading:</p><ul>{notices}</ul>"));
    }
    out
}
