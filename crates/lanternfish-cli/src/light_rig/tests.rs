use lanternfish::Report;
use lanternfish_scene::{AlphaMode, Projection, Viewpoint, generate::demo};

use super::*;
use crate::{cli::Command, testing::parsed};

/// Flags of `lanternfish render`.
fn flags(words: &str) -> LightArgs {
    let Ok(Command::Render(args)) = parsed(&format!("render a.glb {words}")) else { panic!("{words}") };
    args.render.lights
}

/// Seen from the camera, the studio and the sun are the same at every angle.
#[test]
fn rigs_revolve_with_the_camera_of_an_orbit() {
    let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
    let eye = Vec3::new(1.0, 2.0, 5.0);
    let camera = Camera::look_at(eye, Vec3::ZERO, projection);
    let mut scene =
        Scene { lights: vec![lanternfish_scene::Light::directional(Vec3::X, Vec3::ONE)], ..Scene::default() };
    // The scene has a light of its own, and is metered.
    let studio = AddedLights::add(LightRig::Studio, &mut scene, &camera, 0.5);
    assert_eq!(studio.exposure(), None);
    let sun = AddedLights::add(LightRig::Sun, &mut scene, &camera, 1.0);
    assert!(!studio.is_empty() && !sun.is_empty());
    let still = scene.clone();
    for angle in [2.0, 0.7, 0.0] {
        studio.revolve(&mut scene, angle);
        sun.revolve(&mut scene, angle);
        let rotation = Mat3::from_rotation_y(angle);
        let now = Camera::look_at(rotation * eye, Vec3::ZERO, projection);
        let (environment, before) = (scene.environment.as_ref().unwrap(), still.environment.as_ref().unwrap());
        let mut brightest = 0.0f32;
        for i in 0..200 {
            let i = i as f32;
            let v = Vec3::new((1.3 * i).sin(), (0.7 * i).cos(), (0.31 * i).sin() + 0.1).normalize();
            let [is, was] = [(environment, &now), (before, &camera)]
                .map(|(image, camera)| image.radiance(camera.world_from_camera.transform_vector3(v)));
            assert!(is.abs_diff_eq(was, 1e-3), "{angle}: {is} instead of {was} towards {v}");
            brightest = brightest.max(is.max_element());
        }
        assert!(brightest > 1.0, "no soft box was tested");
        assert!(scene.lights[1].direction.abs_diff_eq(rig::sun(&now).direction, 1e-5));
        assert_eq!(scene.lights[0], still.lights[0], "lights of the file stay");
    }
}

#[test]
fn white_is_white_in_the_studio_alone() {
    let mut scene = demo("furnace").unwrap();
    (scene.lights, scene.sky) = (Vec::new(), Vec3::ZERO);
    let camera = Camera::look_at(50.0 * Vec3::Z, Vec3::ZERO, Projection::Perspective { fov_y: 0.8, near: 0.1 });
    let of = |rig, scale| AddedLights::add(rig, &mut scene.clone(), &camera, scale).exposure();
    assert_eq!((of(LightRig::Studio, 1.0), of(LightRig::Studio, 4.0)), (Some(0.0), Some(-2.0)));
    assert_eq!((of(LightRig::Sun, 1.0), of(LightRig::Studio, 0.0)), (None, None));
    scene.materials.iter_mut().for_each(|material| material.base_color = glam::Vec4::W);
    let of = |scale| AddedLights::add(LightRig::Studio, &mut scene.clone(), &camera, scale).exposure();
    assert_eq!((of(1.0), of(4.0)), (Some(2.0), Some(0.0)), "dark materials");
    // A court, from inside: the sky of the studio lights little of what is seen.
    let inside = Camera { world_from_camera: glam::Affine3A::IDENTITY, ..camera };
    assert_eq!(AddedLights::add(LightRig::Studio, &mut scene, &inside, 1.0).exposure(), None);
}

