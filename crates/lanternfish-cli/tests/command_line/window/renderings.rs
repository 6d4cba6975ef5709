//! Image files in the window.

use lanternfish_metrics::{ColorType, write_png};

use super::*;

/// Grey stripes; the right half has this much more red.
pub fn write_stripes(path: &Path, red: u8) {
    let pixel = |x: usize| {
        let grey = if (x / 8).is_multiple_of(2) { 60 } else { 140 };
        [if x >= SIZE[0] / 2 { grey + red } else { grey }, grey, grey]
    };
    let pixels: Vec<u8> = (0..SIZE[1]).flat_map(|_| (0..SIZE[0]).flat_map(pixel)).collect();
    write_png(path, [SIZE[0] as u32, SIZE[1] as u32], ColorType::Rgb, &pixels).unwrap();
}

/// Blue, green and red of a pixel.
fn at(screen: &[[u8; 3]], x: usize, y: usize) -> [u8; 3] {
    screen[y * SIZE[0] + x]
}

/// Compares A, left of the line, with B, right of it; shows the difference; zooms in with the wheel, and resets.
#[test]
#[ignore = "full"]
fn gpu_two_images_are_compared() {
    let Some(display) = Display::open("gpu_two_images_are_compared") else { return };
    let folder = tempfile::tempdir().unwrap();
    write_stripes(&folder.path().join("a.png"), 0);
    write_stripes(&folder.path().join("b.png"), 80);
    let view = start(&display, folder.path(), "view a.png b.png --size 400x300 --adapter cpu");
    display.settled("the panel", |screen| screen.iter().any(|pixel| pixel.iter().any(|byte| *byte > 0)));
    display.act("mousemove 600 460");
    display.act("key F3");
    let both = display
        .settled("both images", |screen| at(screen, 100, 150) == [60; 3] && at(screen, 300, 150) == [140, 140, 220]);
    assert_eq!([at(&both, 107, 150), at(&both, 304, 150)], [[140; 3], [60, 60, 140]], "to the pixel");

    display.act("key m");
    display.settled("the map", |screen| {
        let bright = |x: usize| at(screen, x, 150).map(u32::from).iter().sum::<u32>();
        bright(40) < 40 && bright(360) > 150
    });
    display.act("key m");
    display.settled("both again", |screen| *screen == both);
    display.act("key space");
    display.settled("exchanged", |screen| at(screen, 300, 150) == [140; 3]);
    display.act("key space");
    display.settled("both again", |screen| *screen == both);

    // Zoomed in, a stripe is wider and its edge is sharp.
    display.act("mousemove 100 150");
    for _ in 0..6 {
        display.act("click 4");
        sleep(Duration::from_millis(100));
    }
    display.act("mousemove 600 460");
    let row = |screen: &[[u8; 3]]| (20..180).map(|x| at(screen, x, 40)[0]).collect::<Vec<_>>();
    let edges = |screen: &[[u8; 3]]| row(screen).windows(2).filter(|two| two[0] != two[1]).count();
    let enlarged = display.settled("an enlarged image", |screen| (1..15).contains(&edges(screen)));
    assert!(row(&enlarged).iter().all(|value| [60, 140].contains(value)), "{:?}", row(&enlarged));
    display.act("key f");
    display.settled("all of it", |screen| *screen == both);
    close(&display, view);
}

/// The window shows the rendered image.
#[test]
#[ignore = "full"]
fn gpu_a_rendered_image_is_opened() {
    let Some(display) = Display::open("gpu_a_rendered_image_is_opened") else { return };
    let folder = tempfile::tempdir().unwrap();
    let words = "render demo:cornell --adapter cpu --indirect none --size 400x300 -o box.png --open";
    let render = start(&display, folder.path(), words);
    display.settled("the panel", |screen| screen.iter().any(|pixel| pixel.iter().any(|byte| *byte > 0)));
    display.act("mousemove 600 460");
    display.act("key F3");
    let rendering = read_png(&folder.path().join("box.png")).unwrap();
    let bytes = rendering.pixels.iter().map(|[r, g, b]| [*b, *g, *r].map(|value| (255.0 * value).round() as u8));
    let expected: Vec<_> = bytes.collect();
    display.settled("the image, to the bit", |screen| *screen == expected);
    close(&display, render);
    let said = fs::read_to_string(folder.path().join("log")).unwrap();
    assert!(said.lines().any(|line| line == "box.png"), "{said}");
}
