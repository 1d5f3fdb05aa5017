//! Charts as SVG, legible on light and on dark backgrounds.

use std::ops::Range;

use plotters::{
    coord::Shift,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use super::numbers::brief;
use crate::html::escaped;

/// A line through points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    pub name: String,
    pub points: Vec<(f64, f64)>,
}

/// Size of a chart, pixels.
const SIZE: (u32, u32) = (680, 420);
/// Width reserved for the legend at the right, pixels.
const LEGEND: u32 = 190;
/// Colour that a page replaces by its text colour.
pub(super) const INK: &str = "#000000";
/// Palette for colour vision deficiency, legible on light and on dark (Okabe and Ito 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(213, 94, 0),
    RGBColor(128, 128, 128),
];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Line chart with logarithmic axes. Points that are not positive are left out.
pub(super) fn line_chart(title: &str, x_name: &str, y_name: &str, series: &[Series]) -> String {
    let positive = |s: &Series| Series {
        name: s.name.clone(),
        points: s.points.iter().copied().filter(|(x, y)| *x > 0.0 && *y > 0.0 && (x + y).is_finite()).collect(),
    };
    let series: Vec<Series> = series.iter().map(positive).filter(|s| !s.points.is_empty()).collect();
    svg(SIZE, |area| draw_lines(area, title, x_name, y_name, &series))
}

fn draw_lines(area: &Area, title: &str, x_name: &str, y_name: &str, series: &[Series]) -> Drawn {
    heading(area, title)?;
    let all = || series.iter().flat_map(|s| &s.points);
    let (Some(x), Some(y)) = (decades(all().map(|p| p.0)), decades(all().map(|p| p.1))) else {
        return note(area, "nothing to show");
    };
    let (left, right) = area.margin(34, 6, 6, 6).split_horizontally(SIZE.0 - LEGEND);
    let mut chart = ChartBuilder::on(&left)
        .x_label_area_size(46)
        .y_label_area_size(70)
        .build_cartesian_2d(x.clone().log_scale().base(base(&x)), y.clone().log_scale().base(base(&y)))?;
    let label = |value: &f64| tick(*value);
    chart
        .configure_mesh()
        .x_desc(x_name)
        .y_desc(y_name)
        .x_labels(6)
        .y_labels(6)
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .label_style(text(14))
        .axis_desc_style(text(15))
        .axis_style(BLACK)
        .bold_line_style(RGBColor(128, 128, 128).mix(0.35))
        .light_line_style(RGBColor(128, 128, 128).mix(0.12))
        .draw()?;
    for (s, color) in series.iter().zip(COLORS.iter().cycle()) {
        chart.draw_series(LineSeries::new(s.points.iter().copied(), color.stroke_width(2)))?;
        chart.draw_series(s.points.iter().map(|p| Circle::new(*p, 4, color.filled())))?;
    }
    for (i, (s, color)) in (0..).zip(series.iter().zip(COLORS.iter().cycle())) {
        let y = 12 + i * 22;
        right.draw(&PathElement::new(vec![(4, y), (24, y)], color.stroke_width(2)))?;
        right.draw(&Circle::new((14, y), 4, color.filled()))?;
        right.draw(&Text::new(s.name.clone(), (30, y), text(14).pos(Pos::new(HPos::Left, VPos::Center))))?;
    }
    Ok(())
}

/// Heat map with colours by the logarithm of the value. `values` holds rows with one entry per
/// column.
pub(super) fn heat_map(title: &str, columns: &[String], rows: &[String], values: &[Vec<Option<f64>>]) -> String {
    const CELL: (i32, i32) = (104, 52);
    const CORNER: (i32, i32) = (110, 66);
    let width = (CORNER.0 + CELL.0 * columns.len() as i32 + 10).max(8 * title.chars().count() as i32 + 20);
    let size = (width as u32, (CORNER.1 + CELL.1 * rows.len() as i32 + 10) as u32);
    svg(size, |area| {
        heading(area, title)?;
        let centred = |size: i32| text(size).pos(Pos::new(HPos::Center, VPos::Center));
        for (c, label) in (0..).zip(columns) {
            area.draw(&Text::new(label.clone(), (CORNER.0 + c * CELL.0 + CELL.0 / 2, CORNER.1 - 14), centred(15)))?;
        }
        let known = || values.iter().flatten().copied().flatten().filter(|v| *v > 0.0 && v.is_finite());
        let (low, high) = known().fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
        for (r, (label, cells)) in (0..).zip(rows.iter().zip(values)) {
            let y = CORNER.1 + r * CELL.1;
            let style = text(15).pos(Pos::new(HPos::Right, VPos::Center));
            area.draw(&Text::new(label.clone(), (CORNER.0 - 10, y + CELL.1 / 2), style))?;
            for (c, value) in (0..).zip(cells) {
                let x = CORNER.0 + c * CELL.0;
                let middle = (x + CELL.0 / 2, y + CELL.1 / 2);
                let Some(value) = value.filter(|v| *v > 0.0 && v.is_finite()) else {
                    area.draw(&Text::new("-", middle, centred(15)))?;
                    continue;
                };
                let fraction = if high > low { (value / low).ln() / (high / low).ln() } else { 0.5 };
                let (color, ink) = viridis(fraction);
                let corners = [(x, y), (x + CELL.0 - 2, y + CELL.1 - 2)];
                area.draw(&Rectangle::new(corners, color.filled()))?;
                area.draw(&Text::new(brief(value), middle, centred(15).color(&ink)))?;
            }
        }
        Ok(())
    })
}

