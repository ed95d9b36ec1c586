//! Turns rows of a graphics device into the tables of its accumulations, or into the reason why there are none.

use super::{escape, series::of_sweep, tables};
use crate::{
    device::WITHOUT,
    plan,
    results::{Results, Row},
};

/// The part of a scene's section that is about its graphics device.
pub(super) fn part(results: &Results, rows: &[&Row]) -> String {
    let mut out = String::from("<h3>On the GPU: how lights are summed</h3>");
    let shown = of_sweep(rows, plan::ACCUMULATION);
    let Some(adapter) = shown.iter().find_map(|row| row.adapter.as_ref()) else {
        let why = results.skipped.iter().find(|s| s.what == WITHOUT).map(|s| escape(&s.why));
        let why =
            why.unwrap_or_else(|| "it was not asked for, or cannot do it; see what was left out".into());
        out.push_str(&format!("<p>Not measured: {why}.</p>"));
        return out;
    };
    out.push_str(&format!(
        "<p>Adapter: <strong>{}</strong>. A frame is the light uploaded whole and every pass of the picture drawn again, but \
         for shadow maps of lights that stand still; the median of three to five frames, after one that is not counted. Light \
         is traced by the processor's cores, as everywhere. A software rasteriser (llvmpipe) runs on those same cores; any \
         other adapter has more to work with than the methods above, so that its times are compared among themselves. Direct \
         light is that of shadow maps.</p>",
        escape(adapter)
    ));
    let setting = |row: &Row| {
        let edge = row.interleave.unwrap_or(1);
        let pattern = if edge > 1 { format!(", interleave {edge}") } else { String::new() };
        let or = |s: &Option<String>| s.clone().unwrap_or_default();
        format!("{}{pattern}; visibility {}", or(&row.accumulation), or(&row.visibility))
    };
    out.push_str(&tables::sweep("Accumulation", &shown, setting));
    let sizes = of_sweep(rows, plan::GPU);
    if !sizes.is_empty() {
        let setting = |row: &Row| {
            let count = |n: Option<u32>| n.map_or("–".into(), |n| n.to_string());
            let shadows = row.visibility.as_deref().unwrap_or("–");
            format!("{} lights, {} paths; visibility {shadows}", count(row.vsls), count(row.pool_paths))
        };
        out.push_str(&tables::sweep("Lights and pool on the GPU", &sizes, setting));
    }
    out
}
