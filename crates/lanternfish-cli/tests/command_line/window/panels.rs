//! All panels, the view from above, and the stored window state.

use super::*;

/// Unfolds and scrolls all headings; looks at the first camera from above and returns; the next window has the stored size.
#[test]
#[ignore = "full"]
fn gpu_every_panel_is_opened() {
    let Some(display) = Display::of("gpu_every_panel_is_opened", [1280, 960]) else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut view = open(&display, folder.path(), "--size 1240x900");
    let mut is_there = || view.0.try_wait().unwrap().is_none();
    let first = display.settled("the panels beside the image", is_image);
    display.act("key F6");
    display.act("mousemove 1120 700");
    let unfolded = display.settled("everything unfolded", |screen| !are_alike(screen, &first));
    for _ in 0..40 {
        display.act("click 5");
    }
    display.settled("the end of what is on the right", |screen| !are_alike(screen, &unfolded));
    display.act("mousemove 150 500");
    for _ in 0..40 {
        display.act("click 5");
    }
    display.settled("the end of the settings", |screen| !are_alike(screen, &unfolded));
    for at in ["150 500", "1120 700"] {
        display.act(&format!("mousemove {at}"));
        for _ in 0..60 {
            display.act("click 4");
        }
    }
    display.act("key F6");
    display.act("mousemove 1260 940");
    // The passes, which were unfolded at first, are folded too.
    let folded = display.settled("everything folded", |screen| !are_alike(screen, &unfolded));
    display.act("key v");
    display.settled("the view from above", |screen| !are_alike(screen, &folded) && is_image(screen));
    assert!(is_there());
    display.act("key v");
    display.settled("the first camera again", |screen| are_alike(screen, &folded));
    close(&display, view);

    let kept = fs::read_to_string(folder.path().join("config/lanternfish/window.toml")).unwrap();
    assert!(kept.contains("size = [1240, 900]") && kept.contains("panels = true"), "{kept}");
    fs::write(folder.path().join("config/lanternfish/window.toml"), "size = [500, 320]\npanels = false\n").unwrap();
    let view = open(&display, folder.path(), "--shadows none");
    let window = display.act("search --name Lanternfish");
    let geometry = display.act(&format!("getwindowgeometry {}", window.lines().next().unwrap()));
    assert!(geometry.contains("500x320"), "{geometry}");
    display.settled("the image", is_image);
    close(&display, view);
}
