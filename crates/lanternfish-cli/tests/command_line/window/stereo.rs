//! Two eyes in the window.

use super::*;

/// Both eyes' pictures stand beside each other, the shot that is saved is what was seen, to the bit, and a key shows one picture again.
#[test]
fn gpu_two_eyes_are_shown_and_saved() {
    let Some(display) = Display::open("gpu_two_eyes_are_shown_and_saved") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut view = open(&display, folder.path(), "--size 400x300 --stereo parallel:0.3");
    display.settled("the panels", |screen| screen.iter().any(|pixel| pixel.iter().any(|byte| *byte > 0)));
    display.act("mousemove 600 460");
    display.act("key F3");
    let both = display.settled("both pictures", is_picture);
    let half = SIZE[0] / 2;
    let row = |y: usize| &both[y * SIZE[0]..][..SIZE[0]];
    let differing = (0..SIZE[1]).flat_map(|y| (0..half).map(move |x| (x, y)));
    let differing = differing.filter(|(x, y)| is_other(row(*y)[*x], row(*y)[x + half])).count();
    // Nearly the same scene, seen from 0.3 m apart.
    let all = half * SIZE[1];
    assert!((all / 100..all * 3 / 4).contains(&differing), "{differing} of {all} pixels differ between the eyes");

    display.act("key t");
    let one = display.settled("one picture", |screen| is_picture(screen) && !are_alike(screen, &both));
    display.act("key t");
    display.settled("both again", |screen| are_alike(screen, &both) && !are_alike(screen, &one));
    display.act("key F4");
    let shot = folder.path().join("lanternfish-1.toml");
    wait_for("a shot", || shot.exists().then_some(()));
    assert!(fs::read_to_string(&shot).unwrap().contains("\"parallel:0.3\""));
    let seen = screenshot(&display, folder.path());
    display.act("key Escape");
    assert!(wait_for("the end", || view.0.try_wait().unwrap()).success());
    let output =
        lanternfish(folder.path()).args(["render", "lanternfish-1.toml", "-o", "rendered.png"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (seen, rendered) = (read_png(&seen).unwrap(), read_png(&folder.path().join("rendered.png")).unwrap());
    assert_eq!((seen.width, seen.height), (SIZE[0], SIZE[1]));
    assert!(seen.pixels == rendered.pixels, "the window and the rendered shot differ");
}
