use clap::CommandFactory;
use lanternfish::{
    settings::{Background, Culling, DebugView, Exposure, Indirect, Occlusion, Preset, Samples, Shadows, TracerChoice},
    techniques::{
        ClusterShape, Clustered, Denoise, IndirectResolution, LightSamples, Probes, Sampled, SampledLights, TileSize,
        Tiled,
    },
};

use super::*;
use crate::{
    cli::{Cli, Command},
    paper::{Deep, DeepImageSettings, DirectionSet, Hbao},
    parse::LightSet,
    testing,
};

fn parsed(words: &str) -> RenderArgs {
    match testing::parsed(&format!("render scene.glb {words}")).unwrap_or_else(|error| panic!("{error}")) {
        Command::Render(args) => args.render,
        _ => unreachable!("the words start with render"),
    }
}

#[test]
fn the_flags_are_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn without_flags_the_settings_are_the_librarys_defaults() {
    let structure = DeepImageSettings::of_quality(Preset::default().quality()).chosen();
    assert_eq!(parsed("").settings(), Settings::default().with_structure(structure));
    assert_eq!(parsed("--indirect none").settings(), Settings::direct_light());
    for preset in Preset::ALL {
        let structure = DeepImageSettings::of_quality(preset.quality()).chosen();
        let flags = format!("--quality {}", lanternfish_scene::Named::name(*preset));
        assert_eq!(parsed(&flags).settings(), Settings::of_preset(*preset).with_structure(structure));
    }
    // A flag wins over the preset.
    let words = "--quality=realtime --light-samples=2";
    let single = parsed("--quality=realtime --history=off --antialiasing=none").settings();
    assert_eq!(single, parsed("--quality=draft").settings());
    let sampled =
        parsed(words).settings().direct.get::<SampledLights>().copied().expect("realtime samples direct light");
    assert_eq!(sampled.light_samples, LightSamples::Two);
}

/// Written shots state them.
#[test]
fn defaults_in_help_are_those_of_every_preset() {
    testing::know_papers();
    let mut stated = GivenSettings::default();
    for entry in Settings::parameters().into_iter().filter(|entry| entry.info.shows_default) {
        stated.give(entry.info.name, entry.value);
    }
    for preset in Preset::ALL {
        for technique in [Indirect::NONE].into_iter().chain(Indirect::all()) {
            let words = format!("--quality {preset} --indirect {}", technique.name());
            let mut args = parsed(&words);
            let settings = args.settings();
            args.give(&args.given().above(stated.clone()));
            assert_eq!(args.settings(), settings, "{words}");
        }
    }
}

/// A flag of each kind of value, and of each kind of technique. The library's tests read every setting.
#[test]
fn flags_of_settings_have_their_types() {
    let words = "--direct sampled --light-samples 2 --denoise off --shadows bvh --culling tiled --tile-size 32 --aabb off \
                 --attenuation-coefficients 1,0.5,2 --exposure -2 --background #ff8000 --occlusion deep \
                 --occlusion-distance 2.5 --deep-directions cube:2 --indirect none --debug-view light-count";
    let direct = SampledLights { light_samples: LightSamples::Two, denoise: Denoise::Off };
    let images = DeepImageSettings { directions: DirectionSet::Cube { k: 2 }, ..DeepImageSettings::default() };
    let expected = Settings::direct_light()
        .with_direct(direct)
        .with_shadows(Shadows::BVH)
        .with_culling(Tiled { tile_size: TileSize::Px32, aabb_test: false })
        .with_attenuation_coefficients("1,0.5,2".parse().unwrap())
        .with_exposure(Exposure::Ev(-2.0))
        .with_background(Background::Color([255, 128, 0]))
        .with_occlusion(Deep { max_distance: Some(2.5), ..Deep::default() })
        .with_structure(images)
        .with_debug_view(Some(DebugView::LightCount));
    assert_eq!(parsed(words).settings(), expected);
    let hbao = parsed("--occlusion=hbao --occlusion-distance=3").settings().occlusion;
    assert_eq!(hbao, Occlusion::from(Hbao { radius: 3.0, ..Hbao::default() }));
    let clustered = Clustered { shape: ClusterShape::Displaced { pixels: 64, distance: 32.0 }, ..Clustered::default() };
    assert_eq!(parsed("--clusters displ:64:32").settings().culling, Culling::from(clustered));
}

