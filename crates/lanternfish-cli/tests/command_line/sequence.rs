//! Sequences in parts, on the software adapter: the frames do not depend on the order or the machine.

use std::{
    collections::BTreeMap,
    fs,
    io::{BufRead as _, BufReader},
    process::Stdio,
};

use lanternfish_metrics::{ColorType, read_exr_attributes, read_png_texts, write_png};

use crate::support::Folder;

/// A reader that has enough after the first line (`| head -1`) does not end the sequence.
#[test]
fn gpu_a_closed_pipe_does_not_end_a_sequence() {
    let folder = Folder::new();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let words = "render demo:furnace --size 8x8 --indirect none --frames 1-3 -o frame.png --adapter cpu --quiet";
    let status = folder.program().args(words.split_whitespace()).stdout(writer).status().unwrap();
    assert_eq!((status.code(), folder.names("").len()), (Some(0), 3));
}

#[test]
fn gpu_a_gif_file_holds_all_frames() {
    let folder = Folder::new();
    let ran = folder.render("demo:cornell --size 24x16 --indirect none --quiet -o turn.gif --orbit 3");
    assert_eq!((ran.stdout.as_str(), folder.names("")), ("turn.gif\n", vec!["turn.gif".to_owned()]));
    // Each frame has a block that says how long it is shown.
    let file = folder.read("turn.gif");
    let count = |part: &[u8]| file.windows(part.len()).filter(|bytes| *bytes == part).count();
    assert_eq!((&file[..6], count(b"\x21\xf9\x04")), (&b"GIF89a"[..], 3));
}

/// A camera that moves through rain for a second. With automatic exposure, each image alone would be metered differently. Few
/// rays, and few samples of each entry of the radiance cache.
const WALK: &str = "scene = \"demo:cornell\"
[output]
output = \"out/walk.png\"
size = [32, 18]
[lights]
lights = \"rain:30\"
[track]
interpolation = \"catmull-rom\"
keyframes = [
    { time = 0, eye = [0, 1, 3], target = [0, 1, 0], fov-y = 40 },
    { time = 0.4, eye = [0.6, 1.1, 2.5], target = [0, 1, 0], fov-y = 50 },
    { time = 1, eye = [0.2, 0.5, 0.9], target = [0, 0.4, 0], fov-y = 60 },
]
[indirect]
indirect-rays = 1
first-rays = 1
glossy-rays = 1
cache-samples = 2
[run]
adapter = \"cpu\"
";

/// A folder with the shot and a folder for images.
fn walk() -> Folder {
    let folder = Folder::with(&[("walk.toml", WALK)]);
    fs::create_dir(folder.path("out")).unwrap();
    folder
}

/// The images of a folder, by name.
fn renderings(folder: &Folder) -> BTreeMap<String, Vec<u8>> {
    folder.names("out").into_iter().map(|name| (name.clone(), folder.read(&format!("out/{name}")))).collect()
}

/// Frames of `walk.toml` in chunks equal those of all in one run, which are returned with what that run says.
fn in_chunks(words: &str, whole: &str, chunks: &[&str]) -> (BTreeMap<String, Vec<u8>>, String) {
    let (complete, parts) = (walk(), walk());
    let said = complete.done(&format!("render walk.toml {words} --frames {whole}")).stderr;
    for chunk in chunks {
        parts.done(&format!("render walk.toml {words} --frames {chunk}"));
    }
    let complete = renderings(&complete);
    assert!(complete == renderings(&parts), "{:?}", complete.keys());
    (complete, said)
}

#[test]
#[ignore = "full"]
fn gpu_frames_do_not_depend_on_other_frames() {
    // The last first.
    let (frames, said) = in_chunks("--fps 6", "1-6", &["5-6", "2-4", "1-1"]);
    assert!(said.contains("metered at 0 s"), "{said}");
    let names: Vec<_> = (1..=6).map(|number| format!("walk.{number:04}.png")).collect();
    assert!(frames.keys().eq(&names), "{:?}", frames.keys());
    // Negative control: frames differ.
    assert!(frames.values().collect::<Vec<_>>().windows(2).all(|pair| pair[0] != pair[1]));

    // Motion is relative to the previous frame's time, which is rendered first.
    let motion = "--debug-view motion";
    let (frames, said) = in_chunks(motion, "1-4", &["4-4", "1-3"]);
    assert!(said.contains("scale of motion: pixels to the right") && frames.len() == 4, "{said}");
    let folder = walk();
    folder.done(&format!("render walk.toml {motion} --time 0.16666667 -o out/a.png"));
    let still = folder.read("out/a.png");
    assert!(still == frames["walk.0004.png"], "a still is the frame of its time");
    // Negative control: another frame rate gives other motion, and without a time there is none.
    folder.done(&format!("render walk.toml {motion} --time 0.16666667 --fps 12 -o out/a.png"));
    assert!(folder.read("out/a.png") != still);
    let ran = folder.render("demo:cornell --size 32x18 --debug-view motion -o out/a.png");
    assert!(ran.stderr.contains("--time SECONDS or --frames A-B"), "{ran:?}");
}

