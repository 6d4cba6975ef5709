//! The page from small fixed reports, without an adapter; and the parts' arguments.

use clap::Parser;
use serde_json::{Value, json};

use super::{claims::Judged, *};
use crate::Cli;

/// Words of every claim that the page must have, by paper.
const CLAIMS: [(Paper, &[&str]); 5] = [
    (
        Paper::Elagabani,
        &[
            "all optimisations shorten",
            "light culling alone",
            "light culling with the AABB test",
            "facing alone",
            "shadow rays take most",
            "quadruples the memory",
            "error of naive normals",
            "error of improved normals",
        ],
    ),
    (
        Paper::VanGelderen,
        &[
            "halves the visible clusters",
            "shortens clustering",
            "fewer lighting operations",
            "steadiest",
            "at most 64² fragments",
            "linear in their number",
        ],
    ),
    (
        Paper::Niessner,
        &[
            "number of triangles",
            "diffuse rays through images of 128²",
            "diffuse rays through images of 512²",
            "glossy rays through images of 128²",
            "glossy rays through images of 512²",
            "soft shadows rays through images of 128²",
            "soft shadows rays through images of 512²",
            "antialiasing",
            "96, 150 and 384",
            "15 to 60 MB",
            "are built in 23 s",
        ],
    ),
    (
        Paper::Aalund,
        &[
            "is tracing",
            "maps of 50² instead of 200²",
            "HBAO slows down",
            "fig. 10 (a)",
            "fig. 10 (c)",
            "512 maps of 50², building",
        ],
    ),
    (
        Paper::Archer,
        &[
            "22 to 104 times",
            "at most 10 % slower",
            "1 % of the frame",
            "1.25 thousand million",
            "similar to one bounce",
            "all steps, Atrium",
            "all steps, Rungholt",
            "many directions",
            "ten times as long as random",
        ],
    ),
];

fn machine() -> Machine {
    Machine { adapter: "A card".to_owned(), driver: "its driver".to_owned(), is_software: false }
}

/// Verdicts of a paper's claims, by the words in them.
fn verdict(judged: &[Judged], words: &str) -> &'static str {
    let found: Vec<_> = judged.iter().filter(|judged| judged.claim.what.contains(words)).collect();
    assert_eq!(found.len(), 1, "{words}: {found:?}");
    found[0].verdict.name()
}

