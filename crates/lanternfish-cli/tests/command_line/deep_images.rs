//! `lanternfish deep-images`, end to end on the software adapter.

use crate::support::Folder;

const SMALL: &str = "deep-images demo:cornell --adapter cpu --directions stacks:3x4 --resolution 32 -o a.png";

#[test]
#[ignore = "full"]
fn gpu_every_view_gives_an_image() {
    let folder = Folder::new();
    for (view, size, lines) in [
        ("points --size 96x54", (96, 54), &["shown       all images"][..]),
        ("points --size 96x54 --image 11", (96, 54), &["shown       image 11, along "]),
        ("layer --layer -1 --upscale 3", (96, 96), &["layers      -1", "dark blue: no fragment"]),
        ("layers --layers 2 --image 5 --upscale 1", (2 * 32 + 8, 32), &["layers      0, 1", "scale       white -"]),
        ("transparent --upscale 1", (3 * 32 + 16, 2 * 32 + 8), &["shown       image 0, along ", "image 10, along "]),
        ("transparent --image 7 --upscale 2", (64, 64), &["shown       image 7, along "]),
        ("count --upscale 2", (64, 64), &[" per texel on average, ", "scale       black 0, blue "]),
    ] {
        let said = folder.done(&format!("{SMALL} --view {view}")).stdout;
        assert_eq!(said.lines().last(), Some("a.png"), "{said}");
        let all =
            ["directions  stacks:3x4\n", "images      12 of 32 x 32 texels, per_triangle\n", "bytes  ", "build  "];
        for line in all.iter().chain(lines) {
            assert!(said.contains(line), "{line:?} is not in\n{said}");
        }
        let image = folder.png("a.png");
        assert_eq!((image.width, image.height), size, "{view}");
        assert!(image.pixels.iter().any(|pixel| *pixel != image.pixels[0]), "{view}: the image is uniform");
    }
}

#[test]
#[ignore = "full"]
fn gpu_missing_images_and_layers_are_refused_with_the_valid_range() {
    let folder = Folder::new();
    for (words, known) in [
        ("--image 12", "there is no image 12: 12 directions have images 0 to 11"),
        ("--view layer --image 3 --layer 99", "there is no layer 99: the longest list of image 3 holds "),
        ("--view layers --image 3 --upscale 512", "choose a smaller --upscale"),
        ("--directions zonal:4096 --resolution 1024", "at most 2147483648 are supported"),
        ("--builder single_pass --resolution 2500", "choose a smaller --resolution"),
    ] {
        folder.run(&format!("{SMALL} {words}")).was_refused(&[known]);
    }
    assert!(folder.names("").is_empty());
}

#[test]
fn gpu_a_shot_gives_scene_and_camera() {
    let shot = "scene = \"demo:cornell\"\n[output]\noutput = \"other.png\"\nsize = [80, 60]\n[view]\neye = [0, 1, 2]\n";
    let folder = Folder::with(&[("a.toml", shot)]);
    let words = "--adapter cpu --directions cube:1 --resolution 32";
    assert!(folder.done(&format!("deep-images a.toml {words}")).stdout.ends_with("\na.deep-images.png\n"));
    let from_shot = folder.png("a.deep-images.png");
    assert_eq!((from_shot.width, from_shot.height), (80, 60));
    folder.done(&format!("deep-images demo:cornell {words} --eye 0,1,2 --size 80x60 -o b.png"));
    assert_eq!(folder.png("b.png"), from_shot);
}
