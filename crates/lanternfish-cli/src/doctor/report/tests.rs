use super::*;

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
            counters: Vec::new(),
            reason: None,
        }],
        not_timed: Vec::new(),
    }
}

#[test]
fn the_table_names_the_first_failure() {
    let failing = report(vec![
        check(Group::Materials, Verdict::Passed),
        check(Group::LightCulling, Verdict::Failed),
        check(Group::Shadows, Verdict::Failed),
    ]);
    let table = failing.to_table();
    assert!(table.contains("first failure: light culling, clustered (atrium, 100 lights)"), "{table}");
    assert!(table.contains("1 checks passed, 2 failed, 0 left out"), "{table}");
    assert!(table.contains("OUT OF LIMITS"), "{table}");
    assert!(!report(Vec::new()).to_table().contains("first failure"));
}

#[test]
fn the_table_names_passes_over_the_watchdog_limit() {
    let report = report(Vec::new());
    assert_eq!(report.slow_passes(), [("direct light", "shadows/trace", 2400.0)]);
    assert!(report.to_table().contains("a display driver may stop it: shadows/trace"));
}

#[test]
fn reports_survive_a_round_trip_through_json() {
    let mut odd = check(Group::Shadows, Verdict::Failed);
    odd.figures.push(Figure::new("energy", f64::NAN, 0.9, 1.1));
    let report = report(vec![check(Group::Shadows, Verdict::LeftOut), odd]);
    let again: Report = serde_json::from_str(&report.to_json()).unwrap();
    assert_eq!(again.to_table(), report.to_table());
}

#[test]
fn an_incomplete_report_names_the_step_in_progress() {
    let mut report = report(Vec::new());
    (report.complete, report.doing) = (false, Some("shadows: bvh".to_owned()));
    assert!(report.to_table().contains("INCOMPLETE: the process ended while it did this: shadows: bvh"));
}

#[test]
fn nan_is_outside_all_limits() {
    assert!(!Figure::new("energy", f64::NAN, 0.0, f64::INFINITY).passes());
    assert!(Figure::new("energy", 1.0, 1.0, 1.0).passes());
}