/// Small reports of all parts, in which most claims hold.
fn reports(is_software: bool) -> Reports {
    let mut reports = Reports::of(is_software);
    let configuration = |name: &str, ms: f64| json!({ "name": name, "frame_ms": ms, "shadow_ms": 0.9 * ms, "rays": 100.0 * ms, "shadow_part": 0.9, "false_positives": 0.1 });
    let tile = |name: &str, ms: f64, lights: u32| json!({ "name": name, "frame_ms": ms, "list_bytes": lights });
    let forward_plus = json!({
        "scene": "demo:atrium", "width": 160, "height": 80,
        "configurations": [
            configuration("no optimisations", 10.0), configuration("light culling", 8.0),
            configuration("light culling + AABB", 7.0), configuration("light culling + AABB + naive normals", 5.9),
            configuration("light culling + AABB + improved normals", 6.0), configuration("improved normals", 9.9),
        ],
        "tile_sizes": [tile("8 x 8", 5.0, 2404), tile("16 x 16", 5.1, 604), tile("32 x 32", 5.5, 30)],
        "normals": [{ "name": "naive", "mean_flip": 0.1 }, { "name": "improved", "mean_flip": 0.2 }],
    });
    reports.add("forward-plus", Ok(forward_plus));
    let clusters = |views: &str, assignment: &str, lights: u32, visible: u32| {
        json!({
            "clusters": "persp:64", "views": views, "assignment": assignment, "lights": lights,
            "counts": { "visible_clusters": visible, "lights_listed": visible, "light_tests": lights * 10, "lighting_operations": visible },
            "ms": { "prepass": 1, "mark": 1, "compact": 1, "tree": 1, "count": visible, "write": 1, "shading": 9, "other": 1 },
        })
    };
    let rows = json!([
        clusters("mono", "brute_force", 1000, 9),
        clusters("mono", "brute_force", 10_000, 9),
        clusters("stereo-individual", "hierarchy", 1000, 20),
        clusters("stereo-enclosed", "hierarchy", 1000, 10),
    ]);
    reports.add("clustered", Ok(json!({ "scene": "demo:atrium", "rows": rows })));
    reports.add("clustered-track", Err("it took too long".to_owned()));
    reports.add("attenuation", Ok(Value::from("<svg></svg>")));
    let built = |builder: &str, directions: u32, ms: f64| {
        json!({
            "builder": builder, "images": builder, "directions": directions, "resolution": 64, "supersampling": 1, "total_ms": ms,
            "bytes": 20_000_000, "holes": { "missing": 0.03 },
        })
    };
    let images = |triangles: u32, rate: f64| {
        let traced = |structure: &str, rate: f64| json!({ "group": "Directions", "structure": structure, "directions": 8, "rate_random": rate });
        let built = [
            built("single_pass", 8, 1.0),
            built("single_pass", 128, 5.0),
            built("single_pass", 169, 6.0),
            built("per_direction", 169, 120.0),
        ];
        let traced = [traced("within-texel", rate), traced("across-texels", rate)];
        json!({ "scene": "a room", "triangles": triangles, "built": built, "traced": traced })
    };
    reports.add("deep-images", Ok(images(100, 10.0)));
    reports.add("deep-images-many-triangles", Ok(images(3000, 9.0)));
    let crossing = |what: &str, directions: u32, texels: f64| json!({ "what": what, "directions": directions, "texels_a_ray": texels });
    let crossings = [
        crossing("the scene", 24, 4.0),
        crossing("the scene", 54, 3.0),
        crossing("four times the triangles", 54, 3.0),
        crossing("an empty box", 54, 3.0),
        crossing("tight corridors", 54, 3.5),
    ];
    reports.add("crossings", Ok(json!({ "crossings": crossings })));
    let lit = |brdf: &str, directions: u32, resolution: u32, samples: u32, rate: f64| {
        json!({
            "brdf": brdf, "tracer": "across-texels", "directions": directions, "resolution": resolution, "samples": samples,
            "accumulate": 1, "filter_radius": 8, "frame_ms": 10 + samples, "rate_shaded": rate, "rate_traced": 2.0 * rate,
        })
    };
    let rows = [
        lit("diffuse", 96, 128, 1, 60.0),
        lit("diffuse", 96, 128, 4, 60.0),
        lit("diffuse", 150, 128, 1, 50.0),
        lit("diffuse", 96, 512, 1, 10.0),
        lit("glossy", 150, 128, 1, 90.0),
    ];
    let images = json!([{ "directions": 75, "resolution": 128, "bytes": 33_000_000 }]);
    reports.add("indirect", Ok(json!({ "scene": "a room", "rows": rows, "images": images })));
    let paper = json!({
        "name": "as in the paper", "steps": [5, 5, 1, 1, 1, 1, 6], "frame": 90, "range_rays": 0.5, "ranges": 0.5, "unique": 15_000,
        "listed": 500, "indirect_energy": 0.1,
    });
    let ranges = json!([{ "map": 256, "lights": 60_000, "deep_images_ms": 0.4, "bvh_ms": 2, "random_ms": 0.1 }]);
    reports.add("virtual-lights", Ok(json!({ "scene": "a room", "rows": [paper], "ranges": ranges })));
    reports.add("virtual-lights-many-triangles", Err("it is left out of the quick run".to_owned()));
    let paper =
        json!({ "name": "as in the paper", "times": { "emit": 1, "trace": 2, "keep": 1, "lists": 1, "splat": 95 } });
    let maps = |name: &str, bytes: u32, flip: f64| json!({ "name": name, "bytes": bytes, "deep_images_ms": 100, "occlusion_ms": 20, "flip": flip });
    let occlusion =
        [maps("as in the paper, 512 x 200²", 800_000_000, 0.2), maps("as in the paper, 512 x 50²", 50_000_000, 0.21)];
    reports.add("photons", Ok(json!({ "scene": "a room", "rows": [paper], "occlusion": occlusion })));
    reports
}

