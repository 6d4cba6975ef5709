//! Light rain in the window.

use super::*;

/// Light rain falls during playback and stops with it. The shot that is saved then renders the window's image to the bit.
#[test]
#[ignore = "full"]
fn gpu_rain_falls_while_it_is_played() {
    let Some(display) = Display::open("gpu_rain_falls_while_it_is_played") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (view, first) = open_alone(&display, folder.path(), "--size 400x300 --lights rain:40:1.2 --history off");
    display.act("key space");
    wait_for("other lights", || (!are_alike(&display.screen(), &first)).then_some(()));
    sleep(Duration::from_millis(500));
    display.act("key space");
    display.settled("the image where it was stopped", |screen| is_image(screen) && !are_alike(screen, &first));
    let text = saved_as_seen(&display, folder.path(), view);
    let says = |name: &str| text.lines().any(|line| line.starts_with(name));
    assert!(says("time = ") && !says("animation = "), "{text}");
}
