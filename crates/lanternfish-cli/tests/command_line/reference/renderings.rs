//! The contents of the images, compared with those of `render`.

use lanternfish_metrics::read_png;

use super::*;

#[test]
fn integrators_render_their_quantities() {
    let folder = tempfile::tempdir().unwrap();
    let mean = |words: &str| {
        cornell(folder.path(), &format!("--spp 16 -o a.exr {words}"));
        read_exr(&folder.path().join("a.exr")).unwrap()
    };
    let normal = mean("--integrator normal");
    let is_normal = |p: &[f32; 3]| {
        let n = p.map(|v| 2.0 * v - 1.0);
        (n.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-3
    };
    assert!(normal.pixels.iter().filter(|p| is_normal(p)).count() > 700, "most of the image is inside a face");
    let occlusion = mean("--integrator occlusion");
    assert!(values(&occlusion).all(|value| (0.0..=1.0).contains(&value)));
    // Distant surfaces occlude less. Within a millimetre there are occluders at edges only.
    let sum = |image: &RgbImage| values(image).map(f64::from).sum::<f64>();
    let (near, far) =
        (mean("--integrator obscurance --max-distance 0.001"), mean("--integrator obscurance --max-distance 1"));
    assert!(sum(&occlusion) < sum(&far) && sum(&far) < sum(&near) && sum(&near) > 0.99 * 3.0 * 1024.0);
    // Indirect light adds energy.
    let (direct, bounced) = (mean("--max-depth 2"), mean("--max-depth 3"));
    assert!(sum(&direct) > 0.0 && sum(&bounced) > 1.05 * sum(&direct), "{} {}", sum(&direct), sum(&bounced));
}

#[test]
fn a_shot_sets_the_image() {
    let folder = tempfile::tempdir().unwrap();
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
    fs::write(folder.path().join("night.toml"), shot).unwrap();
    let run = |words: &str| {
        let output = output(folder.path(), &format!("reference night.toml --spp 2 {words}"));
        assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
        text(&output.stdout).to_owned()
    };
    assert_eq!(run(""), "night.reference.exr\n");
    let image = read_exr(&folder.path().join("night.reference.exr")).unwrap();
    assert_eq!((image.width, image.height), (16, 8));
    let attributes = read_exr_attributes(&folder.path().join("night.reference.exr")).unwrap();
    assert_eq!((&attributes["lanternfish.materials"][..], &attributes["lanternfish.eye"][..]), ("lambert", "0,1,3"));
    run("--time 1 --size 4x4 -o b.exr");
    assert_eq!(read_exr_attributes(&folder.path().join("b.exr")).unwrap()["lanternfish.eye"], "0,1,2.5");
    assert_eq!(names(folder.path()), ["b.exr", "night.reference.exr", "night.toml"]);
}

#[test]
fn gpu_a_png_has_the_colours_of_render() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("empty.gltf"), r#"{ "asset": { "version": "2.0" } }"#).unwrap();
    let png = |command: &str, words: &str| {
        let line = format!("{command} empty.gltf --quiet --size 4x4 -o a.png {words}");
        let output = output(folder.path(), &line);
        assert!(output.status.success(), "{}", text(&output.stderr));
        read_png(&folder.path().join("a.png")).unwrap()
    };
    for curve in ["none", "neutral", "reinhard", "aces"] {
        for (sky, exposure) in
            [("0.02,0.3,0.9", "0"), ("1,0.5,0.001", "1.5"), ("40,3,0", "-1"), ("0.0001,0.7,0.1", "-0.3")]
        {
            let words = format!("--sky {sky} --tone-map {curve} --exposure {exposure}");
            let (ours, theirs) =
                (png("reference", &format!("{words} --spp 1")), png("render --adapter cpu --indirect none", &words));
            // One step of 255, where half-precision floats round the other way.
            for (a, b) in values(&ours).zip(values(&theirs)) {
                assert!((a - b).abs() <= 1.01 / 255.0, "{words}: {a} {b}");
            }
        }
    }
}

#[test]
fn gpu_a_png_has_the_exposure_of_render() {
    let folder = tempfile::tempdir().unwrap();
    let ev = |line: &str| {
        let output = output(folder.path(), &format!("{line} --size 64x48 -o a.png"));
        let said = text(&output.stderr).to_owned();
        assert!(output.status.success(), "{said}");
        let ev = said.split("shown at ").nth(1).and_then(|rest| rest.split(' ').next()).map(str::parse::<f32>);
        ev.unwrap_or_else(|| panic!("{said}")).unwrap()
    };
    // Lamps beside which the box's own lamp, which only the reference includes, is negligible.
    for point in ["0,1,0,20", "0,1,0,1000", "0,1,0,100000"] {
        let render = ev(&format!("render demo:cornell --adapter cpu --indirect none --point {point}"));
        let reference = ev(&format!("reference demo:cornell --max-depth 2 --spp 64 --point {point}"));
        // Two metering steps, for noise and edges.
        assert!((render - reference).abs() <= 0.25, "{point}: {render} {reference}");
    }
}

#[test]
fn a_file_without_light_gets_the_light_of_render() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    fs::write(&path, "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n").unwrap();
    let run = |words: &str| {
        let output = output(folder.path(), &format!("reference a.obj --size 32x32 --spp 16 {words} -o a.exr"));
        assert!(output.status.success(), "{}", text(&output.stderr));
        (read_exr(&folder.path().join("a.exr")).unwrap(), text(&output.stderr).to_owned())
    };
    let (studio, stderr) = run("--view front");
    assert!(stderr.contains("studio") && !stderr.contains("little or no light"), "{stderr}");
    // A white sheet before the backdrop, 80 % of the image wide.
    let (sheet, backdrop) = (studio.pixels[16 * 32 + 16][1], studio.pixels[16 * 32 + 1][1]);
    assert!(sheet > 0.5 && (0.1..0.4).contains(&backdrop), "{sheet}, {backdrop}");
    let wide = (0..32).filter(|x| studio.pixels[16 * 32 + x][1] > 0.5).count();
    assert!((24..=26).contains(&wide), "{wide} of 32 pixels");
    let (dark, stderr) = run("--light-rig none");
    assert!(values(&dark).all(|value| value == 0.0) && stderr.contains("little or no light"), "{stderr}");
}

#[test]
fn rain_follows_the_time() {
    let folder = tempfile::tempdir().unwrap();
    // The fingerprint covers everything that affects the image.
    let fingerprint = |words: &str| {
        cornell(folder.path(), &format!("--lights rain:5 --spp 1 -o a.exr {words}"));
        let attributes = read_exr_attributes(&folder.path().join("a.exr")).unwrap();
        attributes["lanternfish.fingerprint"].clone()
    };
    let (now, then) = (fingerprint(""), fingerprint("--time 0.5"));
    assert!(now != then && fingerprint("--time 0") == now && fingerprint("--time 0.5") == then);
}