#[test]
fn every_claim_is_on_the_page_once_with_a_verdict() {
    let page = page::page(&PAPERS, &machine(), true, &reports(false), &[]);
    let (html, json): (String, Value) = (page.to_html(""), serde_json::from_str(&page.to_json()).unwrap());
    let rows = json["claims"].as_array().unwrap();
    for (paper, claims) in CLAIMS {
        let section = paper.declared().judged(&reports(false));
        for words in claims {
            verdict(&section, words);
            let of_this = |row: &&Value| {
                row["claim"].as_str().unwrap().contains(words)
                    && section.iter().any(|judged| row["claim"] == *judged.claim.what)
            };
            assert_eq!(rows.iter().filter(of_this).count(), 1, "{words}");
        }
    }
    for row in rows {
        let claim = row["claim"].as_str().unwrap();
        assert_eq!(html.matches(&format!(">{}<", lanternfish_cli::plot::escaped(claim))).count(), 1, "{claim}");
        assert!(
            ["confirmed", "not confirmed", "not testable here"].contains(&row["verdict"].as_str().unwrap()),
            "{row}"
        );
        assert_eq!(row["verdict"] == "not testable here", row["reason"].is_string(), "{row}");
        assert!(
            row["rule"].as_str().unwrap().starts_with("confirmed if ")
                && row["source"].as_str().unwrap().starts_with('['),
            "{row}"
        );
    }
    assert!(html.contains("<svg></svg>") && !html.contains("<script") && !html.contains("NaN"), "{html}");
    assert!(html.contains("Figures 6.2 to 6.10: not measured, because clustered-track: it took too long."), "{html}");
    assert!(html.contains("A card on its driver") && page.to_markdown().contains("## Archer 2019"));
}

#[test]
fn verdicts_follow_the_figures() {
    let reports = reports(false);
    let of = |paper: Paper, expected: &[(&str, &str)]| {
        let section = paper.declared().judged(&reports);
        for (words, name) in expected {
            assert_eq!(verdict(&section, words), *name, "{words}");
        }
    };
    let [yes, no, unknown] = ["confirmed", "not confirmed", "not testable here"];
    of(
        Paper::Elagabani,
        &[
            ("all optimisations", yes),
            ("facing alone", no),
            ("quadruples", yes),
            ("error of naive", yes),
            ("error of improved", no),
            ("shadow rays take", yes),
        ],
    );
    of(Paper::VanGelderen, &[("halves", yes), ("shortens clustering", yes), ("linear", yes), ("steadiest", unknown)]);
    of(
        Paper::Niessner,
        &[
            ("number of triangles", yes),
            ("four times the triangles", yes),
            ("fewer images", yes),
            ("tight corridors", no),
            ("diffuse rays through images of 128²", yes),
            ("diffuse rays through images of 512²", no),
            ("soft shadows rays through images of 512²", unknown),
            ("diffuse: images of 128²", yes),
            ("antialiasing", no),
            ("15 to 60 MB", yes),
            ("96, 150 and 384", yes),
        ],
    );
    of(
        Paper::Aalund,
        &[
            ("is tracing", no),
            ("instead of 200²", yes),
            ("HBAO slows", unknown),
            ("fig. 10 (a)", yes),
            ("sixteenth", no),
        ],
    );
    of(
        Paper::Archer,
        &[
            ("22 to 104", yes),
            ("same result", no),
            ("10 % slower", yes),
            ("1 % of the frame", yes),
            ("thousand million", no),
            ("similar", no),
            ("all steps, Atrium", yes),
            ("all steps, Rungholt", unknown),
            ("are unique", yes),
            ("are listed", no),
        ],
    );
}