#[test]
fn objects_in_the_studio_stand_on_a_ground() {
    let mut ball = demo("furnace").unwrap();
    (ball.lights, ball.sky) = (Vec::new(), Vec3::ZERO);
    ball.instances.truncate(1);
    let camera = Camera::framing_scene(&ball, Some(Viewpoint::Iso), 0.8, 1.5);
    let lighting = Lighting {
        is_seen: true,
        reaches_surfaces: true,
        takes_ground: true,
        catches_shadows: false,
        is_metered: false,
    };
    let stands = |words, lighting| {
        let mut scene = ball.clone();
        let added = light(&mut scene, &flags(words), &camera, lighting, |_| ()).unwrap();
        assert_eq!(scene.instances.len(), 1 + usize::from(added.ground.is_some()), "{words}");
        added.ground.is_some()
    };
    assert!(
        stands("", lighting) && stands("--light-rig studio", lighting) && stands("--sky 1,1,1 --ground on", lighting)
    );
    assert!(!stands("--ground off", lighting) && !stands("--sky 1,1,1", lighting));
    let hidden = Lighting { takes_ground: false, ..lighting };
    assert!(!stands("", hidden) && stands("--ground on", hidden));
    assert!(!stands("--ground on", Lighting { is_seen: false, ..lighting }));
    let mut scene = ball.clone();
    let over_white = Lighting { takes_ground: false, catches_shadows: true, ..lighting };
    let added = light(&mut scene, &flags("--ground on"), &camera, over_white, |_| ()).unwrap();
    let material = scene.materials.last().unwrap();
    assert!(matches!(material.alpha_mode, AlphaMode::ShadowCatcher { .. }) && added.ground.is_some());
    // It turns with the studio, about the object.
    let added = light(&mut ball, &flags(""), &camera, lighting, |_| ()).unwrap();
    added.revolve(&mut ball, 1.0);
    let (index, still) = added.ground.unwrap();
    let now = ball.instances[index].world_from_object;
    assert!(now.translation == still.translation && now.matrix3 != still.matrix3);
}

#[test]
fn nearly_black_images_get_a_sky_in_streets_and_a_studio_around_objects() {
    let scene = demo("furnace").unwrap();
    let projection = Projection::Perspective { fov_y: 0.8, near: 0.1 };
    let eye = |eye| Camera::look_at(eye, Vec3::NEG_Z, projection);
    let (outside, between) = (eye(Vec3::new(0.0, 0.0, 50.0)), eye(scene.bounds().center()));
    // Of ten pixels on surfaces, `black` have a hundredth of white's luminance.
    let image = |black: usize| RenderedImage {
        width: 11,
        height: 1,
        radiance: (0..11)
            .map(|i| if i < black { [0.04, 0.04, 0.04, 1.0] } else { [2.0, 2.0, 2.0, (i < 10).into()] })
            .collect(),
        display: Vec::new(),
        exposure: Some(-2.0),
        report: Report::default(),
    };
    let of = |black, camera| FillLight::of(&image(black), &scene, camera, &flags(""), &AddedLights::default());
    assert_eq!(of(7, &between), Some(FillLight::Sky(4.0 * FAINT_SKY)));
    assert_eq!(of(7, &outside), Some(FillLight::Studio(4.0 * DIM_STUDIO)));
    assert_eq!((of(6, &between), of(6, &outside)), (None, None));
    // In front of nothing: most pixels show no surface. A room is not lit from outside.
    let mut alone = image(0);
    alone.radiance.iter_mut().skip(5).for_each(|pixel| *pixel = [0.0; 4]);
    assert_eq!(
        FillLight::of(&alone, &scene, &outside, &flags(""), &AddedLights::default()),
        Some(FillLight::Studio(4.0 * DIM_STUDIO))
    );
    assert_eq!(FillLight::of(&alone, &scene, &between, &flags(""), &AddedLights::default()), None);
    let room = demo("cornell").unwrap();
    assert_eq!(FillLight::of(&alone, &room, &outside, &flags(""), &AddedLights::default()), None);
    // By hand it is as bright, whatever is visible; with a scale it is added before.
    let of = |words| FillLight::of(&image(0), &scene, &outside, &flags(words), &AddedLights::default());
    assert_eq!(of("--light-rig studio"), Some(FillLight::Studio(4.0 * DIM_STUDIO)));
    for words in ["", "--light-rig studio --environment-scale 2", "--light-rig studio --sun 0,-1,0,1"] {
        assert_eq!(of(words), None, "{words}");
    }
    let studio = FillLight::Studio(4.0 * DIM_STUDIO);
    for text in [studio.note(), studio.advice()] {
        assert!(text.contains("--light-rig studio --environment-scale 1.2"), "{text}");
    }
}
