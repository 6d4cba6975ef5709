//! The files of `reference` and `merge`.

use std::collections::BTreeMap;

use lanternfish_metrics::{RgbImage, exr_layers, read_exr, read_exr_attributes, read_exr_layer, write_exr};

use crate::testing::Place;

/// Traces the Cornell box in few pixels.
#[track_caller]
fn trace(place: &Place, words: &str) {
    place.done(&format!("reference demo:cornell --size 16x16 --quiet {words}"));
}

fn attributes(place: &Place, name: &str) -> BTreeMap<String, String> {
    let attributes = read_exr_attributes(&place.path(name)).unwrap();
    attributes
        .into_iter()
        .filter_map(|(name, text)| Some((name.strip_prefix("lanternfish.")?.to_owned(), text)))
        .collect()
}

fn samples(place: &Place, name: &str) -> u64 {
    attributes(place, name)["samples"].parse().unwrap()
}

fn image(place: &Place, name: &str) -> RgbImage {
    read_exr(&place.path(name)).unwrap()
}

fn values(image: &RgbImage) -> impl Iterator<Item = f32> {
    image.pixels.iter().flatten().copied()
}

fn sum(image: &RgbImage) -> f64 {
    values(image).map(f64::from).sum()
}

#[test]
fn the_file_has_mean_variance_and_settings() {
    let place = Place::new();
    trace(&place, "--spp 8 --seed 3 --max-depth 3 -o %a.exr --variance %v.exr");
    assert!(place.contents().keys().eq(["a.exr", "v.exr"]));
    assert_eq!(exr_layers(&place.path("a.exr")).unwrap(), ["", "variance"]);
    let told = attributes(&place, "a.exr");
    for (name, value) in [
        ("samples", "8"),
        ("seed", "3"),
        ("dropped", "0"),
        ("scene", "demo:cornell"),
        ("size", "16x16"),
        ("integrator", "path"),
        ("max-depth", "3"),
        ("light-choice", "tree"),
        ("light-paths", "on"),
    ] {
        assert_eq!(told[name], value, "{name}");
    }
    assert_eq!(told["fingerprint"].len(), 16);
    let (mean, variance) = (image(&place, "a.exr"), read_exr_layer(&place.path("a.exr"), "variance").unwrap());
    assert_eq!((mean.width, mean.height), (16, 16));
    for image in [&mean, &variance] {
        assert!(values(image).all(|value| value.is_finite() && value >= 0.0) && values(image).any(|value| value > 0.0));
    }
    assert_eq!(image(&place, "v.exr"), variance);
    // The seed alone makes the noise: display settings do not affect the file.
    trace(&place, "--spp 8 --seed 3 --max-depth 3 --exposure 2 -o %b.exr");
    assert!(place.read("b.exr") == place.read("a.exr"));
    trace(&place, "--spp 8 --seed 4 --max-depth 3 -o %c.exr");
    assert!(image(&place, "c.exr") != mean);
}

#[test]
fn a_resumed_run_equals_an_uninterrupted_one() {
    let place = Place::new();
    trace(&place, "--spp 32 -o %whole.exr");
    for spp in [1, 12, 32] {
        trace(&place, &format!("--spp {spp} --resume -o %parts.exr"));
    }
    assert_eq!(samples(&place, "parts.exr"), 32);
    let read = |name: &str, layer: &str| read_exr_layer(&place.path(name), layer).unwrap();
    // The mean is rounded to 24 bits twice. The variance is a difference of squares, so the mean's rounding errors grow by the
    // ratio of mean to variance.
    for (layer, relative, absolute) in [("", 1e-5, 0.0), ("variance", 1e-3, 1e-9)] {
        for (whole, part) in values(&read("whole.exr", layer)).zip(values(&read("parts.exr", layer))) {
            assert!((whole - part).abs() <= relative * whole + absolute, "{layer}: {whole} {part}");
        }
    }
    // The file has enough samples already.
    let before = place.read("parts.exr");
    trace(&place, "--spp 10 --resume -o %parts.exr");
    assert!(place.read("parts.exr") == before);
}

#[test]
fn a_run_with_other_settings_is_not_resumed() {
    let place = Place::with(&[("c.exr", "no image")]);
    place.done("reference demo:cornell --size 32x32 --spp 2 --seed 5 -o %a.exr");
    write_exr(&place.path("b.exr"), &image(&place, "a.exr")).unwrap();
    for (words, why) in [
        ("--size 32x16 -o %a.exr", "size is 32x32 there and 32x16 here | hint"),
        ("--size 32x32 --max-depth 2 -o %a.exr", "max-depth is unlimited there and 2 here | hint"),
        ("--size 32x32 --eye 0,1,3 -o %a.exr", "eye is | hint"),
        ("--size 32x32 --point 0,1,0,5 -o %a.exr", "content differs | hint"),
        ("--size 32x32 --seed 6 -o %a.exr", "its seed is 5, not 6 | hint"),
        ("-o %b.exr", "not an image of `lanternfish reference`"),
        ("-o %c.exr", "c.exr"),
        ("-o %d.png", "end the name with .exr"),
    ] {
        place.refuses(&[(&format!("reference demo:cornell --resume {words}"), why)]);
    }
    // Without a seed, the file's is used.
    place.done("reference demo:cornell --size 32x32 --spp 4 --resume -o %a.exr");
    assert_eq!(attributes(&place, "a.exr")["seed"], "5");
}

