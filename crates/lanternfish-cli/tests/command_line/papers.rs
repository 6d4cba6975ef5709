//! `lanternfish papers`, end to end on the software adapter.

use crate::support::Folder;

/// The least work: small images, few directions, few lights.
const SMALL: &str = "--size 24x18 --adapter cpu --sky 0.5,0.5,0.5 --deep-directions cube:1 --deep-resolution 8 --vpl-images shared \
                     --occlusion-images shared --vpl-map 64 --photon-count 16 --indirect-rays 1 --glossy-rays 1 --spp 2";

/// Every image has its file, its place on the sheet and its figures on the page. Without any image there is an error.
#[test]
#[ignore = "full"]
fn gpu_a_sheet_has_every_paper() {
    let folder = Folder::new();
    folder.done(&format!("papers demo:cornell -o sheet {SMALL}"));
    let papers = ["five", "elagabani", "van-gelderen", "niessner", "aalund", "archer"];
    let page = String::from_utf8(folder.read("sheet/papers.html")).unwrap();
    for name in papers.iter().chain(&["path-tracer"]) {
        let image = format!("{name}.png");
        assert!(folder.names("sheet").contains(&image) && page.contains(&image), "{name}");
    }
    assert_eq!(page.matches("FLIP ").count(), papers.len(), "{page}");
    assert!(page.contains("shadow rays") && page.contains("§4.2.2") | page.contains("§4.3.1"), "{page}");
    let (drawn, image) = (folder.png("sheet/papers.png"), folder.png("sheet/path-tracer.png"));
    let top = 8 + 2 * 12;
    assert_eq!(drawn.pixels[top * drawn.width + 8..][..24], image.pixels[..24], "the first image is the path tracer's");

    // Shadow rays cannot use linked lists.
    let lists = format!("papers demo:cornell -o sheet {SMALL} --shadows across-texels --deep-store linked_list");
    let said = folder.run(&lists);
    assert!(said.code == Some(1) && said.stderr.contains("linear_array"), "{said:?}");
    assert!(said.stderr.contains("no image could be"), "{said:?}");
}