/// With history a frame depends on those that the same run rendered before it, and its file says how many these were.
#[test]
#[ignore = "full"]
fn gpu_a_file_says_how_many_frames_of_history_it_has() {
    let folder = walk();
    let render =
        |words: &str| drop(folder.done(&format!("render walk.toml --size 16x9 --fps 12 --history on {words}")));
    let texts = |name: &str| {
        let read = if name.ends_with("png") { read_png_texts } else { read_exr_attributes };
        read(&folder.path(&format!("out/{name}"))).unwrap()
    };
    let frames = |name: &str| texts(name)["lanternfish.history-frames"].clone();

    let counted = "--seed 5 --accumulate 2 --frames";
    render(&format!("{counted} 1-3 -o out/a.exr"));
    assert_eq!(["a.0001.exr", "a.0002.exr", "a.0003.exr"].map(frames), ["0", "1", "2"]);
    let (last, bytes) = (texts("a.0003.exr"), folder.read("out/a.0003.exr"));
    for (name, value) in [
        ("Software", concat!("lanternfish ", env!("CARGO_PKG_VERSION"))),
        ("lanternfish.indirect", "sampled"),
        ("lanternfish.history", "on"),
        ("lanternfish.accumulate", "2"),
        ("lanternfish.seed", "5"),
    ] {
        assert_eq!(last[name], value, "{name}");
    }
    render(&format!("{counted} 1-3 -o out/a.exr"));
    assert!(folder.read("out/a.0003.exr") == bytes, "same command, same bytes");
    // The third frame alone is another image, and says why.
    render(&format!("{counted} 3-3 -o out/b.exr"));
    assert!(frames("b.0003.exr") == "0" && folder.exr("out/b.0003.exr") != folder.exr("out/a.0003.exr"));

    // The frame that was metered is part of the history.
    render("--indirect none --frames 0-2 -o out/c.png");
    assert_eq!(["c.0000.png", "c.0002.png"].map(frames), ["0", "2"]);
    render("--indirect none --frames 2-2 -o out/c.png");
    assert_eq!(frames("c.0002.png"), "1");
    // For two eyes, and after a frame that was skipped.
    render("--indirect none --stereo vive --stereo-layout layers --frames 1-2 -o out/e.exr");
    assert_eq!(frames("e.0002.exr"), "1");
    render("--indirect none --frames 1-1 -o out/f.exr");
    render("--indirect none --frames 1-2 --skip-existing -o out/f.exr");
    assert_eq!(frames("f.0002.exr"), "0");

    for name in ["out/c.0002.png", "out/e.0002.exr"] {
        let said = folder.done(&format!("info {name}")).stdout;
        assert!(said.lines().any(|line| line == "lanternfish.history-frames  1"), "{said}");
        assert!(said.starts_with("Software ") && said.lines().count() == 6, "{said}");
    }
    write_png(&folder.path("out/plain.png"), [1, 1], ColorType::Rgb, &[7; 3]).unwrap();
    assert_eq!(folder.done("info out/plain.png").stdout, "the file does not say how it was made\n");
}

#[test]
fn gpu_complete_frames_are_skipped() {
    let folder = walk();
    let render = |words: &str| {
        folder.done(&format!("render walk.toml --size 16x9 --indirect none --frames 1-4 --skip-existing {words}"))
    };
    let name = |number: u32| format!("out/walk.{number:04}.png");
    let first = render("");
    assert!(first.stdout.lines().count() == 4 && !first.stderr.contains("exist and"), "{first:?}");
    let complete = renderings(&folder);
    // One is missing, one is truncated, one has another size; the fourth stays untouched.
    let modified = || fs::metadata(folder.path(&name(4))).unwrap().modified().unwrap();
    let marked = modified();
    fs::remove_file(folder.path(&name(1))).unwrap();
    folder.write(&name(2), &folder.read(&name(2))[..100]);
    write_png(&folder.path(&name(3)), [16, 8], ColorType::Rgb, &[7; 16 * 8 * 3]).unwrap();
    let again = render("");
    assert!(again.stderr.contains("1 of 4 images exist and are complete"), "{again:?}");
    assert_eq!(again.stdout, first.stdout, "all paths are printed");
    assert!(renderings(&folder) == complete && modified() == marked);
    // Nothing is left to do, so not even the scene is read.
    folder.write("walk.toml", WALK.replace("demo:cornell", "gone.glb"));
    assert_eq!(render("").stdout, first.stdout);
}

/// A pyramid with four equal sides, without light of its own.
const PYRAMID: &str = "v -1 -0.2 -1\nv 1 -0.2 -1\nv 1 -0.2 1\nv -1 -0.2 1\nv 0 0.9 0\n\
                       f 1 2 3 4\nf 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\n";

