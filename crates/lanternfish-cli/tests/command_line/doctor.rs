//! `lanternfish doctor` as a process.

use crate::support::Folder;

#[test]
#[ignore = "full"]
fn gpu_a_report_survives_writing_and_reading() {
    if lanternfish_gpu::testing::gpu("gpu_a_report_survives_writing_and_reading").is_none() {
        return;
    }
    let folder = Folder::new();
    let mut doctor = folder.program();
    doctor.args("doctor --adapter cpu --json report.json --images images --filter".split(' ')).arg("alpha mask");
    let table = crate::support::Ran::of(&mut doctor).succeeded().stdout;
    assert!(table.contains("0 failed") && table.contains("alpha mask") && table.contains("tracer auto"), "{table}");
    assert!(!folder.names("images").is_empty(), "an image beside its reference");
    assert_eq!(folder.names(""), ["images", "report.json"], "nothing else is left");
    assert_eq!(folder.done("doctor --read report.json").stdout, table);
    let json = String::from_utf8(folder.read("report.json")).unwrap();
    assert!(!json.contains(folder.path("").to_str().unwrap()), "a report names no path of the user's");
}
