//! Stereo in the window.

use super::*;

/// Both eyes' images are shown side by side, the saved shot renders the window's image to the bit, and a key returns to mono.
#[test]
fn gpu_two_eyes_are_shown_and_saved() {
    let Some(display) = Display::open("gpu_two_eyes_are_shown_and_saved") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (view, both) = open_alone(&display, folder.path(), "--size 400x300 --stereo parallel:0.3");
    let half = SIZE[0] / 2;
    let row = |y: usize| &both[y * SIZE[0]..][..SIZE[0]];
    let differing = (0..SIZE[1]).flat_map(|y| (0..half).map(move |x| (x, y)));
    let differing = differing.filter(|(x, y)| is_other(row(*y)[*x], row(*y)[x + half])).count();
    // Nearly the same scene from two positions 0.3 m apart.
    let all = half * SIZE[1];
    assert!((all / 100..all * 3 / 4).contains(&differing), "{differing} of {all} pixels differ between the eyes");

    display.act("key t");
    let one = display.settled("one image", |screen| is_image(screen) && !are_alike(screen, &both));
    display.act("key t");
    display.settled("both again", |screen| are_alike(screen, &both) && !are_alike(screen, &one));
    let text = saved_as_seen(&display, folder.path(), view);
    assert!(text.contains("\"parallel:0.3\""));
}
