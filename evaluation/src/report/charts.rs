//! Turns series into charts: SVG that takes text and lines in the colour of the page around it.

use super::{
    escape, figure,
    series::{COLOURS, FRONT, Series, css},
};
use crate::EvaluateError;
use plotters::{
    coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter},
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};
use std::ops::Range;

/// What a chart says beside its points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart<'a> {
    /// One sentence for who does not see it.
    pub(super) says: &'a str,
    pub(super) x: &'a str,
    pub(super) y: &'a str,
    /// Whether x is a time in ms.
    pub(super) is_time: bool,
    /// An error that nothing can be told apart below: the reference's noise.
    pub(super) floor: Option<f64>,
}

/// Sizes of the drawing, in its own pixels: for wide pages, and for phones, where text would become too small.
pub(super) const SIZES: [(&str, u32, u32); 2] = [("wide", 860, 460), ("narrow", 400, 380)];

/// A chart in both sizes with its legend; nothing where there is no point.
pub(super) fn log_log(chart: Chart<'_>, series: &[Series]) -> Result<String, EvaluateError> {
    let is_shown = |p: &&(f64, f64)| p.0 > 0.0 && p.1 > 0.0 && p.0.is_finite() && p.1.is_finite();
    let points: Vec<(f64, f64)> =
        series.iter().flat_map(|s| s.points.iter().filter(is_shown)).copied().collect();
    if points.is_empty() {
        return Ok("<p>No points: nothing was measured, or every error is 0.</p>".into());
    }
    let mut out = String::from("<figure class=\"chart\">");
    for (class, width, height) in SIZES {
        let mut svg = String::new();
        draw(&mut svg, (width, height), chart, series, &points)
            .map_err(|e| EvaluateError::draw(chart.says, e))?;
        out.push_str(&themed(&svg, class, chart.says));
    }
    out.push_str("<figcaption><ul class=\"legend\">");
    for s in series.iter().filter(|s| s.points.iter().any(|p| is_shown(&p))) {
        out.push_str(&format!("<li>{}{}</li>", swatch(s), escape(&s.name)));
    }
    if let Some(floor) = chart.floor.filter(|&f| f > 0.0) {
        out.push_str(&format!(
            "<li><svg class=\"swatch\" viewBox=\"0 0 20 14\" aria-hidden=\"true\"><line x1=\"0\" y1=\"7\" x2=\"20\" \
             y2=\"7\" stroke=\"currentColor\" stroke-dasharray=\"3 3\"/></svg>Noise of the reference: {}</li>",
            figure(floor)
        ));
    }
    out.push_str("</ul></figcaption></figure>");
    Ok(out)
}

/// An SVG without a fixed size, black as the colour of text.
pub(super) fn themed(svg: &str, class: &str, says: &str) -> String {
    let body = svg.split_once("viewBox=").map_or("", |(_, rest)| rest);
    let body = body.replace("\"#000000\"", "\"currentColor\"");
    format!("<svg class=\"{class}\" role=\"img\" aria-label=\"{}\" viewBox={body}", escape(says))
}

fn swatch(series: &Series) -> String {
    let shape = if series.name == FRONT {
        "<line x1=\"0\" y1=\"7\" x2=\"20\" y2=\"7\" stroke=\"currentColor\" stroke-width=\"2\"/>".to_owned()
    } else {
        let colour = css(series.look);
        match series.look % 3 {
            0 => format!("<circle cx=\"10\" cy=\"7\" r=\"5\" fill=\"{colour}\"/>"),
            1 => format!("<path d=\"M10 1 L16 12 L4 12 Z\" fill=\"{colour}\"/>"),
            _ => format!("<path d=\"M5 2 L15 12 M15 2 L5 12\" stroke=\"{colour}\" stroke-width=\"2.5\"/>"),
        }
    };
    format!("<svg class=\"swatch\" viewBox=\"0 0 20 14\" aria-hidden=\"true\">{shape}</svg>")
}

/// The common logarithms of all values, with some room around them and between them.
fn range(values: impl Iterator<Item = f64> + Clone) -> Range<f64> {
    let low = values.clone().fold(f64::INFINITY, f64::min).log10();
    let high = values.fold(0.0, f64::max).log10();
    let more = 0.5 * (0.4 - (high - low)).max(0.0) + 0.12;
    low - more..high + more
}

