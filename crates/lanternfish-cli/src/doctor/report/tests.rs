use super::*;
use crate::pass_costs::PassCost;

fn check(group: Group, verdict: Verdict) -> Check {
    Check {
        group,
        name: "clustered".to_owned(),
        scene: "atrium, 100 lights".to_owned(),
        verdict,
        figures: vec![Figure::new("pixels that differ", 3.0, 0.0, 0.0)],
        reason: None,
        seconds: 1.0,
    }
}

pub fn report(checks: Vec<Check>) -> Report {
    Report {
        format: FORMAT,
        version: "0.1.0".to_owned(),
        commit: None,
        date: "2026-01-31".to_owned(),
        command: "lanternfish doctor".to_owned(),
        system: "linux x86_64".to_owned(),
        threads: 2,
        complete: true,
        doing: None,
        begun: 0,
        seconds: 3.0,
        adapters: vec![Adapter {
            name: "Some card".to_owned(),
            kind: "DiscreteGpu".to_owned(),
            backend: "vulkan".to_owned(),
            driver: "1.2".to_owned(),
            faults: None,
            automatic_tracer: "bvh".to_owned(),
            features: vec![("ray query".to_owned(), false)],
            limits: vec![("buffer".to_owned(), 5)],
            subpixel_bits: Some(8),
            techniques: vec![Technique { name: "shadows ray-query".to_owned(), reason: Some("no".to_owned()) }],
        }],
        chosen: 0,
        checks,
        rates: Vec::new(),
        frames: vec![Timed {
            name: "direct light".to_owned(),
            width: 8,
            height: 4,
            lights: 10,
            runs: 3,
            median_ms: 2500.0,
            least_ms: 1.0,
            most_ms: 3000.0,
            is_wall: false,
            passes: vec![("shadows/trace".to_owned(), 2400.0), ("prepass".to_owned(), 100.0)],
            over_watchdog: vec![("shadows/trace".to_owned(), 2400.0)],
            wall_ms: 2600.0,
            costs: vec![PassCost { name: "shadows/trace".to_owned(), dispatches: 3, indirect: 1, rays: Some(4800) }],
            memory: Some((3 << 20, None)),
            clocks: Some("1980 MHz".to_owned()),
            counters: Vec::new(),
            reason: None,
        }],
        not_timed: Vec::new(),
        walk_counts: Vec::new(),
        repeats: vec![Repeat::new("direct light".to_owned(), 2500.0, 2640.0)],
    }
}

#[test]
fn the_table_names_failures_slow_passes_and_rows_that_are_not_repeated() {
    let failing = report(vec![
        check(Group::Materials, Verdict::Passed),
        check(Group::LightCulling, Verdict::Failed),
        check(Group::Shadows, Verdict::Failed),
    ]);
    let table = failing.to_table();
    for text in [
        "first failure: light culling, clustered (atrium, 100 lights)",
        "1 checks passed, 2 failed, 0 left out",
        "OUT OF LIMITS",
        "a display driver may stop it: shadows/trace",
        "measured again: direct light: 2500.00 first, 2640.00 last, +5.6 % NOT STEADY",
        "3 (1 indirect) dispatches, memory of frames 3 MiB, of the device unknown",
        "clocks: 1980 MHz\n",
    ] {
        assert!(table.contains(text), "{text}: {table}");
    }
    assert!(failing.to_json().contains("\"is_steady\": false"));
    assert_eq!(failing.slow_passes(), [("direct light", "shadows/trace", 2400.0)]);
    let mut sound = report(Vec::new());
    sound.repeats = vec![Repeat::new("direct light".to_owned(), 2500.0, 2510.0)];
    (sound.complete, sound.doing) = (false, Some("shadows: bvh".to_owned()));
    let table = sound.to_table();
    assert!(!table.contains("first failure") && !table.contains("NOT STEADY"), "{table}");
    assert!(table.contains("INCOMPLETE: the process ended while it did this: shadows: bvh"), "{table}");
}

#[test]
fn reports_survive_a_round_trip_through_json() {
    let mut odd = check(Group::Shadows, Verdict::Failed);
    odd.figures.push(Figure::new("energy", f64::NAN, 0.9, 1.1));
    let report = report(vec![check(Group::Shadows, Verdict::LeftOut), odd]);
    let again: Report = serde_json::from_str(&report.to_json()).unwrap();
    assert_eq!(again.to_table(), report.to_table());
    assert!(!Figure::new("energy", f64::NAN, 0.0, f64::INFINITY).passes(), "NaN is outside all limits");
    assert!(Figure::new("energy", 1.0, 1.0, 1.0).passes());
}

#[test]
fn rates_with_other_results_are_marked() {
    let rate = |name: &str, result: Option<&str>| Rate {
        name: name.to_owned(),
        unit: "Mrays/s".to_owned(),
        median: 1.0,
        least: 1.0,
        most: 1.0,
        runs: 3,
        clocks: None,
        result: result.map(str::to_owned),
    };
    let mut report = report(Vec::new());
    let rows = [("a: base", "1"), ("b: base", "2"), ("a: other", "1"), ("b: other", "3")];
    report.rates = rows.map(|(name, result)| rate(name, Some(result))).into();
    report.rates.push(rate("sort", None));
    let marked: Vec<_> = report.rates.iter().map(|rate| rate.differs_from(&report.rates)).collect();
    assert_eq!(marked, [false, false, false, true, false]);
    assert_eq!(report.to_table().matches("OTHER RESULTS").count(), 1);
}
