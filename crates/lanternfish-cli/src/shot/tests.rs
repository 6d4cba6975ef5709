mod recordings;
mod written;

use std::{collections::BTreeSet, fs};

use clap::CommandFactory;
use glam::Vec3;
use lanternfish::{
    settings::{Culling, DebugView, Exposure, ToneMap},
    techniques::{TileSize, Tiled},
};
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Viewpoint, rig::LightRig};

use super::*;
use crate::{args::keys::Key, cli::Cli, parse::LightSet};

/// The shot of this text, in a separate folder, with these flags.
fn shot(text: &str, flags: &str) -> Result<Shot, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shot.toml");
    fs::write(&path, text).unwrap();
    let line = ["lanternfish", "render", "shot.toml"].into_iter().chain(flags.split_whitespace());
    let matches = Cli::command().try_get_matches_from(line).unwrap();
    let shot =
        read_with(&path, Given::of(matches.subcommand().unwrap().1)).and_then(|shot| shot.check().map(|()| shot));
    shot.map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

/// The text of the shot, and of the shot parsed from it.
fn twice(shot_: &Shot) -> (String, String) {
    let first = text(shot_);
    let second = text(&shot(&first, "").unwrap());
    (first, second)
}

fn text(shot: &Shot) -> String {
    write::text(shot, None).unwrap()
}

const TRACK: &str = "scene = \"demo:cornell\"
[track]
interpolation = \"catmull-rom\"
keyframes = [
    { time = 0, eye = [0, 0, 4], target = [0, 1, 0], fov-y = 40 },
    { time = 1.5, eye = [1, 0, 4], target = [0, 1, 0], fov-y = 50 },
    { time = 2, eye = [3, 0, 4], target = [0, 1, 0], fov-y = 45 },
]
";

/// A way of placing the camera on the command line replaces the shot's.
#[test]
fn ways_of_placing_the_camera_replace_each_other() {
    let by_eye = "scene = \"a.glb\"\n[view]\neye = [1, 2, 3]\ntarget = [0, 0, 0]\nfov-y = 40\n";
    let turned = shot(by_eye, "--azimuth 30").unwrap().args.view;
    assert_eq!((turned.eye, turned.target, turned.azimuth.is_some()), (None, None, true));
    let lens = shot(by_eye, "--intrinsics 100,100,50,50").unwrap().args.view;
    assert!(lens.fov_y.is_none() && lens.intrinsics.is_some() && lens.eye.is_some());
    let posed = shot(by_eye, "--pose 1,0,0,0,0,1,0,0,0,0,1,5,0,0,0,1").unwrap().args.view;
    assert!(posed.eye.is_none() && posed.target.is_none() && posed.pose.is_some());
    let by_pose =
        "scene = \"a.glb\"\n[view]\npose = \"1,0,0,0,0,1,0,0,0,0,1,5,0,0,0,1\"\npose-convention = \"opencv\"\n";
    let placed = shot(by_pose, "--eye 1,2,3").unwrap().args.view;
    assert_eq!((placed.pose, placed.pose_convention), (None, Default::default()));
    let text = "scene = \"a.glb\"\n[view]\nview = \"top\"\n[lights]\nlight-rig = \"sun\"\n";
    let args = shot(text, "").unwrap().args;
    assert_eq!((args.view.view, args.lights.light_rig), (Some(Viewpoint::Top), Some(LightRig::Sun)));
    let view = shot(text, "--eye 1,2,3").unwrap().args.view;
    assert_eq!((view.view, view.eye), (None, Some(Vec3::new(1.0, 2.0, 3.0))));
    let view = shot(TRACK, "--view left").unwrap().views().swap_remove(0);
    assert_eq!(
        (view.view, view.eye, view.target, view.fov_y),
        (Some(Viewpoint::Left), None, None, Some(40f32.to_radians()))
    );
    let view = shot("scene = \"a.glb\"\n[view]\neye = [1, 2, 3]\ncamera = \"0\"", "--view left").unwrap().args.view;
    assert_eq!((view.view, view.eye, view.camera), (Some(Viewpoint::Left), None, None));
}