#[test]
#[ignore = "full"]
fn gpu_an_orbit_ends_before_its_first_image() {
    let folder =
        Folder::with(&[("pyramid.obj", PYRAMID), ("turn.toml", "scene = \"pyramid.obj\"\n[track]\norbit = 4\n")]);
    let ran = folder.render("turn.toml");
    let frames = ["turn.0001.png", "turn.0002.png", "turn.0003.png", "turn.0004.png"];
    assert_eq!(ran.stdout.lines().collect::<Vec<_>>(), frames);
    assert!(ran.stderr.contains("metered in frame 1") && ran.stderr.contains("built-in studio"), "{ran:?}");
    folder.render("pyramid.obj -o still.png");
    assert!(folder.png("still.png") == folder.png(frames[0]), "frame 1 is the image without an orbit");
    // Each frame shows the next of four equal sides, in the same light: the studio revolves with the camera.
    let pixels = frames.map(|name| folder.png(name).pixels);
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().sum::<f32>();
    for frame in &pixels[1..] {
        let difference: f32 = pixels[0].iter().flatten().zip(frame.iter().flatten()).map(|(a, b)| (a - b).abs()).sum();
        assert!(difference < 0.02 * sum(&pixels[0]), "{difference} of {}", sum(&pixels[0]));
    }
    // A part is the same as the whole, to the bit, and a complete orbit is skipped.
    folder.render("turn.toml --frames 2-3 -o part.png");
    for number in [2, 3] {
        assert!(folder.read(&format!("part.000{number}.png")) == folder.read(&format!("turn.000{number}.png")));
    }
    let ran = folder.render("turn.toml --skip-existing");
    assert!(ran.stderr.contains("4 of 4 images exist and are complete"), "{ran:?}");
    assert_eq!(folder.done("frames turn.toml 1-4 --size 48x32").stdout, "4 of 4 frames are complete\n");
    // Negative control: light that stays shows which side is which.
    folder.render("pyramid.obj --sun 1,-0.5,0.2,3 --orbit 2 --indirect none -o sun.png");
    let [front, back] = ["sun.0001.png", "sun.0002.png"].map(|name| sum(&folder.png(name).pixels));
    assert!((front - back).abs() > 0.05 * front, "{front} and {back}");
}

#[test]
#[ignore = "full"]
fn gpu_a_killed_chunk_is_completed() {
    let (complete, parts) = (walk(), walk());
    for folder in [&complete, &parts] {
        // Frames that take some time.
        folder.write("walk.toml", format!("{WALK}[technique]\naccumulate = 4\n"));
    }
    complete.done("render walk.toml --fps 12 --frames 1-12");
    assert_eq!(complete.done("frames walk.toml 1-12").stdout, "12 of 12 frames are complete\n");

    parts.done("render walk.toml --fps 12 --frames 1-4");
    let words = "render walk.toml --fps 12 --frames 5-12 --skip-existing";
    let mut chunk = parts.program().args(words.split(' ')).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(chunk.stdout.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().ends_with("walk.0006.png")), "a frame is printed when its file exists");
    // Kill at once, without time to clean up.
    chunk.kill().unwrap();
    chunk.wait().unwrap();
    parts.write("out/walk.0002.png", &parts.read("out/walk.0002.png")[..500]);

    let verified = parts.run("frames walk.toml 1-12");
    let said = verified.stdout;
    assert_eq!(verified.code, Some(1), "{said}");
    assert!(said.contains("broken   out/walk.0002.png: ") && said.contains("missing  out/walk.0012.png\n"), "{said}");
    assert!(said.lines().last().unwrap().contains(" of 12 frames are complete; still to do: 2, "), "{said}");

    let ran = parts.done("render walk.toml --fps 12 --frames 1-12 --skip-existing");
    assert!(ran.stderr.contains("of 12 images exist and are complete"), "{ran:?}");
    let (complete, mut parts) = (renderings(&complete), renderings(&parts));
    // Temporary files of the killed process.
    parts.retain(|name, _| !name.starts_with(".lanternfish-"));
    assert!(complete == parts && complete.len() == 12);
}

/// What is missing and broken is printed; `src/frames.rs` has what counts as such.
#[test]
fn missing_frames_are_printed() {
    let folder = walk();
    write_png(&folder.path("out/walk.0002.png"), [32, 18], ColorType::Rgb, &[7; 32 * 18 * 3]).unwrap();
    folder.write("out/walk.0003.png", "no image");
    let ran = folder.run("frames walk.toml 1-3");
    assert!(
        ran.code == Some(1) && ran.stdout.starts_with("missing  out/walk.0001.png\nbroken   out/walk.0003.png: "),
        "{ran:?}"
    );
    assert_eq!(ran.stdout.lines().last(), Some("1 of 3 frames are complete; still to do: 1, 3"));
}
