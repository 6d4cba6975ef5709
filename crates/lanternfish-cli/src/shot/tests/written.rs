//! Shots as version 0.1 wrote them, without their comments: `lanternfish shot SCENE --size 48x32 --adapter cpu FLAGS -o
//! NAME.png`.

use super::*;

/// Four shots, with most keys of techniques and of lights.
#[test]
fn shots_of_earlier_programs_are_what_their_flags_were() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/shot/tests/written");
    for line in include_str!("written/flags.txt").lines() {
        let [name, scene, flags] = line.split(" | ").collect::<Vec<_>>()[..] else { panic!("{line}") };
        let mut read = read(&folder.join(name).with_extension("toml")).unwrap();
        let of_folder = |text: String| text.replace(&format!("{}/", folder.display()), "");
        let flags = format!("render {scene} --size 48x32 --adapter cpu {flags} -o {name}.png");
        let flags: Vec<_> = ["lanternfish"].into_iter().chain(flags.split_whitespace()).collect();
        let matches = Cli::command().try_get_matches_from(flags).unwrap();
        let matches = matches.subcommand().unwrap().1;
        let expected = resolve(&scene.into(), matches).unwrap();
        let settings = read.args.settings();
        assert_eq!(settings, expected.args.settings(), "{name}");
        let data = serde_json::to_string(&settings).unwrap();
        assert_eq!(serde_json::from_str::<lanternfish::Settings>(&data).unwrap(), settings, "{name}: {data}");
        // A shot states defaults, too.
        read.args.give(&expected.args.given());
        assert_eq!(of_folder(format!("{:?}", read.args.lights)), format!("{:?}", expected.args.lights), "{name}");
        let rest = |args: &RenderArgs| {
            of_folder(format!("{:?}", (&args.output, &args.part, &args.view, &args.stereo, &args.track, &args.run)))
        };
        assert_eq!(rest(&read.args), rest(&expected.args), "{name}");
    }
}
