use clap::CommandFactory;
use lanternfish::{
    settings::{
        Anisotropy, Antialiasing, Attenuation, Background, Culling, DebugView, Exposure, History, Indirect, Materials,
        Occlusion, Preset, RayCulling, RayRangeCulling, Samples, Shadows, TextureBinding, ToneMap, Tracer,
        TracerChoice,
    },
    techniques::{
        Assignment, ClusterShape, Clustered, Denoise, Grouping, IndirectClamp, IndirectResolution, LightChoice,
        LightSamples, Probes, Sampled, SampledLights, TileSize, Tiled,
    },
};

use super::*;
use crate::{
    cli::{Cli, Command},
    paper::{Deep, DeepBuilder, DeepImageSettings, DeepSearch, DeepSort, DeepStore, DirectionSet, Hbao},
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
    let direct = parsed(&format!("{words} --history=off --antialiasing=none --direct=all")).settings();
    assert_eq!(direct, parsed("--quality=draft").settings());
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

#[test]
fn every_flag_reaches_its_setting() {
    let words = "--direct sampled --light-samples 2 --light-choice uniform --denoise off --shadows bvh --ray-culling improved --ray-range-culling off --culling tiled --tile-size 32 --aabb off --textures per-material \
                 --attenuation physical --attenuation-near-radius 0.75 --attenuation-coefficients 1,0.5,2 --range-threshold 0.5 \
                 --materials lambert --exposure -2 --tone-map none --background #ff8000 --samples 4 \
                 --anisotropy 2 --debug-view light-count --occlusion deep --occlusion-distance 2.5 --deep-resolution 32 \
                 --deep-directions cube:2 --deep-slices 8 --deep-builder per_direction --deep-sort blocks --deep-merge 0.5 \
                 --deep-search linear_steps --deep-store linked_list --deep-test off --deep-tolerance 1.5 --history on --antialiasing temporal --accumulate 5 --indirect sampled --indirect-rays 3 --glossy-rays 0 \
                 --indirect-tracer bvh --indirect-resolution half --indirect-filter 2 --indirect-clamp off --light-radius 0.2 --sun-diameter 0.53 --shadow-rays 7";
    let args = parsed(words);
    let expected = Settings::default()
        .with_direct(SampledLights {
            light_samples: LightSamples::Two,
            choice: LightChoice::Uniform,
            denoise: Denoise::Off,
        })
        .with_culling(Tiled { tile_size: TileSize::Px32, aabb_test: false })
        .with_shadows(Shadows::BVH)
        .with_ray_culling(RayCulling::Improved)
        .with_ray_range_culling(RayRangeCulling::Off)
        .with_attenuation(Attenuation::Physical)
        .with_attenuation_near_radius(0.75)
        .with_attenuation_coefficients("1,0.5,2".parse().unwrap())
        .with_range_threshold(0.5)
        .with_materials(Materials::Lambert)
        .with_exposure(Exposure::Ev(-2.0))
        .with_tone_map(ToneMap::None)
        .with_background(Background::Color([255, 128, 0]))
        .with_debug_view(Some(DebugView::LightCount))
        .with_textures(TextureBinding::PerMaterial)
        .with_anisotropy(Anisotropy::X2)
        .with_samples(Samples::Four)
        .with_occlusion(Deep { max_distance: Some(2.5), ..Deep::default() })
        .with_structure(DeepImageSettings {
            directions: DirectionSet::Cube { k: 2 },
            resolution: 32,
            slices: 8,
            builder: DeepBuilder::PerDirection,
            sort: DeepSort::Blocks,
            merge_texels: 0.5,
            search: DeepSearch::LinearSteps,
            store: DeepStore::LinkedList,
            tests_triangles: false,
            tolerance: 1.5,
            ..DeepImageSettings::default()
        })
        .with_accumulate(5)
        .with_light_radius(0.2)
        .with_sun_diameter(0.53)
        .with_shadow_rays(7)
        .with_history(History::On)
        .with_antialiasing(Antialiasing::Temporal)
        .with_indirect(Sampled {
            diffuse_rays: 3,
            glossy_rays: 0,
            tracer: Tracer::BVH.into(),
            resolution: IndirectResolution::Half,
            filter_radius: 2,
            clamp: IndirectClamp::Off,
            ..Sampled::default()
        });
    let hbao = |words: &str| parsed(words).settings().occlusion;
    assert_eq!(hbao("--occlusion hbao"), Occlusion::from(Hbao { radius: 1.0, ..Hbao::default() }));
    let farther = Hbao { radius: 3.0, ..Hbao::default() };
    assert_eq!(hbao("--occlusion=hbao --occlusion-distance=3"), Occlusion::from(farther));
    assert_eq!(args.settings(), expected);
    assert_eq!(parsed("--culling all").settings().culling, Culling::NONE);
    let words = "--culling clustered --clusters displ:64:32 --cluster-views individual --light-assignment brute_force \
                 --cluster-depth 100";
    let clustered = Clustered {
        shape: ClusterShape::Displaced { pixels: 64, distance: 32.0 },
        grouping: Grouping::Individual,
        assignment: Assignment::BruteForce,
        depth: 100,
    };
    let args = parsed(words);
    assert_eq!(args.settings().culling, Culling::from(clustered));
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
                 --lights rain:5 --seed 2 --timings --output b.png --point 1,1,1,1 --quiet -q";
    let args = parsed(words);
    assert_eq!(args.lights.lights, Some(LightSet::Rain { count: 5, radius: None }));
    assert_eq!(args.run.seed, 2);
    assert_eq!(args.output.output, Some("b.png".into()));
    assert_eq!(args.lights.points.len(), 2);
    assert!(args.run.timings && args.run.quiet);
}

#[test]
fn adapters_are_named_or_cpu() {
    assert_eq!(parsed("--adapter cpu").run.adapter, Some(AdapterChoice::Cpu));
    let named = parsed("--adapter llvmpipe").run.adapter;
    assert_eq!(named, Some(AdapterChoice::Name("llvmpipe".to_owned())));
    assert_eq!(parsed("").run.adapter, None);
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
