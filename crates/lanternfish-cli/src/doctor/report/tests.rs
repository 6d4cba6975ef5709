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
    let adapter = Adapter {
        name: "Some card".to_owned(),
        features: vec![("ray query".to_owned(), false)],
        limits: vec![("buffer".to_owned(), 5)],
        subpixel_bits: Some(8),
        techniques: vec![Technique { name: "shadows ray-query".to_owned(), reason: Some("no".to_owned()) }],
        ..Adapter::default()
    };
    let rate = Rate { name: "bvh, random rays".to_owned(), mrays_per_second: Timed { runs: vec![3.0, 1.0, 2.5] } };
    Report {
        format: FORMAT,
        complete: true,
        adapters: vec![adapter],
        checks,
        rates: vec![rate],
        not_timed: vec![("rays through ray-query".to_owned(), "the device was lost".to_owned())],
        ..Report::default()
    }
}

#[test]
fn the_table_names_failures_and_rates() {
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
        "bvh, random rays                     2.500 (1.000 to 3.000, 3 runs)",
        "rays through ray-query          left out: the device was lost",
    ] {
        assert!(table.contains(text), "{text}: {table}");
    }
    let mut sound = report(Vec::new());
    (sound.complete, sound.doing) = (false, Some("shadows: bvh".to_owned()));
    let table = sound.to_table();
    assert!(!table.contains("first failure"), "{table}");
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
