//! Stacked area plots.

use std::fmt::Write;

use super::{Axis, FRAME, SIZE, Svg, to_pixels};

/// One area of the plot.
#[derive(Clone, Debug)]
pub struct Area {
    /// Name in the legend.
    pub name: String,
    /// CSS colour.
    pub color: &'static str,
    /// Heights at x = 0, 1, 2 and so on.
    pub heights: Vec<f64>,
}

/// Stacks areas over frames, the first at the bottom. `high` is the least top of the axis, so that several plots can
/// share one; 0 derives it from the data.
pub fn stacked(title: &str, x_label: &str, y_label: &str, high: f64, areas: &[Area]) -> String {
    let count = areas.iter().map(|area| area.heights.len()).max().unwrap_or(0);
    let sum = |i: usize| areas.iter().map(|area| area.heights.get(i).unwrap_or(&0.0)).sum::<f64>();
    let high = (0..count).map(sum).fold(high, f64::max);
    let x = Axis::to(x_label, count.saturating_sub(1).max(1) as f64);
    let y = Axis::linear(y_label, high);
    let [px, py] = to_pixels(&x, &y);
    let mut svg = Svg::new(SIZE[0], SIZE[1], title);
    // A single frame spans the width of the plot.
    let at = |i: usize| if count == 1 && i == 1 { 0 } else { i };
    let points = if count == 1 { 2 } else { count };
    let mut below = vec![0.0; points];
    for area in areas {
        let above: Vec<f64> = (0..points).map(|i| below[i] + area.heights.get(at(i)).unwrap_or(&0.0)).collect();
        let mut path = String::new();
        let there = above.iter().enumerate();
        let back = below.iter().enumerate().rev();
        for (i, height) in there.chain(back) {
            let step = if path.is_empty() { 'M' } else { 'L' };
            write!(path, "{step}{:.2} {:.2}", px(i as f64), py(*height)).expect("String");
        }
        if !path.is_empty() {
            svg.add(&format!(r#"<path d="{path}Z" fill="{}"/>"#, area.color));
        }
        below = above;
    }
    svg.axes(&x, &y);
    // Legend from top to bottom, in stacking order.
    let [_, top, right, _] = FRAME;
    for (row, area) in areas.iter().rev().enumerate() {
        let y = top + 20.0 * row as f64;
        svg.add(&format!(r#"<rect x="{}" y="{y}" width="14" height="14" fill="{}"/>"#, right + 14.0, area.color));
        svg.text([right + 34.0, y + 12.0], "start", &area.name);
    }
    svg.finish()
}

#[test]
fn areas_lie_on_each_other() {
    let area = |heights: &[f64]| Area { name: "a".to_owned(), color: "red", heights: heights.to_vec() };
    let svg = stacked("t", "frame", "ms", 0.0, &[area(&[1.0, 2.0]), area(&[1.0, 2.0])]);
    // The axis ends at 4 ms. The top edge of the second area rises from half of the height to all of it.
    assert!(svg.contains(r#"d="M70.00 283.75L560.00 202.50L560.00 365.00L70.00 365.00Z""#), "{svg}");
    assert!(svg.contains(r#"d="M70.00 202.50L560.00 40.00L560.00 202.50L70.00 283.75Z""#), "{svg}");
    assert!(!stacked("t", "frame", "ms", 0.0, &[area(&[3.0])]).contains("NaN"));
    assert!(!stacked("t", "frame", "ms", 0.0, &[]).contains("NaN"));
}
