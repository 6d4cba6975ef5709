//! A report as a page: of those in `docs/measured/`, for example.

use std::fmt::Write as _;

use super::report::{Check, Report, Timed, Verdict, WATCHDOG_MS, figure};
use crate::{
    pass_costs::{PassCost, columns, dispatches},
    warm::NO_CLOCKS,
};

pub fn to_markdown(report: &Report) -> String {
    let mut text = String::new();
    let adapter = &report.adapters[report.chosen];
    let _ = writeln!(text, "# {}\n", adapter.name);
    let commit = report.commit.as_deref().unwrap_or("not stated");
    let _ = writeln!(text, "Printed by `lanternfish doctor --read FILE --page`.\n");
    table(
        &mut text,
        &["", ""],
        &[
            ["adapter".to_owned(), format!("{}, {}, through {}", adapter.name, adapter.kind, adapter.backend)],
            ["driver".to_owned(), adapter.driver.clone()],
            ["known faults".to_owned(), adapter.faults.clone().unwrap_or_else(|| "none".to_owned())],
            ["system".to_owned(), format!("{}, {} threads", report.system, report.threads)],
            ["date".to_owned(), report.date.clone()],
            ["version, commit".to_owned(), format!("{}, {commit}", report.version)],
            ["command".to_owned(), format!("`{}`", report.command)],
            ["seconds".to_owned(), format!("{:.0}", report.seconds)],
            ["tracer `auto`".to_owned(), adapter.automatic_tracer.clone()],
            [
                "vertex grid".to_owned(),
                adapter.subpixel_bits.map_or_else(|| "not stated".to_owned(), |bits| format!("{bits} bits")),
            ],
        ],
    );
    let clocks: Vec<_> = report.clocks().collect();
    if !report.repeats.is_empty() {
        let clocks = if clocks.is_empty() { NO_CLOCKS.to_owned() } else { clocks.join(" → ") };
        let _ = writeln!(
            text,
            "\nClocks, row by row: {clocks}.\n\nThe first row of each table, measured again at its end:\n"
        );
        for repeat in &report.repeats {
            let _ = writeln!(text, "- {}", repeat.text());
        }
    }
    let has = |has: bool| adapter.features.iter().filter(move |f| f.1 == has).map(|f| f.0.clone()).collect::<Vec<_>>();
    let _ = writeln!(text, "\nFeatures: {}. Missing: {}.", in_words(&has(true)), in_words(&has(false)));
    for technique in adapter.techniques.iter().filter(|technique| technique.reason.is_some()) {
        let _ = writeln!(text, "- cannot run: {}: {}", technique.name, technique.reason.as_deref().unwrap_or_default());
    }
    if !report.checks.is_empty() {
        checks(&mut text, &report.checks);
    }
    if !report.rates.is_empty() {
        text += "\n## Rates\n\n";
        let rows = report.rates.iter().map(|r| {
            let spread = format!("{:.3} to {:.3}", r.least, r.most);
            let mark = if r.differs_from(&report.rates) { " **other results**" } else { "" };
            [format!("{}{mark}", r.name), format!("{:.3} {}", r.median, r.unit), spread, r.runs.to_string()]
        });
        table(&mut text, &["what", "median", "least to most", "runs"], &rows.collect::<Vec<_>>());
    }
    if !report.walk_counts.is_empty() {
        text += "\n## Traversal\n\n";
        for count in &report.walk_counts {
            let _ = writeln!(text, "- {}", count.text());
        }
    }
    if !report.frames.is_empty() {
        frames(&mut text, report);
    }
    for (what, why) in &report.not_timed {
        let _ = writeln!(text, "\nNot timed: {what}: {why}.");
    }
    for (frame, pass, ms) in report.slow_passes() {
        let limit = WATCHDOG_MS / 1e3;
        let _ = writeln!(text, "\nOver {limit:.0} s, a display driver may stop it: `{pass}`, {ms:.0} ms ({frame}).");
    }
    if !report.complete {
        let doing = report.doing.as_deref().unwrap_or("nothing");
        let _ = writeln!(text, "\n**Incomplete**: the process ended while it did this: {doing}.");
    }
    text
}

fn checks(text: &mut String, checks: &[Check]) {
    let count = |verdict| checks.iter().filter(|check| check.verdict == verdict).count();
    let _ = writeln!(
        text,
        "\n## Checks\n\n{} passed, {} failed, {} left out. Images are compared with a path tracer on the processor.\n",
        count(Verdict::Passed),
        count(Verdict::Failed),
        count(Verdict::LeftOut)
    );
    let row = |check: &Check| {
        let verdict = match check.verdict {
            Verdict::Passed => "ok",
            Verdict::Failed => "**FAILED**",
            Verdict::LeftOut => "left out",
        };
        let figures: Vec<_> = check.figures.iter().map(figure).collect();
        let what = check.reason.clone().unwrap_or_else(|| figures.join(", "));
        [check.group.name().to_owned(), check.name.clone(), check.scene.clone(), verdict.to_owned(), what]
    };
    table(
        text,
        &["group", "check", "scene", "verdict", "figures and limits"],
        &checks.iter().map(row).collect::<Vec<_>>(),
    );
}