/// Colour of the viridis scale at 0 to 1, and a text colour with contrast to it; neither is
/// [`INK`].
fn viridis(fraction: f64) -> (RGBColor, RGBColor) {
    let [r, g, b] = colorous::VIRIDIS.eval_continuous(fraction.clamp(0.0, 1.0)).as_array();
    let ink = if fraction < 0.55 { RGBColor(255, 255, 255) } else { RGBColor(1, 1, 1) };
    (RGBColor(r, g, b), ink)
}

fn svg(size: (u32, u32), draw: impl FnOnce(&Area) -> Drawn) -> String {
    let mut text = String::new();
    // Drawing into a string fails only for a chart of zero size.
    let drawn = {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw(&area).and_then(|()| area.present().map_err(Into::into))
    };
    drawn.map_or_else(|error| message(size, &format!("this chart could not be drawn: {error}")), |()| text)
}

/// Rectangle of a heat map with a line of text.
fn message((width, height): (u32, u32), line: &str) -> String {
    format!(
        r#"<svg width="{width}" height="{height}" viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg">"#
    ) + &format!(r#"<text x="8" y="20" font-family="sans-serif" font-size="15">{}</text></svg>"#, escaped(line))
}

fn heading(area: &Area, title: &str) -> Drawn {
    Ok(area.draw(&Text::new(title.to_string(), (8, 8), text(17)))?)
}

fn note(area: &Area, line: &str) -> Drawn {
    Ok(area.draw(&Text::new(line.to_string(), (8, 60), text(15)))?)
}

fn text(size: i32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&BLACK)
}

/// Range that contains all values with a margin at both ends; `None` without a value.
fn decades(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    // Minimum range, which contains two powers of two.
    let room = (high / low).powf(0.06).max(if high < 2.0 * low { 2.0 } else { 1.15 });
    (low <= high).then(|| low / room..high * room)
}

/// Tick marks at powers of ten, or of two on a short axis.
fn base(range: &Range<f64>) -> f64 {
    if range.end / range.start > 50.0 { 10.0 } else { 2.0 }
}

/// Formats a tick label.
fn tick(x: f64) -> String {
    let text = brief(x);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_hold_their_names_and_survive_odd_data() {
        let line = |points: &[(f64, f64)]| Series { name: "n = 10k".to_string(), points: points.to_vec() };
        let chart = line_chart("error", "seconds", "relMSE", &[line(&[(1.0, 0.5), (10.0, 0.05)])]);
        assert!(
            ["<svg", "error", "seconds", "relMSE", "n = 10k", "</svg>"].iter().all(|s| chart.contains(s)),
            "{chart}"
        );
        for points in [&[][..], &[(1.0, 1.0)], &[(0.0, 1.0), (1.0, f64::NAN), (-1.0, 2.0)]] {
            assert!(line_chart("t", "x", "y", &[line(points)]).contains("</svg>"));
        }
        assert!(line_chart("t", "x", "y", &[line(&[])]).contains("nothing to show"));
        assert!(!chart.contains("nothing to show"));
    }

    #[test]
    fn a_chart_that_cannot_be_drawn_says_why() {
        let chart = svg((100, 50), |_| Err("no <extent>".into()));
        assert!(chart.starts_with("<svg") && chart.contains("not be drawn: no &lt;extent&gt;<"), "{chart}");
        assert!(!svg((100, 50), |_| Ok(())).contains("not be drawn"));
    }

    #[test]
    fn a_heat_map_shows_every_value() {
        let labels = |names: [&str; 2]| names.map(str::to_string);
        let values = vec![vec![Some(0.5), Some(0.05)], vec![None, Some(0.005)]];
        let map = heat_map("relMSE", &labels(["k = 1", "k = 10"]), &labels(["n = 1k", "n = 10k"]), &values);
        assert!(["k = 10", "n = 10k", "0.500", "0.0500", "0.00500"].iter().all(|s| map.contains(s)), "{map}");
        assert!(heat_map("t", &[], &[], &[]).contains("</svg>"));
    }
}
