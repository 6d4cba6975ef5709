//! An idle window without motion is not repainted.

use super::{renderings::write_stripes, *};

/// Duration without repaints.
const A_WHILE: Duration = Duration::from_secs(3);

/// Number of repaints, from the log.
fn paints(folder: &Path) -> usize {
    let log = fs::read_to_string(folder.join("log")).unwrap();
    log.lines().filter(|line| line.contains("of the window") && line.contains("paint ")).count()
}

/// Waits until repaints stop; only the pointer over the window causes another.
fn comes_to_rest(display: &Display, folder: &Path, view: Running) {
    display.act("mousemove 600 460");
    display.settled("the panels", |screen| screen.iter().any(|pixel| pixel.iter().any(|byte| *byte > 0)));
    let mut seen = Vec::new();
    let started = Instant::now();
    let all = loop {
        let before = paints(folder);
        sleep(A_WHILE);
        let now = paints(folder);
        seen.push(now - before);
        if now == before {
            break now;
        }
        assert!(started.elapsed() < LONGEST, "repaints do not stop: {seen:?} times in {A_WHILE:?} each");
    };
    println!("painted {all} times until repaints stopped: {seen:?} in {A_WHILE:?} each");
    assert!(all > 0, "the log has no repaints");
    display.act("mousemove 100 150");
    wait_for("a paint because of the pointer", || (paints(folder) > all).then_some(()));
    close(display, view);
}

#[test]
#[ignore = "full"]
fn gpu_two_images_at_rest_are_not_painted() {
    let Some(display) = Display::open("gpu_two_images_at_rest_are_not_painted") else { return };
    let folder = tempfile::tempdir().unwrap();
    write_stripes(&folder.path().join("a.png"), 0);
    write_stripes(&folder.path().join("b.png"), 80);
    let view = start(&display, folder.path(), "view a.png b.png --size 400x300 --adapter cpu");
    comes_to_rest(&display, folder.path(), view);
}

#[test]
#[ignore = "full"]
fn gpu_a_scene_at_rest_is_not_painted() {
    let Some(display) = Display::open("gpu_a_scene_at_rest_is_not_painted") else { return };
    let folder = tempfile::tempdir().unwrap();
    let view = open(&display, folder.path(), "--size 400x300");
    comes_to_rest(&display, folder.path(), view);
}
