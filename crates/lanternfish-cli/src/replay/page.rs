//! The results of a replay as a self-contained HTML page, and as a short summary.

use std::fmt::Write as _;

use super::{category::Category, report::ALL_PASSES, report::Report, series::Estimate};
use crate::{
    document::Document,
    pass_costs::{columns, dispatches},
    plot::{Area, Axis, Curve, curves, heat_map, stacked},
    report::grouped,
    table::Row,
    timed::median_ranks,
    warm::NO_CLOCKS,
};

/// The page.
pub(crate) fn html(report: &Report) -> String {
    let mut page = Document::titled(&format!("Replay of {}", report.source), Row::default());
    page.paragraph(conditions(report));
    page.heading("Times");
    page.paragraph(times(report));
    time_plots(report).into_iter().for_each(|plot| page.html(plot));
    page.show(rows(report));
    page.paragraph(extent(report));
    page.heading("Counts");
    page.paragraph("From one run that was not timed; they are exact.");
    count_plots(report).into_iter().for_each(|plot| page.html(plot));
    page.heading("Settings");
    page.show(
        report.settings.iter().map(|(name, value)| Row::default().text("", "name", name).text("", "value", value)),
    );
    page.to_html()
}

/// A short summary for the terminal.
pub(crate) fn summary(report: &Report) -> String {
    let mut text = conditions(report) + "\n";
    let all = [ALL_PASSES, "host/frame"].into_iter().filter_map(|name| Some((name, report.estimates.get(name)?)));
    for (name, estimate) in all {
        writeln!(text, "{name}: {} ms per frame", formatted(estimate)).expect("String");
    }
    if let Some(idle) = report.idle_ms() {
        writeln!(text, "idle: {idle:.3} ms per frame").expect("String");
    }
    text + &extent(report)
}

/// Dispatches and memory, if they were measured.
fn extent(report: &Report) -> String {
    let Some((frame, device)) = report.memory else { return String::new() };
    let mib = |bytes: u64| format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20));
    let (dispatches, device) = (dispatches(report.costs.iter()), device.map_or_else(|| "unknown".to_owned(), mib));
    let clocks = if report.clocks.is_empty() { NO_CLOCKS.to_owned() } else { report.clocks.join(" → ") };
    let memory = format!("memory of frames {}, of the device {device}", mib(frame));
    format!("{dispatches} dispatches in the last frame; {memory}; clocks run by run: {clocks}\n")
}

fn conditions(report: &Report) -> String {
    let Report { scene, width, height, lights, runs, adapter, driver, version, moments, .. } = report;
    let eyes = if report.eyes == 2 { "two eyes of " } else { "" };
    let runs = if *runs == 1 { "1 run".to_owned() } else { format!("{runs} runs") };
    format!(
        "{scene}, {} lights, {} frames of {eyes}{width} x {height}, {runs}. {adapter} on {driver}, Lanternfish {version}.",
        grouped(*lights as u64),
        moments.len()
    )
}

/// Explains the times.
fn times(report: &Report) -> String {
    let (_, _, level) = median_ranks(report.runs);
    format!(
        "Plots show the least of all runs, pass by pass and frame by frame: what a frame takes where nothing disturbs it. In the table, ms is \
         the median over runs of the mean over frames. The median of all possible runs lies between low and high, there and in passes.csv, \
         with a probability of {:.1} %.",
        100.0 * level
    )
}

fn formatted(estimate: &Estimate) -> String {
    match estimate.interval {
        Some([low, high]) => format!("{:.3} ({low:.3} to {high:.3})", estimate.ms),
        None => format!("{:.3}", estimate.ms),
    }
}

/// The sum of the least times of all passes of a category, per frame; `None` if none of them ran.
pub fn least_of(report: &Report, wanted: impl Fn(Category) -> bool) -> Option<Vec<f64>> {
    let mut sums: Option<Vec<f64>> = None;
    for series in report.passes.iter().filter(|series| wanted(series.category)) {
        let least = series.least();
        match &mut sums {
            Some(sums) => sums.iter_mut().zip(least).for_each(|(sum, ms)| *sum += ms),
            None => sums = Some(least),
        }
    }
    sums
}

/// Areas of the selected categories that ran.
pub fn areas(report: &Report, wanted: impl Fn(Category) -> bool) -> Vec<Area> {
    let of = |(category, name, color): (Category, &str, &'static str)| {
        let heights = least_of(report, |other| other == category)?;
        Some(Area { name: name.to_owned(), color, heights })
    };
    Category::OF_PASSES.into_iter().filter(|(category, ..)| wanted(*category)).filter_map(of).collect()
}

fn time_plots(report: &Report) -> Vec<String> {
    let mut plots = Vec::new();
    if !report.passes.is_empty() {
        plots.push(stacked("Times of a frame, by category", "frame", "ms", 0.0, &areas(report, |_| true)));
        let of_clustering = areas(report, Category::is_clustering);
        plots.push(stacked("Times of light culling, by category", "frame", "ms", 0.0, &of_clustering));
    }
    let host = [("host/frame", "#444444"), ("host/record", "#0072b2"), ("host/update", "#d55e00")];
    let of_host = host.into_iter().filter_map(|(name, color)| {
        let series = report.host.iter().find(|series| series.name == name)?;
        Some((name.to_owned(), color, series.least()))
    });
    plots.push(over_frames("Times of the host", "ms", of_host.collect()));
    plots
}