fn frames(text: &mut String, report: &Report) {
    *text += "\n## Frames\n\nMilliseconds on the device, all passes: the atrium, by `Renderer::render`.\n\n";
    let name = |f: &Timed| [f.name.clone(), f.lights.to_string(), format!("{} x {}", f.width, f.height)];
    let row = |f: &Timed| {
        let [what, lights, size] = name(f);
        let time = match &f.reason {
            Some(reason) => [reason.clone(), String::new(), String::new()],
            None => [
                format!("{:.2}{}", f.median_ms, if f.is_wall { " (host clock)" } else { "" }),
                format!("{:.2} to {:.2}", f.least_ms, f.most_ms),
                f.runs.to_string(),
            ],
        };
        let [median, spread, runs] = time;
        [what, lights, size, median, spread, runs]
    };
    let rows: Vec<_> = report.frames.iter().map(row).collect();
    table(text, &["frame", "lights", "size", "median", "least to most", "runs"], &rows);
    *text += "\n## The ten slowest passes of each frame\n";
    for frame in report.frames.iter().filter(|frame| !frame.passes.is_empty()) {
        let [what, lights, size] = name(frame);
        let _ = writeln!(text, "\n{what}, {lights} lights, {size}:\n");
        let mut passes = frame.passes.clone();
        passes.sort_by(|a, b| b.1.total_cmp(&a.1));
        let fraction = |ms: f64| format!("{:.1} %", 100.0 * ms / frame.median_ms.max(1e-9));
        let rows = passes.iter().take(10).map(|(name, ms)| [format!("`{name}`"), format!("{ms:.3}"), fraction(*ms)]);
        if frame.costs.is_empty() {
            table(text, &["pass", "ms", "fraction"], &rows.collect::<Vec<_>>());
            continue;
        }
        let cost_of = |name: &str| frame.costs.iter().find(|cost: &&PassCost| cost.name == name);
        let with_costs = rows.zip(&passes).map(|([name, ms, fraction], (label, time))| {
            let [dispatched, rays, rate] = columns(cost_of(label), *time);
            [name, ms, fraction, dispatched, rays, rate]
        });
        let mut rows: Vec<_> = with_costs.collect();
        let mut sum = |what: &str, ms: f64, dispatched: String| {
            let (none, ms_text) = (String::new(), format!("{ms:.3}"));
            rows.push([what.to_owned(), ms_text, fraction(ms), dispatched, none.clone(), none]);
        };
        sum("all passes", passes.iter().map(|(_, ms)| ms).sum(), dispatches(frame.costs.iter()));
        sum("idle: the host's frame, image read back, without its passes", frame.idle_ms(), String::new());
        table(text, &["pass", "ms", "fraction", "dispatches", "rays", "Mrays/s"], &rows);
        let _ = writeln!(text, "\n{}.", frame.extent());
    }
}

fn in_words(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn table<const N: usize>(text: &mut String, head: &[&str; N], rows: &[[String; N]]) {
    let row = |cells: &[String]| {
        format!("| {} |", cells.iter().map(|c| c.replace('|', "\\|")).collect::<Vec<_>>().join(" | "))
    };
    let _ = writeln!(text, "{}", row(&head.map(str::to_owned)));
    let _ = writeln!(text, "|{}", "---|".repeat(N));
    for cells in rows {
        let _ = writeln!(text, "{}", row(cells));
    }
}

#[cfg(test)]
mod tests {
    use std::{
        fs,
        path::{Path, PathBuf},
    };

    use super::{super::read, *};

    /// Every stored report of the doctor has a page, with every check, rate and frame.
    #[test]
    fn stored_reports_have_complete_pages() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/measured");
        let files = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        let is_doctors = |file: &PathBuf| fs::read_to_string(file).is_ok_and(|text| text.contains("\"adapters\": ["));
        let reports: Vec<_> = files.filter(is_doctors).collect();
        assert!(reports.len() >= 2, "{} has no report", folder.display());
        for report in reports.iter().map(|file| read(file).unwrap()) {
            let page = to_markdown(&report);
            let names = report.checks.iter().map(|check| &check.name).chain(report.rates.iter().map(|rate| &rate.name));
            for name in names.chain(report.frames.iter().map(|frame| &frame.name)) {
                assert!(page.contains(name.as_str()), "{name} is not in\n{page}");
            }
        }
    }
}
