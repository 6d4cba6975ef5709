//! Plots as SVG: curves over two axes, stacked bars, stacked areas, heat maps.

mod areas;
mod heat;

pub use self::{
    areas::{Area, stacked},
    heat::heat_map,
};

use std::fmt::Write;

/// One axis of [`curves`].
pub struct Axis<'a> {
    /// Its label.
    pub label: &'a str,
    /// Range of values, low < high; above 0 if logarithmic.
    pub ends: [f64; 2],
    /// True for a logarithmic scale.
    pub logarithmic: bool,
    /// Values of grid lines, and their labels.
    pub ticks: Vec<(f64, String)>,
}

impl<'a> Axis<'a> {
    /// A linear axis with these ticks.
    pub fn of(label: &'a str, ends: [f64; 2], ticks: Vec<(f64, String)>) -> Self {
        Self { label, ends, logarithmic: false, ticks }
    }

    /// An axis from 0 to exactly `last`.
    pub fn to(label: &'a str, last: f64) -> Self {
        let mut axis = Self::linear(label, last);
        axis.ends[1] = last;
        axis.ticks.retain(|(value, _)| *value <= last);
        axis
    }

    /// An axis from 0 to at least `high`, with about five ticks at round numbers.
    pub fn linear(label: &'a str, high: f64) -> Self {
        let high = if high.is_finite() && high > 0.0 { high } else { 1.0 };
        let decade = 10f64.powf((high / 5.0).log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|k| k * decade).into_iter().find(|step| high / step <= 5.0);
        let step = step.unwrap_or(high);
        let count = (high / step).ceil() as u32;
        let ticks = (0..=count).map(|i| (f64::from(i) * step, short(f64::from(i) * step))).collect();
        Self::of(label, [0.0, f64::from(count) * step], ticks)
    }

    /// Position along the axis, 0 to 1; clamped to the ends.
    fn fraction(&self, value: f64) -> f64 {
        let scale = |v: f64| if self.logarithmic { v.max(f64::MIN_POSITIVE).ln() } else { v };
        let [low, high] = self.ends.map(scale);
        ((scale(value) - low) / (high - low)).clamp(0.0, 1.0)
    }
}

/// A curve of [`curves`].
pub struct Curve {
    /// Name in the legend; empty: it is left out there.
    pub name: String,
    /// CSS colour.
    pub color: &'static str,
    /// True for a dashed line.
    pub dashed: bool,
    /// True to mark every point.
    pub marked: bool,
    /// Points, in the axes' units.
    pub points: Vec<(f64, f64)>,
}

/// Size of a plot, and the frame of its curves (left, top, right, bottom), pixels.
const SIZE: [f64; 2] = [760.0, 420.0];
const FRAME: [f64; 4] = [70.0, 40.0, 560.0, 365.0];