#[test]
fn every_flag_has_one_key() {
    let command = Cli::command();
    // A shot is of one scene.
    let flags = command.find_subcommand("render").unwrap().get_opts().map(|arg| arg.get_id());
    let flags: BTreeSet<_> = flags.filter(|id| *id != "thumbnails").collect();
    let known = keys();
    assert_eq!(known.len(), flags.len());
    for (i, key) in known.iter().enumerate() {
        let same = |other: &&Key| (&other.table, &other.name) == (&key.table, &key.name);
        assert_eq!(known[i..].iter().filter(same).count(), 1, "{}.{}", key.table, key.name);
    }
    let tables: BTreeSet<_> = known.iter().map(|key| key.table.as_str()).collect();
    assert_eq!(
        tables.into_iter().collect::<Vec<_>>(),
        ["indirect", "lights", "look", "output", "run", "technique", "track", "view"]
    );
}

#[test]
fn every_kind_of_value_reaches_its_flag() {
    let text = r#"
        scene = "demo:atrium"
        output = { size = [64, 48], output = "a.exr" }
        [view]
        eye = [1, -2.5, 3e0]
        target = "0,1,0"
        camera = "court"
        scene = "1"
        [lights]
        point = [[0, 1, 2, 3], "4,5,6,7,1,0.5,0,8"]
        sun = [0, -1, 0, 3]
        lights = "rain:10:0.5"
        [look]
        tone-map = "aces"
        exposure = -1
        debug-view = "normal"
        [technique]
        culling = "tiled"
        tile-size = 32
        aabb = false
        [run]
        seed = 0x10
        timings = true
        quiet = false
    "#;
    let args = shot(text, "").unwrap().args;
    assert_eq!(args.scene, "demo:atrium".into());
    assert_eq!((args.output.size.width, args.output.size.height), (64, 48));
    assert_eq!((args.view.eye, args.view.target), (Some(Vec3::new(1.0, -2.5, 3.0)), Some(Vec3::Y)));
    assert_eq!((args.view.camera.as_deref(), args.part.scene_of_file.as_deref()), (Some("court"), Some("1")));
    assert_eq!((args.lights.points.len(), args.lights.points[1].range), (2, Some(8.0)));
    assert_eq!(args.lights.sun.as_ref().unwrap().direction, Vec3::NEG_Y);
    assert_eq!(args.lights.lights, Some(LightSet::Rain { count: 10, radius: Some(0.5) }));
    assert_eq!((args.run.seed, args.run.timings, args.run.quiet), (16, true, false));
    let settings = args.settings();
    assert_eq!((settings.image.tone_map, settings.image.exposure), (ToneMap::Aces, Exposure::Ev(-1.0)));
    assert_eq!(settings.image.debug_view, Some(DebugView::Normal));
    assert_eq!(settings.culling, Culling::from(Tiled { tile_size: TileSize::Px32, aabb_test: false }));
}