#[test]
fn it_stops_at_an_error_or_a_count() {
    let place = Place::new();
    let mut few = 15;
    for error in [0.3, 0.15] {
        trace(&place, &format!("--max-depth 2 -o %a.exr --until-error {error}"));
        let (noise, count) = (attributes(&place, "a.exr")["noise"].parse::<f64>().unwrap(), samples(&place, "a.exr"));
        assert!(noise <= error && count > few, "{noise} {count}");
        few = count;
    }
    trace(&place, "--max-depth 2 -o %a.exr --until-error 1e-6 --spp 20");
    assert_eq!(samples(&place, "a.exr"), 20);
}

/// Two rows of many pixels that all see walls: each row takes longer than the time limit.
#[test]
fn a_time_limit_binds_within_a_row() {
    let place = Place::new();
    let run = |words: &str| {
        place.done(&format!("reference demo:cornell --size 16384x2 --eye 0,1,0.5 --target 0,1,-1 --quiet {words}"));
    };
    // No machine traces sixteen thousand paths on a core in two milliseconds.
    run("--time-limit 0.002 -o %cut.exr");
    assert_eq!(samples(&place, "cut.exr"), 0);
    // Resumed, it equals a single run.
    run("--spp 1 --resume -o %cut.exr");
    run("--spp 1 -o %whole.exr");
    assert!(image(&place, "cut.exr") == image(&place, "whole.exr") && samples(&place, "cut.exr") == 1);
}

/// The fingerprint covers everything that affects the image but the seed of the noise.
#[test]
fn rain_follows_its_seed_and_the_time() {
    let place = Place::new();
    let of = |words: &str| {
        trace(&place, &format!("--lights rain:5 --spp 1 -o %a.exr {words}"));
        attributes(&place, "a.exr")["fingerprint"].clone()
    };
    let first = of("");
    assert_eq!(["--seed 4", "--time 0"].map(of), [first.clone(), first.clone()]);
    assert!(of("--rain-seed 4") != first && of("--time 0.5") != first);
}

#[test]
fn merged_parts_equal_a_single_run_to_the_byte() {
    let place = Place::new();
    trace(&place, "--spp 24 --seed 3 -o %whole.exr");
    // Any division, traced in any order.
    for range in ["8-17", "1-7", "18-24", "1-24"] {
        trace(&place, &format!("--samples {range} --seed 3 -o %{range}.exr"));
    }
    assert_eq!(samples(&place, "8-17.exr"), 10);
    // In steps, too: a result without the first sample is a part. A part with all samples loses its sums.
    place.done("merge %8-17.exr %18-24.exr -o %late.exr");
    for parts in ["%18-24.exr %1-7.exr %8-17.exr", "%late.exr %1-7.exr", "%1-24.exr"] {
        place.done(&format!("merge {parts} -o %merged.exr"));
        assert!(place.read("merged.exr") == place.read("whole.exr"), "{parts}");
    }
    assert_eq!(exr_layers(&place.path("merged.exr")).unwrap(), ["", "variance"]);
    // Negative control: two parts differ.
    assert!(image(&place, "1-7.exr") != image(&place, "18-24.exr"));
    // A part that has enough samples is read and written unchanged; it is resumed as itself only.
    let before = place.read("8-17.exr");
    trace(&place, "--samples 8-17 --seed 3 --resume -o %8-17.exr");
    assert!(place.read("8-17.exr") == before);
    let resumed = "reference demo:cornell --size 16x16 --seed 3 --resume -o %8-17.exr";
    place.refuses(&[
        (&format!("{resumed} --samples 8-18"), "it is of samples 8-17, not of samples 8-18"),
        (&format!("{resumed} --spp 20"), "it is of samples 8-17, not of all samples"),
    ]);
}

