use std::fs;

use clap::Parser as _;
use glam::{Mat3A, Vec3A};
use lanternfish::{
    settings::{DebugView, Exposure, Indirect, Occlusion, Preset, Samples, Shadows, TextureBinding, ToneMap},
    techniques::{Clustered, TileSize, Tiled},
};
use lanternfish_scene::{LightKind, generate::demo};

use super::*;
use crate::{
    cli::{Cli, Command},
    paper::{DeepImageSettings, DirectionSet, Hbao, RasterGrid},
    shot, testing,
};

/// The window's scene for these flags, without a rig.
fn opened(flags: &str) -> (Opened, Scene) {
    let flags = flags.split_whitespace().map(|flag| {
        let (name, value) = flag.trim_start_matches('-').split_once('=').unwrap();
        (name.to_owned(), value.to_owned())
    });
    let shot = shot::with_flags(&"demo:cornell".into(), None, &flags.collect::<Vec<_>>()).unwrap();
    let mut scene = demo("cornell").unwrap();
    let rain = crate::render::apply_lights(&mut scene, &shot.args.lights, shot.args.run.seed).unwrap();
    let camera = camera::choose(&scene, &shot.args.view, 1.5).unwrap();
    (Opened::new(shot, &scene, &camera, 0, rain), scene)
}

/// A window that shows one image of a still scene.
fn still<'a>(settings: &'a Settings, scene: &'a Scene, camera: &'a Camera) -> Shown<'a> {
    Shown { settings, scene, camera, eyes: None, size: [300, 200], moment: None }
}

/// Writes the shot to a file and reads it again, with the scene in its light.
fn read_again(shot: &Shot) -> (Shot, Scene) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seen.toml");
    fs::write(&path, text(shot).unwrap()).unwrap();
    let shot = shot::read(&path).unwrap();
    let mut scene = demo("cornell").unwrap();
    crate::render::apply_lights(&mut scene, &shot.args.lights, shot.args.run.seed).unwrap();
    (shot, scene)
}

fn many_settings() -> Vec<Settings> {
    let tiled = Tiled { tile_size: TileSize::Px8, ..Tiled::default() };
    let mut all = vec![
        Settings::default(),
        Settings::direct_light(),
        Settings::default().with_accumulate(64).with_exposure(Exposure::Ev(-1.3)).with_tone_map(ToneMap::Aces),
        Settings::default().with_accumulate(64).with_samples(Samples::One),
        Settings::direct_light().with_culling(tiled).with_shadows(Shadows::None).with_shadow_rays(3),
        Settings::direct_light().with_culling(RasterGrid::default()),
        Settings::default().with_culling(Clustered::default()).with_light_radius(0.123),
        Settings::direct_light().with_occlusion(Hbao::default()).with_samples(Samples::Four),
        Settings::default().with_debug_view(Some(DebugView::LightCount)).with_textures(TextureBinding::PerMaterial),
    ];
    all.extend(Preset::ALL.iter().map(|preset| Settings::of_preset(*preset)));
    all.extend(Indirect::all().into_iter().map(|indirect| Settings::default().with_indirect(indirect)));
    all.extend(Occlusion::all().into_iter().map(|occlusion| Settings::direct_light().with_occlusion(occlusion)));
    let images =
        DeepImageSettings { resolution: 96, directions: DirectionSet::Cube { k: 5 }, ..DeepImageSettings::default() };
    all.push(Settings::direct_light().with_range_threshold(0.0031).with_structure(images));
    all
}