/// As in the library's data, a technique's parameters may be a table under its name.
#[test]
fn a_technique_may_be_a_table() {
    let text =
        "scene = \"a.glb\"\n[indirect.sampled]\nindirect-rays = 12\n[technique.tiled]\ntile-size = 8\naabb = false\n";
    let flat = "scene = \"a.glb\"\n[indirect]\nindirect = \"sampled\"\nindirect-rays = 12\n\
                [technique]\nculling = \"tiled\"\ntile-size = 8\naabb = false\n";
    let settings = |text: &str| shot(text, "").unwrap().args.settings();
    assert_eq!(settings(text), settings(flat));
    for (from, to, words) in [
        ("indirect-rays", "indirect-ray", ["3:1: sampled has no parameter", "\"indirect-rays\""]),
        ("indirect-rays", "probe-size", ["3:1: sampled has no parameter \"probe-size\"", "help render"]),
        ("tile-size = 8", "tile-size = 9", ["5:13: tile-size = 9", "8, 16, 32"]),
        ("sampled", "sampeld", ["2:11: unknown key `sampeld`", "did you mean"]),
    ] {
        let error = shot(&text.replace(from, to), "").unwrap_err();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

/// Renamed keys and flags keep their old names for one version.
#[test]
fn renamed_keys_keep_their_old_names() {
    let entries = |text: &str, flags: &str| {
        let indirect = shot(text, flags).unwrap().args.settings().indirect;
        indirect.technique().unwrap().get("cache-entries")
    };
    let old = "scene = \"a.glb\"\n[indirect]\ncache-cells = 4096\n";
    assert_eq!(entries(old, "").as_deref(), Some("4096"));
    assert_eq!(entries(old, "--cache-cells 512").as_deref(), Some("512"));
    assert_eq!(entries(&old.replace("cells", "entries"), "").as_deref(), Some("4096"));
}

#[test]
fn mistakes_have_a_line_and_a_column() {
    for (text, words) in [
        ("", &["shot.toml:1:1: no scene", "scene = "][..]),
        ("scene = 5", &["shot.toml:1:9: scene = 5", "string"]),
        ("scene = \"other.toml\"", &["shot.toml:1:9", "not a shot"]),
        ("scene = \"a\"\nscene = \"b\"", &["shot.toml:2:1", "duplicate key"]),
        ("scene = \"a\"\n[output\n", &["shot.toml:2:8"]),
        ("scne = \"a\"", &["shot.toml:1:1: unknown key `scne`", "did you mean `scene`?"]),
        ("recording = 1", &["shot.toml: `scene` is missing", "view --record"]),
        ("[ligths]", &["shot.toml:1:2: unknown key `ligths`", "`lights`"]),
        ("output = \"a.png\"", &["shot.toml:1:1: `output` is a table", "[output]"]),
        ("[look]\n  exposre = 1", &["shot.toml:2:3: unknown key `exposre` in [look]", "`exposure`"]),
        ("[look]\nsize = 1", &["shot.toml:2:1", "`size` belongs in [output]"]),
        ("[look]\nfov_y = 1\n", &["shot.toml:2:1: unknown key `fov_y`"]),
        ("[view]\nfov_y = 1\n", &["shot.toml:2:1: unknown key `fov_y`", "`fov-y`"]),
        ("[look]\nexposure = \"bright\"", &["shot.toml:2:12: exposure = \"bright\"", "expected auto, or stops"]),
        ("[look]\nexposure = true", &["shot.toml:2:12: exposure = true", "expected auto, or stops"]),
        ("[technique]\naabb = 3", &["shot.toml:2:8: aabb = 3", "expected true or false"]),
        ("[technique]\nshadow-rays = \"many\"", &["shot.toml:2:15", "a whole number from 1 to 255"]),
        ("[look]\nexposure = nan", &["shot.toml:2:12", "stops from -64 to 64"]),
        ("[look]\ntone-map = \"asec\"", &["shot.toml:2:12", "none, neutral, reinhard, aces", "\"aces\""]),
        ("[output]\nsize = [0, 5]", &["shot.toml:2:8: size = [0, 5]", "from 1 to 16384"]),
        ("[output]\noutput = \"\"", &["shot.toml:2:10"]),
        ("[output]\nsize = 1979-05-27", &["shot.toml:2:8", "[W, H]"]),
        ("[view]\neye = [1,\n 2]", &["shot.toml:2:7: eye = [1, 2]", "three numbers"]),
        ("[view]\neye = [true]", &["shot.toml:2:7: eye = [true]", "expected [x,y,z]"]),
        ("[lights]\npoint = [0, 1, 2, 3]", &["shot.toml:2:9", "expected a list, [[x,y,z,cd[,...]], …]"]),
        ("[lights]\npoint = [[0, 1, 2, 3],\n [4]]", &["shot.toml:3:2: point = [4]", "x,y,z,cd"]),
        ("[lights]\nlights = \"rain:4000000000\"", &["shot.toml:2:10", "at most 2097152"]),
        ("[run]\ntimings = \"yes\"", &["shot.toml:2:11", "true or false"]),
        ("[run]\nseed = -1", &["shot.toml:2:8: seed = -1"]),
        ("[run]\nseed = 1.5", &["shot.toml:2:8: seed = 1.5", "expected a whole number from 0 to 4294967295"]),
        ("[run]\nadapter = 1", &["shot.toml:2:11: adapter = 1", "expected a string, \"NAME|gpu|cpu\""]),
        ("[view]\nview = \"botom\"", &["shot.toml:2:8: view = \"botom\"", "front, back, left", "did you mean"]),
        // The first mistake is reported, of whichever kind.
        ("[run]\nseed = -1\n[look]\nexposure = \"bright\"", &["shot.toml:2:8: seed = -1"]),
        (
            "scene = \"a\"\n[view]\nview = \"top\"\nfov-y = 9\neye = [1, 2, 3]",
            &["shot.toml:5:1: `eye` cannot be used with `view`", "leave one of them out"],
        ),
        ("[technique]\naccumulate = 0", &["shot.toml:2:14: accumulate = 0"]),
        ("[lights]\nenviroment = \"a.hdr\"", &["unknown key `enviroment`", "`environment`"]),
        ("[track]\nframes = 0", &["shot.toml:2:10: frames = 0"]),
        ("[track]\nkeyframes = []", &["shot.toml:2:13", "at least one"]),
        ("[track]\ninterpolation = \"cubic\"", &["shot.toml:2:17", "linear, catmull-rom"]),
        ("[[track.keyframes]]\neye = [0, 0, 0]", &["shot.toml:1:1", "time = SECONDS"]),
        ("[[track.keyframes]]\ntime = 0", &["shot.toml:1:1", "eye, target or fov-y"]),
        ("[[track.keyframes]]\ntime = 0\neyes = 1", &["shot.toml:3:1: unknown key `eyes`", "`eye`"]),
        ("[[track.keyframes]]\ntime = 0\nfov-y = 180", &["shot.toml:3:9", "0.1 to 179"]),
        (
            "[[track.keyframes]]\ntime = 1\nfov-y = 9\n[[track.keyframes]]\ntime = 1\nfov-y = 8",
            &["shot.toml:4:1", "order of time"],
        ),
        (
            "[[track.keyframes]]\ntime = 1\nfov-y = 9\n[[track.keyframes]]\ntime = 2\neye = [0,0,0]",
            &["shot.toml:4:1", "other keys"],
        ),
    ] {
        let error = shot(text, "").unwrap_err();
        for word in words {
            assert!(error.contains(word), "{text:?}: {word:?} is not in: {error}");
        }
    }
}

#[test]
fn the_example_of_help_is_a_shot() {
    let example: Vec<_> = HELP.lines().filter_map(|line| line.strip_prefix("  ")).collect();
    let shot = shot(&example.join("\n"), "").unwrap();
    assert_eq!((shot.views().len(), shot.args.lights.points.len()), (48, 2));
}

#[test]
fn deep_nesting_is_refused_and_long_lists_are_read() {
    let deep = format!("scene = {}1{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(shot(&deep, "").unwrap_err().contains("shot.toml:1:"));
    let points = "[0, 1, 2, 3],\n".repeat(5000);
    let text = |last: &str| format!("scene = \"a.glb\"\n[lights]\npoint = [\n{points}{last}]");
    assert_eq!(shot(&text(""), "").unwrap().args.lights.points.len(), 5000);
}

#[test]
fn names_are_relative_to_the_shot() {
    let folder = Path::new("some/folder");
    let text = "scene = \"../court.glb\"\n[output]\noutput = \"a.png\"\n[run]\nreport = \"/r.json\"\nadapter = \"cpu\"";
    let file = read::file(&folder.join("shot.toml"), text).unwrap();
    assert_eq!(file.scene.path(), folder.join("../court.glb"));
    let args = file.given.args;
    assert_eq!(args.output.output, Some(folder.join("a.png")));
    assert_eq!((args.run.report, args.run.adapter), (Some("/r.json".into()), Some(AdapterChoice::Cpu)));
    // Without a name, the image is named after the shot, in the current folder.
    assert_eq!(shot("scene = \"a.glb\"", "").unwrap().args.output.output, Some("shot.png".into()));
}

#[test]
fn flags_override_keys_and_points_add_up() {
    let text = "scene = \"demo:cornell\"\n[lights]\npoint = [[0, 1, 2, 3]]\n[look]\nexposure = 1\ntone-map = \"aces\"";
    let args = shot(text, "--exposure 2 --point 1,1,1,1 -o b.png").unwrap().args;
    assert_eq!(
        (args.settings().image.exposure, args.settings().image.tone_map, args.lights.points.len()),
        (Exposure::Ev(2.0), ToneMap::Aces, 2)
    );
    assert_eq!(args.output.output, Some("b.png".into()));
    // Defaults of flags do not override keys.
    assert_eq!(shot(text, "").unwrap().args.settings().image.exposure, Exposure::Ev(1.0));
    let metered = shot(&text.replace("= 1\n", "= \"auto\"\n"), "").unwrap().args;
    assert_eq!(metered.settings().image.exposure, Exposure::Auto);
}

#[test]
fn the_environment_is_relative_to_the_shot() {
    let toml = "scene = \"demo:cornell\"\n[lights]\nenvironment = \"skies/noon.hdr\"\nenvironment-rotation = 45";
    let args = shot(toml, "--environment-scale 3").unwrap().args;
    assert!(args.lights.environment.unwrap().ends_with("skies/noon.hdr"));
    assert_eq!((args.lights.environment_rotation, args.lights.environment_scale), (45.0, 3.0));
    // A flag's path is relative to the current folder.
    assert_eq!(shot(toml, "--environment b.exr").unwrap().args.lights.environment, Some("b.exr".into()));
}

#[test]
fn shots_survive_a_round_trip() {
    let shots = [
        ("scene = \"demo:atrium\"", ""),
        (TRACK, "--frames 7"),
        (TRACK, "--frames 5-9 --fps 12.5 --animation walk --skip-existing"),
        ("scene = \"demo:atrium\"", "--orbit 12 --frames 3-5 --time 0.5"),
        (
            TRACK,
            "--time .5 --eye -.5,+1,1e30 --quiet --exposure -.5 --seed 4294967295 --aabb off --tile-size 8 --accumulate 16",
        ),
        (
            "scene = \"demo:atrium\"",
            "--point -1,2,3,4 --point 1,2,3,4,.1,.2,.3,5 --disk -1,2,3,0,-1,0,0.5,6 --rectangle 1,2,3,0,-1,0,.5,6,7,1,1,1,8 --sun 0,-1,0,1e3 --lights rain:5 --sky 0,0.1,1 --environment-rotation -90.5 --environment-scale 2 --camera \"\\ \
             --debug-view nan --adapter cpu --fov-y 33.3 --size 7X9 --range-threshold 1e-30",
        ),
        (
            "scene = \"demo:atrium\"",
            "--pose 0.36,0.48,-0.8,1,-0.8,0.6,0,2,0.4801,0.6399,0.6,3.7,0,0,0,1 --intrinsics 600.5,600,320,240 --as archer \
             --pose-convention opencv --stereo -1.39,1.25,-1.47,1.46,0.063,2.7 --stereo-layout layers --outputs normal,depth \
             --disk 1,2,3,.3,-1,.2,.25,9,.1,.7,.3 --rectangle 1,2,3,.3,-.7,.2,.25,9,.1 --sun 3,-7,2,5,1,.9,.3 --legend off \
             --lights random:10:1.5:7:-9,0,-4,9,9,4 --ground off --quality best --up z --variant 1",
        ),
    ];
    for (toml, flags) in shots {
        let flags = flags.replace("1e30", "1e11");
        let shot = shot(toml, &flags).unwrap();
        let (first, second) = twice(&shot);
        assert_eq!(first, second);
        assert!(first.lines().all(|line| line.chars().count() <= 120), "{first}");
        let mut again = self::shot(&first, "").unwrap();
        assert_eq!(again.args.settings(), shot.args.settings());
        assert_eq!(again.path.is_some(), shot.path.is_some());
        assert_eq!(format!("{:?}", again.views()), format!("{:?}", shot.views()));
        // A shot states defaults, too.
        again.args.give(&shot.args.given());
        assert_eq!(format!("{:?}", again.args), format!("{:?}", shot.args));
        for key in keys() {
            assert!(first.contains(&format!("\n{} = ", key.name)) || first.contains(&format!("\n# {} = ", key.name)));
        }
    }
}

#[test]
fn views_follow_the_track_unless_flags_say_otherwise() {
    let views = |flags: &str| shot(TRACK, flags).unwrap().views();
    assert_eq!(views("")[0].eye, Some(Vec3::new(0.0, 0.0, 4.0)));
    assert_eq!(views("--time 1.5")[0].fov_y, Some(50f32.to_radians()));
    let sequence = views("--frames 5 --target 9,9,9");
    assert_eq!(sequence.len(), 5);
    assert!(sequence.iter().all(|view| view.target == Some(Vec3::splat(9.0))));
    assert_eq!((sequence[3].eye, sequence[4].eye), (Some(Vec3::new(1.0, 0.0, 4.0)), Some(Vec3::new(3.0, 0.0, 4.0))));

    // A time on the command line replaces the shot's sequence.
    let text = TRACK.replace("[track]", "[track]\nframes = 3");
    let count = |flags: &str| shot(&text, flags).unwrap().views().len();
    assert_eq!((count(""), count("--frames 2"), count("--time 1")), (3, 2, 1));
    for (text, flags, word) in [
        (TRACK, "--time 2.5", "from 0 to 2 s"),
        (TRACK, "--time 1 --frames 2", "both --time and --frames"),
        ("scene = \"demo:atrium\"", "--frames 2", "demo:atrium has no camera track"),
        ("scene = \"demo:atrium\"", "--frames 2", "--accumulate N averages N frames of one image"),
    ] {
        let error = shot(text, flags).unwrap_err();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn the_time_of_a_frame_is_its_number_over_the_rate() {
    let frames = |text: &str, flags: &str| shot(text, flags).unwrap().frames();
    let numbers = |frames: &[ShotFrame]| frames.iter().map(|frame| frame.number.unwrap()).collect::<Vec<_>>();
    let times = |frames: &[ShotFrame]| frames.iter().map(|frame| frame.time.unwrap()).collect::<Vec<_>>();
    let some = frames(TRACK, "--frames 18-20 --fps 12");
    assert_eq!((numbers(&some), times(&some)), (vec![18, 19, 20], vec![1.5, 19.0 / 12.0, 20.0 / 12.0]));
    assert_eq!(some[0].view.fov_y, Some(50f32.to_radians()), "the keyframe's value");
    // A frame does not depend on the range. After the end of the track, the camera is static.
    let many = frames(TRACK, "--frames 0-99");
    assert_eq!((many[36].view.clone(), many[36].time), (some[0].view.clone(), Some(1.5)));
    assert_eq!(
        (many[48].view.eye, many[99].view.eye),
        (Some(Vec3::new(3.0, 0.0, 4.0)), Some(Vec3::new(3.0, 0.0, 4.0)))
    );
    // A frame count divides the track; without a track, only the scene moves.
    assert_eq!(times(&frames(TRACK, "--frames 3")), [0.0, 1.0, 2.0]);
    assert_eq!(numbers(&frames(TRACK, "--frames 3")), [1, 2, 3]);
    let still = "scene = \"demo:atrium\"";
    assert_eq!(times(&frames(still, "--frames 24-24")), [1.0]);
    assert_eq!((frames(still, "--time 3")[0].time, frames(still, "")[0].time), (Some(3.0), None));
    assert_eq!(frames(TRACK, "")[0].time, Some(0.0));
    // Light and exposure of all frames do not depend on which are requested.
    let first = |flags: &str| shot(TRACK, flags).unwrap().first();
    assert_eq!((first("--frames 7-9").time, first("--frames 7-9").view), (Some(0.0), first("--frames 0-3").view));
    assert_eq!(first("--time 1").time, Some(1.0));
    // After the track, rain continues to fall.
    assert_eq!(frames(TRACK, "--time 7 --lights rain:5")[0].time, Some(7.0));
}

#[test]
fn an_orbit_is_a_sequence_of_its_own() {
    let still = "scene = \"demo:atrium\"\n[track]\norbit = 8\nfps = 4";
    let orbit = shot(still, "").unwrap();
    let frames = orbit.frames();
    assert_eq!(frames.iter().map(|frame| frame.number.unwrap()).collect::<Vec<_>>(), (1..=8).collect::<Vec<_>>());
    for (i, frame) in frames.iter().enumerate() {
        let degrees = frame.view.orbit_angle.to_degrees();
        assert!((degrees - 45.0 * i as f32).abs() < 1e-3, "{degrees}");
        assert_eq!(frame.time, Some(i as f32 / 4.0));
    }
    let same = |a: &ShotFrame, b: &ShotFrame| a.time == b.time && a.view == b.view;
    // A part has the frames of the whole; further numbers repeat the revolution at later times.
    let part = shot(still, "--frames 3-9").unwrap();
    assert!(part.frames().len() == 7 && part.frames()[..6].iter().zip(&frames[2..]).all(|(a, b)| same(a, b)));
    let ninth = &part.frames()[6];
    assert_eq!((ninth.view.clone(), ninth.time), (frames[0].view.clone(), Some(2.0)));
    // Light and exposure are those of the first frame, which is the image without an orbit.
    assert!(same(&part.first(), &frames[0]) && frames[0].view == shot(still, "").unwrap().args.view);
    assert!(same(&orbit.beside(&frames[3], -1).unwrap(), &frames[2]));
    assert_eq!(orbit.beside(&frames[0], -1).unwrap().view, frames[7].view);
    assert_eq!(orbit.beside(&frames[7], 1).unwrap().view, frames[0].view);
    // A time holds the scene still, and a part keeps it.
    let held = still.replace("fps = 4", "time = 1.5");
    let part = shot(&held, "--frames 2-3").unwrap().frames();
    assert!(part.len() == 2 && part.iter().all(|frame| frame.time == Some(1.5)));
    assert_eq!(shot(&held, "--time 2").unwrap().frames()[5].time, Some(2.0));

    for (text, flags, words) in [
        (TRACK, "--orbit 8", ["both --orbit and a camera track", "remove keyframes from [track]"]),
        (still, "--frames 4", ["--frames 4 with --orbit 8", "--frames 1-4"]),
        ("scene = \"a.glb\"\n[track]\norbit = 1", "", ["shot.toml:3:9: orbit = 1", "2 to 99999"]),
        ("scene = \"a.glb\"\n[track]\norbit = \"fast\"", "", ["shot.toml:3:9", "2 to 99999"]),
    ] {
        let error = shot(text, flags).unwrap_err();
        assert!(words.iter().all(|word| error.contains(word)), "{words:?}: {error}");
    }
}

#[test]
fn frames_in_a_shot_are_a_number_or_a_range() {
    let frames = |value: &str| shot(&TRACK.replace("[track]", &format!("[track]\nframes = {value}\nfps = 30")), "");
    assert_eq!(frames("3").unwrap().frames().len(), 3);
    let range = frames("\"10-14\"").unwrap();
    assert_eq!((range.frames().len(), range.frames()[0].time), (5, Some(10.0 / 30.0)));
    let error = frames("\"14-10\"").unwrap_err();
    assert!(error.contains("shot.toml:3:10") && error.contains("A-B"), "{error}");
}

#[test]
fn every_track_of_the_docs_has_680_frames_and_light_rain() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/tracks");
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        names.push(path.file_stem().unwrap().to_string_lossy().into_owned());
        let shot = read(&path).unwrap();
        shot.check().unwrap();
        assert!(matches!(shot.args.lights.lights, Some(LightSet::Rain { count: 1000, radius: None })), "{names:?}");
        let times: Vec<f32> = shot.frames().iter().map(|frame| frame.time.unwrap()).collect();
        assert_eq!(times.len(), 680);
        // 1/30 s per frame; the last keyframe's time is rounded to six digits.
        assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 1.0 / 30.0).abs() < 1e-5), "{names:?}");
    }
    names.sort();
    assert_eq!(names, ["atrium", "bistro", "sponza"]);
}
