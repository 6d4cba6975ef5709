//! Histograms over frames, as a heat map [VanGelderen2020, fig. 6.9, fig. 6.10].

use super::{Axis, FRAME, SIZE, Svg, short, to_pixels};

/// Most columns. More frames are averaged into columns.
const COLUMNS: usize = 340;

/// Colours from zero to most; 0 is white.
const COLORS: [[f64; 3]; 5] =
    [[255.0, 255.0, 255.0], [254.0, 217.0, 118.0], [240.0, 110.0, 40.0], [165.0, 15.0, 60.0], [40.0, 0.0, 50.0]];

/// Draws bins that double (0, 1, 2 to 3, 4 to 7, …) over frames, coloured by their counts. The scale is logarithmic
/// from 1 to the largest count, at least `high`, so that several maps can share a scale.
pub fn heat_map(title: &str, x_label: &str, y_label: &str, high: f64, frames: &[&[u64]]) -> String {
    let bins = frames.iter().map(|bins| bins.len()).max().unwrap_or(0).max(1);
    let most = frames.iter().flat_map(|bins| bins.iter()).map(|count| *count as f64).fold(high.max(1.0), f64::max);
    let x = Axis::to(x_label, frames.len().max(1) as f64);
    let ticks = (0..bins).map(|bin| (bin as f64 + 0.5, name(bin))).collect();
    let y = Axis::of(y_label, [0.0, bins as f64], ticks);
    let [px, py] = to_pixels(&x, &y);
    let mut svg = Svg::new(SIZE[0], SIZE[1], title);
    svg.axes(&x, &y);
    let columns = frames.len().min(COLUMNS);
    for column in 0..columns {
        let of = |column: usize| column * frames.len() / columns;
        let (first, end) = (of(column), of(column + 1));
        for bin in 0..bins {
            let sum: u64 = frames[first..end].iter().map(|bins| bins.get(bin).unwrap_or(&0)).sum();
            if sum == 0 {
                continue;
            }
            let fraction = (1.0 + sum as f64 / (end - first) as f64).ln() / (1.0 + most).ln();
            let [left, right] = [px(first as f64), px(end as f64)];
            let [top, bottom] = [py(bin as f64 + 1.0), py(bin as f64)];
            svg.add(&format!(
                r#"<rect x="{left:.2}" y="{top:.2}" width="{:.2}" height="{:.2}" fill="{}"/>"#,
                right - left + 0.05,
                bottom - top,
                color(fraction)
            ));
        }
    }
    scale(&mut svg, most);
    svg.finish()
}

/// The colour scale.
fn scale(svg: &mut Svg, most: f64) {
    const STEPS: usize = 40;
    let [_, top, right, bottom] = FRAME;
    let height = (bottom - top) / STEPS as f64;
    for step in 0..STEPS {
        let y = bottom - height * (step + 1) as f64;
        let color = color((step as f64 + 0.5) / STEPS as f64);
        svg.add(&format!(
            r#"<rect x="{}" y="{y:.2}" width="16" height="{:.2}" fill="{color}"/>"#,
            right + 20.0,
            height + 0.05
        ));
    }
    for step in 0..=4 {
        let fraction = f64::from(step) / 4.0;
        let value = (fraction * (1.0 + most).ln()).exp_m1();
        // Three digits, more than colours can resolve.
        let digit = 10f64.powf(value.max(1.0).log10().floor() - 2.0);
        let value = (value / digit).round() * digit;
        svg.text([right + 42.0, bottom - (bottom - top) * fraction + 4.0], "start", &short(value));
    }
}

fn color(fraction: f64) -> String {
    let position = fraction.clamp(0.0, 1.0) * (COLORS.len() - 1) as f64;
    let low = (position as usize).min(COLORS.len() - 2);
    let [r, g, b] = [0, 1, 2].map(|c| {
        let (from, to) = (COLORS[low][c], COLORS[low + 1][c]);
        (from + (to - from) * (position - low as f64)).round() as u8
    });
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The least value of a bin.
fn name(bin: usize) -> String {
    short(if bin == 0 { 0.0 } else { 2f64.powi(bin as i32 - 1) })
}

#[test]
fn bins_are_coloured_by_their_counts() {
    let svg = heat_map("t", "frame", "lights", 0.0, &[&[0, 5], &[9]]);
    // The largest count is in the second frame's lowest bin. Empty bins are not drawn.
    assert!(svg.contains(r##"<rect x="315.00" y="202.50" width="245.05" height="162.50" fill="#280032"/>"##), "{svg}");
    assert_eq!(svg.matches("<rect").count(), 1 + 2 + 40, "{svg}");
    assert!(!heat_map("t", "frame", "lights", 0.0, &[]).contains("NaN"));
    assert_eq!((color(0.0).as_str(), color(2.0).as_str()), ("#ffffff", "#280032"));
    assert_eq!([0, 1, 2, 5].map(name), ["0", "1", "2", "16"]);
}