/// Logarithms of round numbers in `range`, at most `most` of them: 1, 2, 5 of each decade, or powers of ten.
fn ticks(range: &Range<f64>, most: usize) -> Vec<f64> {
    let decades = range.start.floor() as i32..=range.end.ceil() as i32;
    let of = |steps: &[f64]| -> Vec<f64> {
        let all = decades.clone().flat_map(|d| steps.iter().map(move |s| s.log10() + f64::from(d)));
        all.filter(|t| range.contains(t)).collect()
    };
    let all = [&[1.0, 2.0, 3.0, 4.0, 5.0, 7.0][..], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
    let fitting = all.into_iter().map(of).find(|ticks| ticks.len() <= most);
    fitting.unwrap_or_else(|| of(&[1.0]))
}

/// Logarithms along an axis, with ticks of our own: plotters' logarithmic one names few numbers within a decade.
struct Axis {
    range: Range<f64>,
    ticks: Vec<f64>,
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let share = (value - self.range.start) / (self.range.end - self.range.start);
        from + (share * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        round_figure(10f64.powf(*value))
    }
}

type Drawn = Result<(), Box<dyn std::error::Error + Send + Sync>>;

fn draw(
    svg: &mut String,
    (width, height): (u32, u32),
    chart: Chart<'_>,
    series: &[Series],
    points: &[(f64, f64)],
) -> Drawn {
    let floor = chart.floor.filter(|&f| f > 0.0);
    let (xs, ys) = (points.iter().map(|p| p.0), points.iter().map(|p| p.1).chain(floor));
    let (xs, ys) = (range(xs), range(ys));
    let logs = |p: &(f64, f64)| (p.0.log10(), p.1.log10());
    {
        let root = SVGBackend::with_string(svg, (width, height)).into_drawing_area();
        let (x_ticks, y_ticks) = (ticks(&xs, if width > 500 { 13 } else { 5 }), ticks(&ys, 9));
        let (x_count, y_count) = (x_ticks.len(), y_ticks.len());
        let mut context = ChartBuilder::on(&root)
            .margin(8)
            .margin_right(20)
            .x_label_area_size(44)
            .y_label_area_size(if width > 500 { 66 } else { 56 })
            .build_cartesian_2d(
                Axis { range: xs.clone(), ticks: x_ticks },
                Axis { range: ys, ticks: y_ticks },
            )?;
        let grey = RGBColor(128, 128, 128);
        let label = TextStyle::from(("sans-serif", 13).into_font()).color(&BLACK);
        let x_text = |x: &f64| if chart.is_time { round_time(10f64.powf(*x)) } else { count(10f64.powf(*x)) };
        context
            .configure_mesh()
            .x_labels(x_count)
            .y_labels(y_count)
            .x_label_formatter(&x_text)
            .y_label_formatter(&|y: &f64| round_figure(10f64.powf(*y)))
            .x_desc(chart.x)
            .y_desc(chart.y)
            .label_style(label.clone())
            .axis_desc_style(label)
            .axis_style(grey)
            .bold_line_style(grey.mix(0.3))
            .light_line_style(TRANSPARENT)
            .draw()?;
        if let Some(floor) = floor.map(f64::log10) {
            let line =
                DashedLineSeries::new([(xs.start, floor), (xs.end, floor)], 5, 5, BLACK.stroke_width(1));
            context.draw_series(line)?;
        }
        for s in series {
            let [r, g, b] = COLOURS[s.look % COLOURS.len()];
            let colour = RGBColor(r, g, b);
            let shown: Vec<(f64, f64)> =
                s.points.iter().filter(|p| p.0 > 0.0 && p.1 > 0.0).map(logs).collect();
            if s.name == FRONT {
                context.draw_series(LineSeries::new(stairs(&shown, xs.end), BLACK.stroke_width(2)))?;
                continue;
            }
            if s.joined {
                context.draw_series(LineSeries::new(shown.iter().copied(), colour.stroke_width(2)))?;
            }
            match s.look % 3 {
                0 => context.draw_series(shown.iter().map(|&p| Circle::new(p, 5, colour.filled())))?,
                1 => {
                    context.draw_series(shown.iter().map(|&p| TriangleMarker::new(p, 7, colour.filled())))?
                }
                _ => context.draw_series(shown.iter().map(|&p| Cross::new(p, 5, colour.stroke_width(2))))?,
            };
        }
        root.present()?;
    }
    Ok(())
}

/// The best error that a time buys: it stays until the next point.
fn stairs(front: &[(f64, f64)], end: f64) -> Vec<(f64, f64)> {
    let mut line = Vec::new();
    for (i, &(x, y)) in front.iter().enumerate() {
        line.extend([(x, y), (front.get(i + 1).map_or(end, |next| next.0), y)]);
    }
    line
}

/// A number that is round but for rounding.
fn round(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

fn round_figure(x: f64) -> String {
    round(x).to_string()
}

fn round_time(ms: f64) -> String {
    if ms >= 999.0 { format!("{} s", round(ms * 1e-3)) } else { format!("{} ms", round(ms)) }
}

fn count(x: f64) -> String {
    match x {
        x if x >= 0.999e6 => format!("{} M", round(x * 1e-6)),
        x if x >= 0.999e4 => format!("{} k", round(x * 1e-3)),
        x => round(x).to_string(),
    }
}

/// Text of a chart that is drawn by hand.
pub(super) fn text_style(size: u32, right: bool) -> TextStyle<'static> {
    let position = Pos::new(if right { HPos::Right } else { HPos::Left }, VPos::Center);
    TextStyle::from(("sans-serif", size).into_font()).color(&BLACK).pos(position)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        let numbers = |low: f64, high: f64, most| -> Vec<f64> {
            ticks(&(low.log10()..high.log10()), most).into_iter().map(|t| round(10f64.powf(t))).collect()
        };
        assert_eq!(numbers(0.09, 0.6, 9), [0.1, 0.2, 0.3, 0.4, 0.5]);
        assert_eq!(numbers(0.9, 150.0, 7), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        assert_eq!(numbers(0.9, 15_000.0, 5), [1.0, 10.0, 100.0, 1000.0, 10_000.0]);
        assert_eq!((count(65_536.0), count(1e6), count(50.0)), ("65.5 k".into(), "1 M".into(), "50".into()));
        assert_eq!((round_time(0.5), round_time(2000.0)), ("0.5 ms".into(), "2 s".into()));
    }

    #[test]
    fn a_chart_without_points_says_so_and_one_with_a_point_has_text_in_the_colour_of_the_page() {
        let chart = Chart { says: "what", x: "x", y: "y", is_time: true, floor: Some(0.01) };
        assert!(log_log(chart, &[]).unwrap().contains("No points"));
        let series =
            Series { name: "a<b".into(), look: 0, points: vec![(3.0, 0.1), (0.0, 1.0)], joined: true };
        let svg = log_log(chart, &[series]).unwrap();
        assert!(svg.contains("currentColor") && svg.contains("a&lt;b") && !svg.contains("#000000"));
        assert_eq!(
            svg.matches("<svg class=\"wide\"").count() + svg.matches("<svg class=\"narrow\"").count(),
            2
        );
    }
}
