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
    let page = String::from_utf8(folder.read("sheet/papers.html")).unwrap();
    // Each image, and with which ground truths it is compared: a pair of views with none.
    let own = ["direct", "direct", "one bounce", "one bounce", "one bounce"];
    let papers = ["elagabani", "van-gelderen", "niessner", "aalund", "archer"].into_iter().zip(own);
    let mut images = vec![("five for two eyes".into(), vec![]), ("path tracer".into(), vec![])];
    images.push(("five".to_owned(), vec!["all light"]));
    images.extend(papers.clone().map(|(name, own)| (name.to_owned(), vec!["all light", own])));
    let truths = |name| if name == "van-gelderen" { vec![] } else { vec!["all light"] };
    images.extend(papers.map(|(name, _)| (format!("five without {name}"), truths(name))));
    let figures: Vec<&str> = page.split("<figure>").skip(1).collect();
    assert_eq!(figures.len(), images.len(), "{page}");
    for (figure, (name, truths)) in figures.iter().zip(images) {
        let file = format!("{}.png", name.replace(' ', "-"));
        let is_named = figure.contains(&format!("src=\"{file}\"")) && figure.contains(&format!("<b>{name}</b>"));
        assert!(is_named && folder.names("sheet").contains(&file), "{name}: {figure}");
        assert_eq!(figure.matches("FLIP ").count(), truths.len(), "{name}: {figure}");
        assert!(truths.iter().all(|truth| figure.contains(&format!("{truth}: FLIP "))), "{name}: {figure}");
    }
    assert!(page.contains("shadow rays") && page.contains("§4.3.1"), "{page}");
    // The pair is first, and the path tracer's image beside it: below the title, a gap of 8 pixels around each.
    let (drawn, top) = (folder.png("sheet/papers.png"), 8 + 2 * 20);
    for (file, left) in [("five-for-two-eyes", 8), ("path-tracer", 8 + 24 + 8)] {
        let image = folder.png(&format!("sheet/{file}.png"));
        assert_eq!((image.width, image.height), (24, 18), "{file}");
        assert_eq!(drawn.pixels[top * drawn.width + left..][..24], image.pixels[..24], "{file}");
    }

    // Shadow rays cannot use linked lists: one image has none. Without any image there is an error.
    let again = format!("papers demo:cornell -o sheet --resume {SMALL}");
    let said = folder.run(&format!("{again} --shadows across-texels --deep-store linked_list --deep-slopes off"));
    assert!(said.code == Some(0) && said.stderr.matches("linear_array").count() == 11, "{said:?}");
    assert!(!said.stderr.contains("warning: five without niessner"), "{said:?}");
    let said = folder.run(&again.replace("cpu", "nowhere"));
    assert!(said.code == Some(1) && said.stderr.contains("no image could be"), "{said:?}");
}
