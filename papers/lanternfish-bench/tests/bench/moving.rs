//! `lanternfish-bench moving`, end to end on the software adapter.

use crate::bench;

/// Sent bytes and ray distances are exact. Deep images are rebuilt only after a motion.
#[test]
#[ignore = "full"]
fn gpu_motion_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let (report, said) = bench(folder.path(), "moving demo:cornell --runs 1 --rays 4096", "report");
    let times = report["times"].as_array().unwrap();
    assert!(times.iter().any(|row| row["tracer"] == "bvh"), "{times:?}");
    for row in times {
        // 64 bytes for the transform, 64 for the draw, and 16 for each dispatch.
        let (bytes, dispatches) = (row["one_bytes"].as_u64().unwrap(), row["dispatches"].as_u64().unwrap());
        assert_eq!(bytes, 128 + 16 * dispatches, "{row}");
    }
    assert_eq!(report["light"]["bytes"], 64);
    let built = &report["built"];
    assert!(built["image_passes"].as_u64().unwrap() > 0 && built["kept_passes"] == 0, "{built}");
    let refits = report["refits"].as_array().unwrap();
    assert!(refits.len() == 5 && refits.iter().all(|row| row["differing"] == 0), "{refits:?}");
    assert!(said.contains("Adding an instance") && said.contains("## Rays through the BVH"), "{said}");
}