#[test]
fn parts_of_different_ground_truths_are_not_merged() {
    let place = Place::new();
    for (name, words) in [
        ("a", "--samples 1-2"),
        ("b", "--samples 3-4"),
        ("c", "--samples 4-5"),
        ("d", "--samples 6-6"),
        ("seed", "--samples 3-4 --seed 9"),
        ("depth", "--samples 3-4 --max-depth 2"),
        ("light", "--samples 3-4 --point 0,1,0,5"),
        ("whole", "--spp 2"),
    ] {
        trace(&place, &format!("{words} -o %{name}.exr"));
    }
    place.write("cut.exr", &place.read("b.exr")[..5000]);
    place.refuses(&[
        ("merge %a.exr %b.exr %c.exr -o %o.exr", "b.exr and | c.exr: both have samples 4-4"),
        ("merge %a.exr %a.exr -o %o.exr", "both have samples 1-2"),
        ("merge %d.exr %a.exr -o %o.exr", "samples 3-5 are in none of the parts"),
        ("merge %a.exr %seed.exr -o %o.exr", "seed.exr: not of the same ground truth as | a.exr: its seed is 9, not 0"),
        ("merge %a.exr %depth.exr -o %o.exr", "max-depth is 2 there and unlimited in the other"),
        ("merge %a.exr %light.exr -o %o.exr", "the scene's content differs"),
        ("merge %a.exr %whole.exr -o %o.exr", "whole.exr: not a part of a ground truth"),
        ("merge %a.exr %gone.exr -o %o.exr", "gone.exr"),
        ("merge %a.exr %cut.exr -o %o.exr", "cut.exr"),
        ("merge %a.exr %b.exr -o %a.exr", "both a part and the merged image"),
        ("merge %a.exr %b.exr -o %o.png", ".exr"),
    ]);
}

#[test]
fn integrators_render_their_quantities() {
    let place = Place::new();
    let mean = |words: &str| {
        trace(&place, &format!("--spp 16 -o %a.exr {words}"));
        image(&place, "a.exr")
    };
    let normal = mean("--integrator normal --size 32x32");
    let is_normal = |p: &[f32; 3]| {
        let n = p.map(|v| 2.0 * v - 1.0);
        (n.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-3
    };
    assert!(normal.pixels.iter().filter(|p| is_normal(p)).count() > 700, "most of the image is inside a face");
    let occlusion = mean("--integrator occlusion");
    assert!(values(&occlusion).all(|value| (0.0..=1.0).contains(&value)));
    // Distant surfaces occlude less. Within a millimetre there are occluders at edges only.
    let [near, far] = ["0.001", "1"].map(|most| mean(&format!("--integrator obscurance --max-distance {most}")));
    assert!(sum(&occlusion) < sum(&far) && sum(&far) < sum(&near) && sum(&near) > 0.99 * 3.0 * 256.0);
    // Indirect light adds energy.
    let [direct, bounced] = ["2", "3"].map(|depth| mean(&format!("--max-depth {depth}")));
    assert!(sum(&direct) > 0.0 && sum(&bounced) > 1.05 * sum(&direct), "{} {}", sum(&direct), sum(&bounced));
}

#[test]
fn a_shot_sets_the_image() {
    let shot = "scene = \"demo:cornell\"
        [output]
        output = \"shot.png\"
        size = [16, 8]
        [lights]
        point = [[0, 1, 0, 5]]
        [technique]
        shadows = \"none\"
        [look]
        materials = \"lambert\"
        debug-view = \"nan\"
        [track]
        frames = 9
        keyframes = [{ time = 0, eye = [0, 1, 3], target = [0, 1, 0] }, { time = 1, eye = [0, 1, 2.5], target = [0, 1, 0] }]
        [run]
        quiet = true";
    let place = Place::with(&[("night.toml", shot)]);
    place.done("reference %night.toml --spp 2 -o %a.exr");
    let image = image(&place, "a.exr");
    assert_eq!((image.width, image.height), (16, 8));
    let told = attributes(&place, "a.exr");
    assert_eq!((&told["materials"][..], &told["eye"][..]), ("lambert", "0,1,3"));
    place.done("reference %night.toml --spp 2 --time 1 --size 4x4 -o %b.exr");
    assert_eq!(attributes(&place, "b.exr")["eye"], "0,1,2.5");
    assert!(place.contents().keys().eq(["a.exr", "b.exr", "night.toml"]));
}

#[test]
fn a_file_without_light_gets_the_light_of_render() {
    let place = Place::with(&[("a.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n")]);
    let run = |words: &str| {
        place.done(&format!("reference %a.obj --size 32x32 --spp 16 {words} -o %a.exr"));
        image(&place, "a.exr")
    };
    let studio = run("--view front");
    // A white sheet before the backdrop, 80 % of the image wide.
    let (sheet, backdrop) = (studio.pixels[16 * 32 + 16][1], studio.pixels[16 * 32 + 1][1]);
    assert!(sheet > 0.5 && (0.1..0.4).contains(&backdrop), "{sheet}, {backdrop}");
    let wide = (0..32).filter(|x| studio.pixels[16 * 32 + x][1] > 0.5).count();
    assert!((24..=26).contains(&wide), "{wide} of 32 pixels");
    assert_eq!(sum(&run("--light-rig none")), 0.0);
}
