//! An idle window without motion is not repainted.

use super::*;

/// Duration without repaints.
const A_WHILE: Duration = Duration::from_secs(3);

/// Number of repaints, from the log.
fn paints(folder: &Path) -> usize {
    let log = fs::read_to_string(folder.join("log")).unwrap();
    log.lines().filter(|line| line.contains("of the window") && line.contains("paint ")).count()
}

/// Waits until repaints stop; only the pointer over the window causes another.
#[test]
#[ignore = "full"]
fn gpu_a_scene_at_rest_is_not_painted() {
    let Some(display) = Display::open("gpu_a_scene_at_rest_is_not_painted") else { return };
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let view = open(&display, folder, "--size 400x300");
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
    close(&display, view);
}