/// Curves over frames: names, colours, values.
pub fn over_frames(title: &str, label: &str, of: Vec<(String, &'static str, Vec<f64>)>) -> String {
    let frames = of.iter().map(|(.., values)| values.len()).max().unwrap_or(0).saturating_sub(1).max(1) as f64;
    let high = of.iter().flat_map(|(.., values)| values).copied().fold(0.0, f64::max);
    let x = Axis::to("frame", frames);
    let curve = |(name, color, values): (String, &'static str, Vec<f64>)| Curve {
        name,
        color,
        dashed: false,
        marked: values.len() == 1,
        points: values.into_iter().enumerate().map(|(i, value)| (i as f64, value)).collect(),
    };
    curves(title, &x, &Axis::linear(label, high), &of.into_iter().map(curve).collect::<Vec<_>>())
}

/// Plots of the clusters' statistics; for other light culling, of the listed lights.
fn count_plots(report: &Report) -> Vec<String> {
    let clusters: Option<Vec<_>> = report.frames.iter().map(|frame| frame.clusters.as_ref()).collect();
    let Some(clusters) = clusters.filter(|clusters| !clusters.is_empty()) else {
        let listed = |name: &str| -> Vec<f64> {
            report.frames.iter().map(|frame| frame.counters.get(name).copied().unwrap_or(0) as f64).collect()
        };
        let curve = ("lights listed".to_owned(), "#0072b2", listed("light_culling/listed_lights"));
        return vec![over_frames("Lights in all lists", "lights", vec![curve])];
    };
    let values = |of: fn(&super::counted::Clusters) -> u64| clusters.iter().map(|c| of(c) as f64).collect::<Vec<f64>>();
    let bins = |of: fn(&super::counted::Clusters) -> &Vec<u64>| clusters.iter().map(|c| of(c).as_slice()).collect();
    let map = |title: &str, y: &str, frames: Vec<&[u64]>| heat_map(title, "frame", y, 0.0, &frames);
    vec![
        over_frames("Visible clusters", "clusters", vec![("visible".to_owned(), "#0072b2", values(|c| c.visible))]),
        over_frames(
            "Lighting operations: length of its cluster's light list, summed over all pixels",
            "operations",
            vec![("operations".to_owned(), "#009e73", values(|c| c.lighting_operations))],
        ),
        map("Visible clusters by the length of their light list", "lights, from", bins(|c| &c.by_lights)),
        map("Visible clusters by their pixels", "pixels, from", bins(|c| &c.by_fragments)),
        map("Pixels by the length of their cluster's light list", "lights, from", bins(|c| &c.fragments_by_lights)),
    ]
}

/// The times, pass by pass.
fn rows(report: &Report) -> Vec<Row> {
    let row = |name: &str, category: &str, ms: f64, interval: String, [dispatched, rays, rate]: [String; 3]| {
        let row = Row::default().text("", "pass", name).text("", "category", category).fixed("", "ms per frame", 3, ms);
        row.shown("low to high", interval).shown("dispatches", dispatched).shown("rays", rays).shown("Mrays/s", rate)
    };
    let all = report.all_passes();
    let series = report.passes.iter().chain(&all).chain(&report.host);
    let of_series = series.filter_map(|series| {
        let Estimate { ms, interval } = *report.estimates.get(&series.name)?;
        let interval = interval.map(|[low, high]| format!("{low:.3} to {high:.3}")).unwrap_or_default();
        let category = if series.name == ALL_PASSES { "" } else { series.category.name() };
        let cost = report.costs.iter().find(|cost| cost.name == series.name);
        Some(row(&series.name, category, ms, interval, columns(cost, ms)))
    });
    let idle =
        report.idle_ms().map(|ms| row("idle: host/frame without passes", "", ms, String::new(), columns(None, ms)));
    of_series.chain(idle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::report::tests::report;

    #[test]
    fn the_page_is_self_contained_and_complete() {
        let mut report = report(vec![vec![1.0, 2.0, 1.0]; 3], vec![vec![3.0, 4.0, 3.0]; 3]);
        report.source = "a<b>.toml".to_owned();
        let page = html(&report);
        for outside in ["http-equiv", "src=", "href=", "<script", "url(", "@import"] {
            assert!(!page.contains(outside), "{outside}");
        }
        assert!(page.contains("a&lt;b&gt;.toml") && !page.contains("NaN"));
        assert_eq!((page.matches("<svg").count(), page.matches("</svg>").count()), (8, 8));
        let cost = "<td>3 (1 indirect)<td>2,000<td>";
        let memory = "3 (1 indirect) dispatches in the last frame; memory of frames 3 MiB, of the device 5 MiB; clocks run by run: 1980 MHz";
        for word in ["shading/forward", "Visible clusters", "Lighting operations", cost, memory] {
            assert!(page.contains(word), "{word}");
        }
        assert!(page.contains("75.0 %"), "three runs hold the median at 75 %");
        report.frames.iter_mut().for_each(|frame| frame.clusters = None);
        assert!(html(&report).contains("Lights in all lists"));
    }

    #[test]
    fn a_page_with_host_times_only_is_complete() {
        let mut report = report(vec![vec![1.0]; 1], vec![vec![3.0]; 1]);
        (report.passes, report.host) = (Vec::new(), report.passes);
        report.host[0].name = "host/frame".to_owned();
        report.estimate();
        let page = html(&report);
        assert!(page.ends_with("</html>\n") && !page.contains("NaN") && !page.contains("inf"), "{page}");
        assert!(summary(&report).contains("host/frame: 1.000 ms per frame"), "{}", summary(&report));
    }
}