/// Every so many-th of the settings, with another camera each, survives a round trip through the file and through the
/// command line.
fn survive_a_round_trip(step: usize) {
    let (opened, scene) = opened("--seed=7 --lights=rain:5 --quality=draft");
    let start = camera::choose(&scene, &opened.shot.args.view, 1.5).unwrap();
    for (i, settings) in many_settings().into_iter().enumerate().step_by(step) {
        let mut camera = start.clone();
        let turned = Mat3A::from_rotation_y(0.37 * i as f32) * Mat3A::from_rotation_x(0.05 * i as f32 - 0.6);
        camera.world_from_camera.matrix3 = turned;
        camera.world_from_camera.translation += Vec3A::new(0.1, 0.013, -0.07) * i as f32;
        if i == 0 {
            camera = start.clone();
        }
        let shown = Shown { size: [301, 200], ..still(&settings, &scene, &camera) };
        let (shot, snapped) = opened.shown(&shown).unwrap();
        assert!(is_alike(&snapped, &camera, &scene));
        let (again, lit) = read_again(&shot);
        assert!(again.args.settings() == settings, "{i}: {}", differing(&again.args.settings(), &settings));
        let read = camera::choose(&lit, &again.args.view, 301.0 / 200.0).unwrap();
        assert_eq!(read, snapped, "{i}: to the bit");
        assert_eq!((again.args.output.size.width, again.args.output.size.height, again.args.run.seed), (301, 200, 7));
        assert_eq!(lit.lights, scene.lights);
        // The rounded camera is now written unchanged.
        let (_, twice) = opened.shown(&Shown { camera: &snapped, ..shown }).unwrap();
        assert!(is_alike(&twice, &snapped, &scene));

        let line = command_line(&shot);
        let words = line.split(' ').map(|word| word.trim_matches('\''));
        let Command::Render(args) = Cli::try_parse_from(words).unwrap().command else { panic!("{line}") };
        let args = args.render;
        assert!(args.settings() == settings && args.view == again.args.view, "{line}");
        assert_eq!((args.run.seed, args.lights.lights), (7, opened.shot.args.lights.lights), "{line}");
    }
}

#[test]
fn window_states_survive_a_round_trip() {
    survive_a_round_trip(5);
}

#[test]
#[ignore = "full"]
fn all_window_states_survive_a_round_trip() {
    survive_a_round_trip(1);
}

/// Settings of every technique survive a round trip as data. What no parameter holds is refused, not lost.
#[test]
fn settings_are_data() {
    testing::know_papers();
    for settings in many_settings() {
        let text = serde_json::to_string(&settings).unwrap();
        assert_eq!(serde_json::from_str::<Settings>(&text).unwrap(), settings, "{text}");
    }
    let images = DeepImageSettings { supersampling: 2, ..DeepImageSettings::default() };
    let error = serde_json::to_string(&Settings::default().with_structure(images)).unwrap_err().to_string();
    assert!(error.contains("values without a parameter"), "{error}");
    let text = r#"{ "structure": { "deep-images": { "deep-directions": "zonal:0" } } }"#;
    let error = serde_json::from_str::<Settings>(text).unwrap_err().to_string();
    assert!(error.contains("deep-directions = zonal:0: 0 directions: expected 1 to 4096"), "{error}");
}

#[test]
fn a_command_line_omits_flags_without_effect() {
    let (opened, scene) = opened("--seed=7");
    let camera = camera::choose(&scene, &opened.shot.args.view, 1.5).unwrap();
    let settings = opened.shot.args.settings().with_tone_map(ToneMap::Aces);
    let moment = Some(Moment { animation: Some(1), time: 0.25 });
    let shown = Shown { moment, ..still(&settings, &scene, &camera) };
    let line = command_line(&opened.shown(&shown).unwrap().0);
    assert_eq!(
        line,
        "lanternfish render demo:cornell --size=300x200 --time=0.25 --animation=1 --light-rig=none --tone-map=aces --seed=7"
    );
    assert_eq!((quoted("it's"), quoted("")), (r"'it'\''s'".to_owned(), "''".to_owned()));
}

