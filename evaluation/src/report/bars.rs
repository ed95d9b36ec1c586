//! Turns splits and step changes into horizontal bars.

use super::{
    charts::{SIZES, text_style, themed},
    escape, figure,
    series::{COLOURS, css},
    time,
};
use crate::{
    EvaluateError,
    results::{Split, StepChange},
};
use plotters::prelude::*;

/// A bar: its name, and the lengths of its parts with their looks.
struct Bar {
    name: String,
    parts: Vec<(f64, usize)>,
    says: String,
}

/// Names of the parts of a split, in the order of their looks.
const PARTS: [&str; 5] = ["variance", "visibility", "discretisation", "bias", "staleness"];

/// Splits as stacked bars, with their legend.
pub(super) fn splits(splits: &[&Split]) -> Result<String, EvaluateError> {
    let bars: Vec<Bar> = splits
        .iter()
        .map(|split| {
            let parts = [
                split.variance,
                split.visibility_part,
                split.discretisation,
                split.bias,
                split.staleness.unwrap_or(0.0),
            ];
            Bar {
                name: format!("{}, {}", split.kernel, split.visibility),
                parts: parts.into_iter().enumerate().map(|(look, part)| (part, look)).collect(),
                says: format!("RMSE {}", figure(split.total.sqrt())),
            }
        })
        .collect();
    let says = "Mean squared error of indirect light by cause, a bar for each kernel and visibility";
    let legend: Vec<(&str, usize)> = PARTS.iter().copied().zip(0..).collect();
    chart(&bars, says, &legend)
}

/// t95 beside a whole trace, in ms.
pub(super) fn changes(changes: &[&StepChange]) -> Result<String, EvaluateError> {
    let mut bars = Vec::new();
    for change in changes {
        let t95 = change.figures.t95_ms;
        bars.push(Bar { name: change.figures.event.clone(), parts: vec![(t95, 0)], says: time(t95) });
    }
    if let Some(whole) = changes.first().map(|c| c.full_trace_ms).filter(|&ms| ms > 0.0) {
        bars.push(Bar { name: "the whole pool".into(), parts: vec![(whole, 4)], says: time(whole) });
    }
    let legend = [("t95: 95 % of the way to the new light", 0), ("tracing everything again", 4)];
    chart(&bars, "Time until the light has followed a change, and time to trace the whole pool", &legend)
}

fn chart(bars: &[Bar], says: &str, legend: &[(&str, usize)]) -> Result<String, EvaluateError> {
    if bars.is_empty() {
        return Ok(String::new());
    }
    let mut out = String::from("<figure class=\"chart\">");
    for (class, width, _) in SIZES {
        let mut svg = String::new();
        draw(&mut svg, width, bars).map_err(|e| EvaluateError::draw(says, e))?;
        out.push_str(&themed(&svg, class, says));
    }
    out.push_str("<figcaption><ul class=\"legend\">");
    for (name, look) in legend {
        out.push_str(&format!(
            "<li><svg class=\"swatch\" viewBox=\"0 0 20 14\" aria-hidden=\"true\"><rect width=\"20\" height=\"14\" \
             fill=\"{}\"/></svg>{}</li>",
            css(*look),
            escape(name)
        ));
    }
    out.push_str("</ul></figcaption></figure>");
    Ok(out)
}

type Drawn = Result<(), Box<dyn std::error::Error + Send + Sync>>;

fn draw(svg: &mut String, width: u32, bars: &[Bar]) -> Drawn {
    let is_wide = width > 500;
    let (row, left, right) = if is_wide { (34, 210, 110) } else { (50, 4, 92) };
    let thickness = 20;
    let height = row * bars.len() as u32 + 8;
    let longest = bars.iter().map(|b| b.parts.iter().map(|p| p.0).sum::<f64>()).fold(0.0, f64::max);
    let room = f64::from(width as i32 - left - right);
    let root = SVGBackend::with_string(svg, (width, height)).into_drawing_area();
    for (index, bar) in bars.iter().enumerate() {
        let top = 4 + index as i32 * row as i32;
        // On phones the name stands above its bar.
        let (bar_top, name_at, to_the_right) = if is_wide {
            (top + 7, (left - 10, top + 7 + thickness / 2), true)
        } else {
            (top + 22, (left, top + 11), false)
        };
        root.draw_text(&bar.name, &text_style(14, to_the_right), name_at)?;
        let mut x = f64::from(left);
        for &(length, look) in &bar.parts {
            let end = x + room * length / longest.max(f64::MIN_POSITIVE);
            let [r, g, b] = COLOURS[look % COLOURS.len()];
            let corners = [(x.round() as i32, bar_top), (end.round() as i32, bar_top + thickness)];
            if corners[1].0 > corners[0].0 {
                root.draw(&Rectangle::new(corners, RGBColor(r, g, b).filled()))?;
            }
            x = end;
        }
        let at = (x.round() as i32 + 8, bar_top + thickness / 2);
        root.draw_text(&bar.says, &text_style(14, false), at)?;
    }
    root.present()?;
    Ok(())
}