/// The flags that the help of `--deep-builder` lists give the library's constant.
#[test]
fn flags_choose_deep_images_as_in_archer_2019() {
    let command = render_command();
    let builder = command.get_arguments().find(|flag| flag.get_long() == Some("deep-builder")).unwrap();
    let help = builder.get_long_help().unwrap().to_string();
    let (_, flags) = help.split_once("As in Archer 2019: ").unwrap();
    let settings = parsed(flags.trim_end_matches('.')).settings();
    assert_eq!(DeepImageSettings::of(&settings.structure), DeepImageSettings::ARCHER);
    for wrong in ["--deep-merge -1", "--deep-sort bubble"] {
        assert!(testing::parsed(&format!("render scene.glb {wrong}")).is_err(), "{wrong}");
    }
}

#[test]
fn negative_numbers_are_values_and_lights_add_up() {
    let words = "--eye -1,-2,-3 --target -4,0,0 --point -1,2,3,4 --point -5,6,7,8 --sun -1,-1,0,2 --sky 0,0,1 \
                 --disk -1,2,3,0,-1,0,1,5 --disk -1,2,3,0,1,0,1,5 --rectangle -1,2,3,0,-1,0,1,2,5";
    let args = parsed(words);
    assert_eq!(args.view.eye, Some(Vec3::new(-1.0, -2.0, -3.0)));
    assert_eq!((args.lights.points.len(), args.lights.disks.len(), args.lights.rectangles.len()), (2, 2, 1));
    assert!(args.lights.sun.is_some());
    assert_eq!(args.lights.sky, Some(Vec3::Z));
}

#[test]
fn what_is_said_last_counts_but_points_add_up() {
    let words = "--lights rain:1000 --seed 1 --timings -o a.png --point 0,0,0,1 \
                 --lights rain:5 --seed 2 --timings --output b.png --point 1,1,1,1 --quiet -q \
                 --adapter cpu --adapter llvmpipe";
    let args = parsed(words);
    assert_eq!(args.lights.lights, Some(LightSet::Rain { count: 5, radius: None }));
    assert_eq!((args.run.seed, args.run.adapter), (2, Some(AdapterChoice::Name("llvmpipe".to_owned()))));
    assert_eq!(args.output.output, Some("b.png".into()));
    assert_eq!(args.lights.points.len(), 2);
    assert!(args.run.timings && args.run.quiet);
}

#[test]
fn quality_says_what_is_not_said_otherwise() {
    let sampled = |words: &str| {
        let settings = parsed(words).settings();
        let of_probes = settings.indirect.get::<Probes>().map(|probes| probes.per_pixel);
        let sampled = settings.indirect.get::<Sampled>().copied().or(of_probes).unwrap();
        (sampled, DeepImageSettings::of(&settings.structure).resolution)
    };
    assert_eq!(sampled(""), (Sampled::default(), 128));
    let (draft, coarse) = sampled("--quality draft");
    assert_eq!((draft.resolution, coarse), (IndirectResolution::Half, 64));
    let named = |words: &str| parsed(words).settings().indirect.name();
    assert_eq!(["", "--quality draft", "--quality best"].map(named), ["sampled", "probes", "sampled"]);
    // A technique that is given stays, with the rays of the quality.
    assert_eq!(named("--quality draft --indirect sampled"), "sampled");
    assert_eq!(sampled("--quality draft --indirect sampled").0, draft);
    let (best, _) = sampled("--quality best");
    assert_eq!(best.tracer, TracerChoice::Auto);
    let rays = |sampled: Sampled| sampled.diffuse_rays + sampled.glossy_rays;
    assert!(rays(draft) < rays(Sampled::default()) && rays(Sampled::default()) < rays(best));
    let (best, fine) = sampled("--quality best --indirect-rays 3 --deep-resolution 32");
    assert_eq!((best.diffuse_rays, best.tracer, fine), (3, TracerChoice::Auto, 32));
    let none = parsed("--indirect none").settings();
    assert_eq!((none.indirect, DeepImageSettings::of(&none.structure)), (Indirect::NONE, DeepImageSettings::default()));
    // Multisampling is the default where it costs a small part of the frame, and can be requested.
    let samples = |words: &str| parsed(words).settings().image.samples;
    assert_eq!((samples(""), samples("--quality draft")), (Samples::Four, Samples::One));
    assert_eq!((samples("--indirect none"), samples("--samples 1")), (Samples::One, Samples::One));
    assert_eq!(samples("--indirect none --samples 4"), Samples::Four);
    // An averaged image has smooth edges without multisampling.
    assert_eq!((samples("--accumulate 31"), samples("--accumulate 32")), (Samples::Four, Samples::One));
    assert_eq!(samples("--accumulate 64 --samples 4"), Samples::Four);
}