#[test]
fn added_lights_are_written_or_refused() {
    let (opened, mut scene) = opened("--point=0,1,0,2 --lights=rain:3");
    let camera = camera::choose(&scene, &opened.shot.args.view, 1.5).unwrap();
    let settings = Settings::default();
    let lamp = Light { range: Some(3.5), ..Light::point(Vec3::new(0.1, 1.7, -0.3), Vec3::new(3.0, 0.1, 0.7)) };
    let disk = Light::disk(Vec3::ONE, Vec3::NEG_Y, 0.25, Vec3::splat(9.0));
    let panel = Light::rectangle(Vec3::ONE, Vec3::NEG_Z, Vec3::X, [0.5, 0.25], Vec3::new(1.0, 2.0, 3.0));
    let sun = Light::directional(Vec3::new(0.3, -1.0, 0.2), Vec3::new(3.0, 2.9, 2.8));
    // Move the light that a flag added.
    scene.lights[4].position.x = 0.31;
    scene.lights.extend([lamp, disk, panel, sun]);
    let written = |scene: &Scene| {
        opened.shown(&still(&settings, scene, &camera)).map(|(shot, _)| shot).map_err(|error| error.to_string())
    };
    let (_, again) = read_again(&written(&scene).unwrap());
    assert_eq!(again.lights.len(), scene.lights.len());
    for (now, before) in again.lights.iter().zip(&scene.lights) {
        let near = now.direction.abs_diff_eq(before.direction, 1e-6);
        let mut alike = Light { direction: before.direction, ..now.clone() };
        if let (LightKind::Rectangle { right: now, .. }, LightKind::Rectangle { right: before, .. }) =
            (&mut alike.kind, before.kind)
        {
            // Its two ends are interchangeable.
            assert!(now.dot(before).abs() > 0.999);
            *now = before;
        }
        assert!(near && alike == *before, "{now:?} for {before:?}");
    }
    let refused = |change: &dyn Fn(&mut Scene)| {
        let mut scene = scene.clone();
        change(&mut scene);
        written(&scene).unwrap_err()
    };
    assert!(refused(&|scene| scene.lights[0].intensity *= 2.0).contains("of the file, or of --lights, were changed"));
    assert!(refused(&|scene| drop(scene.lights.remove(1))).contains("deleted"));
    let spot = LightKind::Spot { inner_angle: 0.1, outer_angle: 0.3 };
    assert!(refused(&|scene| scene.lights[4].kind = spot).contains("spot"));
    assert!(refused(&|scene| scene.lights.push(Light::directional(Vec3::NEG_X, Vec3::ONE))).contains("one sun"));
}

/// The time describes fallen rain, and no single drop. A drop moved by hand is an error.
#[test]
fn rain_is_written_as_its_time() {
    let (opened, mut scene) = opened("--lights=rain:40 --point=0,1,0,2");
    let camera = camera::choose(&scene, &opened.shot.args.view, 1.5).unwrap();
    let settings = Settings::default();
    let said = |scene: &Scene, moment| {
        opened
            .shown(&Shown { moment, ..still(&settings, scene, &camera) })
            .map(|(shot, _)| shot)
            .map_err(|error| error.to_string())
    };
    let rain = opened.rain.clone().unwrap();
    rain.fall(&mut scene.lights, 1.5);
    let (shot, mut lit) = read_again(&said(&scene, Some(Moment { animation: None, time: 1.5 })).unwrap());
    assert_eq!(shot.first().time, Some(1.5));
    assert_ne!(lit.lights, scene.lights);
    rain.fall(&mut lit.lights, 1.5);
    assert_eq!(lit.lights, scene.lights);
    assert!(said(&scene, None).unwrap_err().contains("changed"), "at 0 s it is elsewhere");
    scene.lights[7].position.x += 0.1;
    assert!(said(&scene, Some(Moment { animation: None, time: 1.5 })).unwrap_err().contains("changed"));
}

#[test]
fn cameras_and_settings_without_flags_are_refused() {
    let (opened, scene) = opened("--seed=7");
    let mut camera = camera::choose(&scene, &opened.shot.args.view, 1.5).unwrap();
    let mut settings = Settings::default();
    let refused =
        |settings: &Settings, camera: &Camera| opened.shown(&still(settings, &scene, camera)).unwrap_err().to_string();
    settings.structure = DeepImageSettings { supersampling: 2, ..DeepImageSettings::default() }.into();
    assert!(refused(&settings, &camera).contains("flags cannot express these settings"));
    let settings = Settings::default();
    camera.world_from_camera.matrix3 *= Mat3A::from_rotation_z(0.3);
    assert!(refused(&settings, &camera).contains("rolled"));
}

#[test]
fn eyes_are_written_if_they_are_shown() {
    let (opened, scene) = opened("--stereo=-1.39,1.25,-1.47,1.46,0.063,2.5");
    let camera = camera::choose(&scene, &opened.shot.args.view, 1.5).unwrap();
    let settings = Settings::default();
    let said = |eyes| opened.shown(&Shown { eyes, ..still(&settings, &scene, &camera) }).unwrap().0;
    for eyes in [opened.shot.args.stereo.stereo, Some(Eyes::Vive), Some(Eyes::Parallel(0.0712)), None] {
        assert_eq!(read_again(&said(eyes)).0.args.stereo.stereo, eyes);
    }
}
