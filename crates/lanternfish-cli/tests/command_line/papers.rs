//! `lanternfish papers`, end to end on the software adapter.

use std::fs;

use lanternfish_metrics::read_png;

use crate::support::{lanternfish, names};

/// The least work: small images, few directions, few lights.
const SMALL: &str = "--size 24x18 --adapter cpu --sky 0.5,0.5,0.5 --deep-directions cube:1 --deep-resolution 8 --vpl-images shared \
                     --occlusion-images shared --vpl-map 64 --photon-count 16 --indirect-rays 1 --glossy-rays 1 --spp 2";

/// Every image has its file, its place on the sheet and its figures on the page. Without any image there is an error.
#[test]
fn gpu_a_sheet_has_every_paper() {
    let folder = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let words = SMALL.split_whitespace().chain(more.iter().copied());
        lanternfish(folder.path()).args(["papers", "demo:cornell", "-o", "sheet"]).args(words).output().unwrap()
    };
    let output = run(&[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let sheet = folder.path().join("sheet");
    let papers = ["five", "elagabani", "van-gelderen", "niessner", "aalund", "archer"];
    let page = fs::read_to_string(sheet.join("papers.html")).unwrap();
    for name in papers.iter().chain(&["path-tracer"]) {
        assert!(names(&sheet).contains(&format!("{name}.png")) && page.contains(&format!("{name}.png")), "{name}");
    }
    assert_eq!(page.matches("FLIP ").count(), papers.len(), "{page}");
    assert!(page.contains("shadow rays") && page.contains("§4.2.2") | page.contains("§4.3.1"), "{page}");
    let drawn = read_png(&sheet.join("papers.png")).unwrap();
    let image = read_png(&sheet.join("path-tracer.png")).unwrap();
    let top = 8 + 2 * 12;
    assert_eq!(drawn.pixels[top * drawn.width + 8..][..24], image.pixels[..24], "the first image is the path tracer's");

    // Shadow rays cannot use linked lists.
    let output = run(&["--shadows", "across-texels", "--deep-store", "linked_list"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && said.contains("linear_array") && said.contains("no image could be"), "{said}");
}