#[test]
fn a_software_adapter_judges_ratios_but_no_speed() {
    let reports = reports(true);
    let [archer, niessner] = [Paper::Archer, Paper::Niessner].map(|paper| paper.declared().judged(&reports));
    assert_eq!(
        (verdict(&archer, "thousand million"), verdict(&archer, "22 to 104")),
        ("not testable here", "confirmed")
    );
    let words = ["diffuse rays through images of 128²", "diffuse: images of 128²"];
    assert_eq!(words.map(|words| verdict(&niessner, words)), ["not testable here", "confirmed"]);
}

#[test]
fn rows_that_cull_by_range_too_are_not_the_thesis() {
    let mut reports = Reports::of(false);
    let row = |name: &str| json!({ "name": name, "frame_ms": 1, "rays": 1 });
    let rows = ["no optimisations", "light culling", "improved normals"].map(row);
    reports.add("forward-plus", Ok(json!({ "configurations": rows })));
    let section = Paper::Elagabani.declared().judged(&reports);
    let names = ["light culling alone", "facing alone"].map(|words| verdict(&section, words));
    assert_eq!(names, ["not confirmed", "not testable here"]);
}

#[test]
fn a_page_of_nothing_says_so_of_each_claim() {
    let mut reports = Reports::of(false);
    let mut ran = Vec::new();
    for part in &parts() {
        let outcome = Err("the device was lost".to_owned());
        ran.push(RanPart::of(
            part,
            &(Some(vec![part.name.clone()]), Ran { outcome: outcome.clone(), seconds: Some(1.5) }),
        ));
        reports.add(&part.name, outcome);
    }
    let page = page::page(&PAPERS, &machine(), false, &reports, &ran);
    let json: Value = serde_json::from_str(&page.to_json()).unwrap();
    for row in json["claims"].as_array().unwrap() {
        assert_eq!(
            (&row["ours"], &row["value"], &row["verdict"]),
            (&json!("not measured"), &Value::Null, &json!("not testable here"))
        );
        assert!(row["reason"].as_str().unwrap().starts_with("not measured, because "), "{row}");
    }
    assert_eq!(json["parts"].as_array().unwrap().len(), parts().len());
    assert!(page.to_markdown().contains("not measured, because the device was lost"));
}

#[test]
fn every_part_is_a_command_in_both_forms() {
    let (nowhere, folder) = (Path::new("nowhere"), Path::new("out/part"));
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");
    for part in &parts() {
        for (quick, docs) in [(true, nowhere), (false, nowhere), (false, Path::new(docs))] {
            let Some(words) = part.arguments(quick, docs, folder, Some("cpu")) else {
                assert!(quick, "{}: a full run has every part", part.name);
                continue;
            };
            let program = std::iter::once("lanternfish-bench".to_owned());
            let parsed = Cli::try_parse_from(program.chain(words.clone()));
            assert!(parsed.is_ok(), "{words:?}: {}", parsed.err().unwrap());
            assert!(words.iter().any(|word| word.starts_with("out/part")), "{words:?}");
        }
    }
    let all = parts();
    let track = all.iter().find(|part| part.name == "clustered-track").unwrap();
    let words = track.arguments(true, nowhere, folder, None).unwrap();
    assert!(words.contains(&folder.join("atrium.toml").display().to_string()), "{words:?}");
    let mut names: Vec<_> = all.iter().map(|part| &part.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), parts().len());
    for paper in &PAPERS {
        assert!(all.iter().any(|part| part.papers.contains(paper)), "{paper:?}");
    }
}