/// Draws curves over two axes, with a legend.
pub fn curves(title: &str, x: &Axis<'_>, y: &Axis<'_>, curves: &[Curve]) -> String {
    let [_, top, right, _] = FRAME;
    let [px, py] = to_pixels(x, y);
    let mut svg = Svg::new(SIZE[0], SIZE[1], title);
    svg.axes(x, y);
    let mut row = top + 10.0;
    for curve in curves {
        let at = |(a, b): &(f64, f64)| format!("{:.2} {:.2}", px(*a), py(*b));
        let path = curve.points.iter().map(at).collect::<Vec<_>>().join("L");
        let dashes = if curve.dashed { r#" stroke-dasharray="6 5""# } else { "" };
        let stroke = format!(r#"stroke="{}" stroke-width="2"{dashes}"#, curve.color);
        if !curve.points.is_empty() {
            svg.add(&format!(r#"<path d="M{path}" fill="none" {stroke}/>"#));
        }
        for (a, b) in curve.points.iter().filter(|_| curve.marked) {
            svg.add(&format!(r#"<circle cx="{:.2}" cy="{:.2}" r="3" fill="{}"/>"#, px(*a), py(*b), curve.color));
        }
        if !curve.name.is_empty() {
            svg.add(&format!(r#"<path d="M{} {row}h28" {stroke}/>"#, right + 14.0));
            svg.text([right + 50.0, row + 4.0], "start", &curve.name);
            row += 20.0;
        }
    }
    svg.finish()
}

/// Draws one bar per row: its name and the lengths of its parts, in the order of `parts`, which holds names and
/// colours.
pub fn bars(title: &str, unit: &str, parts: &[(&str, &'static str)], rows: &[(String, Vec<f64>)]) -> String {
    const ROW: f64 = 24.0;
    let (left, top, width) = (150.0, 40.0, 410.0);
    let most = rows.iter().map(|(_, values)| values.iter().sum::<f64>()).fold(1e-9, f64::max);
    let height = (ROW * rows.len() as f64).max(20.0 * parts.len() as f64);
    let mut svg = Svg::new(SIZE[0], top + height + 40.0, title);
    for (i, (name, values)) in rows.iter().enumerate() {
        let y = top + ROW * i as f64;
        svg.text([left - 8.0, y + 15.0], "end", name);
        let mut x = left;
        for (value, (_, color)) in values.iter().zip(parts) {
            let long = width * value / most;
            svg.add(&format!(
                r#"<rect x="{x:.2}" y="{y:.2}" width="{long:.2}" height="{}" fill="{color}"/>"#,
                ROW - 6.0
            ));
            x += long;
        }
        let sum: f64 = values.iter().sum();
        svg.text([x + 5.0, y + 14.0], "start", &format!("{sum:.0}"));
    }
    svg.text([left, top + height + 22.0], "start", unit);
    for (i, (name, color)) in parts.iter().enumerate() {
        let y = top + 20.0 * i as f64;
        svg.add(&format!(r#"<rect x="640" y="{y}" width="14" height="14" fill="{color}"/>"#));
        svg.text([660.0, y + 12.0], "start", name);
    }
    svg.finish()
}

/// Functions from axis values to pixels.
fn to_pixels<'p>(x: &'p Axis<'_>, y: &'p Axis<'_>) -> [Box<dyn Fn(f64) -> f64 + 'p>; 2] {
    let [left, top, right, bottom] = FRAME;
    [
        Box::new(move |v| left + (right - left) * x.fraction(v)),
        Box::new(move |v| bottom - (bottom - top) * y.fraction(v)),
    ]
}

/// Formats a number with few characters: 1,500,000 is 1.5M.
fn short(value: f64) -> String {
    let (scaled, unit) = match value.abs() {
        v if v >= 1e9 => (value / 1e9, "G"),
        v if v >= 1e6 => (value / 1e6, "M"),
        v if v >= 1e4 => (value / 1e3, "k"),
        _ => (value, ""),
    };
    format!("{}{unit}", (scaled * 1e4).round() / 1e4)
}

struct Svg(String);

impl Svg {
    fn new(width: f64, height: f64, title: &str) -> Self {
        let mut svg = Self(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n"
        ));
        svg.add(r#"<rect width="100%" height="100%" fill="white"/>"#);
        svg.add(&format!(r#"<text x="20" y="22" font-size="14">{}</text>"#, escaped(title)));
        svg
    }

    /// Draws both axes with their ticks and labels.
    fn axes(&mut self, x: &Axis<'_>, y: &Axis<'_>) {
        let [left, top, right, bottom] = FRAME;
        let [px, py] = to_pixels(x, y);
        for (value, name) in &x.ticks {
            self.line([px(*value), top, px(*value), bottom], "#ddd", 1.0);
            self.text([px(*value), bottom + 16.0], "middle", name);
        }
        for (value, name) in &y.ticks {
            self.line([left, py(*value), right, py(*value)], "#ddd", 1.0);
            self.text([left - 6.0, py(*value) + 4.0], "end", name);
        }
        self.add(&format!(r##"<path d="M{left} {top}V{bottom}H{right}" fill="none" stroke="#444"/>"##));
        self.text([0.5 * (left + right), bottom + 36.0], "middle", x.label);
        let middle = 0.5 * (top + bottom);
        self.add(&format!(
            r#"<text transform="translate(16 {middle})rotate(-90)" text-anchor="middle">{}</text>"#,
            escaped(y.label)
        ));
    }

    fn add(&mut self, element: &str) {
        writeln!(self.0, "{element}").expect("String");
    }

    fn line(&mut self, [x0, y0, x1, y1]: [f64; 4], color: &str, width: f64) {
        self.add(&format!(r#"<path d="M{x0:.2} {y0:.2}L{x1:.2} {y1:.2}" stroke="{color}" stroke-width="{width}"/>"#));
    }

    fn text(&mut self, [x, y]: [f64; 2], anchor: &str, text: &str) {
        self.add(&format!(r#"<text x="{x:.2}" y="{y:.2}" text-anchor="{anchor}">{}</text>"#, escaped(text)));
    }

    fn finish(mut self) -> String {
        self.0 += "</svg>\n";
        self.0
    }
}

/// Escapes text for XML and HTML.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_at_round_numbers() {
        let names = |high| Axis::linear("", high).ticks.into_iter().map(|(_, name)| name).collect::<Vec<_>>().join(" ");
        assert_eq!(names(4.2), "0 1 2 3 4 5");
        assert_eq!(names(0.9), "0 0.2 0.4 0.6 0.8 1");
        assert_eq!(names(2_300_000.0), "0 500k 1M 1.5M 2M 2.5M");
        assert_eq!(names(0.0), "0 0.2 0.4 0.6 0.8 1");
        assert_eq!(names(680.0), "0 200 400 600 800");
    }

    #[test]
    fn points_follow_the_axes() {
        let axis = |ends, logarithmic| Axis { label: "a < b", ends, logarithmic, ticks: vec![] };
        let (x, y) = (axis([1.0, 100.0], true), axis([0.0, 4.0], false));
        let curve = Curve {
            name: "c".to_owned(),
            color: "red",
            dashed: true,
            marked: true,
            points: vec![(10.0, 1.0), (1000.0, 4.0)],
        };
        let svg = curves("t", &x, &y, &[curve]);
        // First point at half of the width and a quarter of the height. The second lies beyond the axes and is clamped
        // to a corner.
        assert!(svg.contains("M315.00 283.75L560.00 40.00") && svg.contains("a &lt; b"), "{svg}");
        let rows = [("r".to_owned(), vec![1.0, 3.0])];
        let svg = bars("t", "ms", &[("one", "red"), ("two", "blue")], &rows);
        assert!(svg.contains(r#"width="102.50""#) && svg.contains(r#"x="252.50""#) && svg.contains(">4<"), "{svg}");
    }
}
