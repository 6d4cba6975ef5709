//! Chooses the camera from the flags and the scene's cameras.

use std::cell::LazyCell;

use glam::Vec3;
use lanternfish_scene::{Bounds, Camera, Projection, Scene, near_plane};

use crate::{args::ViewArgs, error::CliError};

/// Vertical field of view if neither file nor flags set one: 45°, that of a 50 mm lens held upright.
const FOV_Y: f32 = std::f32::consts::FRAC_PI_4;

/// The camera that the flags request: `--camera` or `--view`, else the file's first, else one that frames the whole scene.
/// `--eye`, `--target` and `--fov-y` then move, rotate and zoom it. `aspect` is width / height.
pub fn choose(scene: &Scene, flags: &ViewArgs, aspect: f32) -> Result<Camera, CliError> {
    choose_within(scene, &LazyCell::new(|| scene.bounds()), flags, aspect).map(|(camera, _)| camera)
}

/// As [`choose`], for every view of a sequence. The flag is true if a camera was placed inside a closed interior by default.
pub fn choose_each(scene: &Scene, views: &[ViewArgs], aspect: f32) -> Result<(Vec<Camera>, bool), CliError> {
    // Computing the bounds visits every vertex, so do it once.
    let bounds = LazyCell::new(|| scene.bounds());
    let chosen = views.iter().map(|flags| choose_within(scene, &bounds, flags, aspect));
    let chosen = chosen.collect::<Result<Vec<_>, _>>()?;
    let is_inside = chosen.iter().any(|(_, is_inside)| *is_inside);
    Ok((chosen.into_iter().map(|(camera, _)| camera).collect(), is_inside))
}

/// Note for a closed interior whose camera was placed by default.
pub(crate) const INSIDE: &str = "a closed interior, seen from inside; --eye and --target choose another viewpoint, --view iso \
                          shows it from outside";

/// The camera of `flags` at another time. Only a camera of the file moves: it takes its transform from `scene` and stays
/// otherwise as it was `chosen`.
///
/// A camera that frames the scene keeps its first framing, so that the image does not sway with moving objects.
pub(crate) fn follow(
    scene: &Scene,
    bounds: &Bounds,
    flags: &ViewArgs,
    aspect: f32,
    chosen: &Camera,
) -> Result<Camera, CliError> {
    let is_of_file = flags.camera.is_some() || (flags.view.is_none() && !scene.cameras.is_empty());
    if !is_of_file {
        return Ok(chosen.clone());
    }
    let bounds = *bounds;
    choose_within(scene, &LazyCell::new(move || bounds), flags, aspect).map(|(camera, _)| camera)
}

fn choose_within<F: FnOnce() -> Bounds>(
    scene: &Scene,
    bounds: &LazyCell<Bounds, F>,
    flags: &ViewArgs,
    aspect: f32,
) -> Result<(Camera, bool), CliError> {
    let fov_y = flags.fov_y.unwrap_or(FOV_Y);
    let is_placed = flags.eye.is_some() || flags.target.is_some();
    let (mut camera, is_inside) = match (&flags.camera, flags.view, scene.cameras.first()) {
        (Some(wanted), ..) => (named(scene, wanted)?.clone(), false),
        (None, Some(side), _) => (Camera::framing_scene(scene, Some(side), fov_y, aspect), false),
        (None, None, Some(camera)) => (camera.clone(), false),
        // Only its orientation may have been kept.
        (None, None, None) if is_placed => (Camera::framing(bounds, fov_y, aspect), false),
        (None, None, None) => Camera::overview(scene, flags.fov_y, aspect),
    };
    let is_too_far = |eye: Vec3| eye.is_nan() || eye.abs().max_element() > Scene::FARTHEST;
    if let Some(eye) = flags.eye.filter(|eye| is_too_far(*eye)) {
        return Err(CliError::new(format_args!("--eye: the camera stands at {}", far(eye)), "choose a nearer --eye"));
    }
    if is_placed {
        let eye = flags.eye.unwrap_or(camera.eye());
        let forward = camera.world_from_camera.transform_vector3(Vec3::NEG_Z);
        let target = flags.target.unwrap_or(eye + forward);
        if (eye - target).try_normalize().is_none() {
            return Err(CliError::new(
                format_args!("the camera at {},{},{} would look at itself", eye.x, eye.y, eye.z),
                "give --eye and --target different points",
            ));
        }
        camera.world_from_camera = Camera::look_at(eye, target, camera.projection).world_from_camera;
        // The near plane of a file's camera suits its original position only.
        if let Projection::Perspective { near, .. } = &mut camera.projection {
            *near = near.min(near_plane(bounds));
        }
    }
    if let Some(fov_y) = flags.fov_y {
        let near = match camera.projection {
            Projection::Perspective { near, .. } | Projection::Frustum { near, .. } => near,
            Projection::Orthographic { .. } => near_plane(bounds),
        };
        camera.projection = Projection::Perspective { fov_y, near };
    }
    if is_too_far(camera.eye()) {
        let place = far(camera.eye());
        return Err(CliError::new(
            format_args!("{}: the scene is so large that a camera that shows all of it stands at {place}", scene.name),
            "place a camera in it with --eye and --target, or scale the scene down",
        ));
    }
    Ok((camera, is_inside))
}

/// A place beyond the distance that scenes may have, for a message.
fn far(Vec3 { x, y, z }: Vec3) -> String {
    format!("{x:e},{y:e},{z:e} m, farther from the origin than {:e} m", Scene::FARTHEST)
}

/// A camera by name, else by index.
fn named<'s>(scene: &'s Scene, wanted: &str) -> Result<&'s Camera, CliError> {
    let by_name = scene.cameras.iter().find(|camera| camera.name == wanted);
    let by_index = || wanted.parse().ok().and_then(|index: usize| scene.cameras.get(index));
    by_name.or_else(by_index).ok_or_else(|| {
        let what = format!("{}: no camera called {wanted:?}", scene.name);
        if scene.cameras.is_empty() {
            return CliError::new(what, "the file has none; place one with --eye and --target");
        }
        let available: Vec<_> = scene.cameras.iter().enumerate().map(|(i, c)| format!("{i} {:?}", c.name)).collect();
        CliError::new(what, format!("there are {}", available.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;
    use lanternfish_scene::Viewpoint;

    use super::*;

    const PERSPECTIVE: Projection = Projection::Perspective { fov_y: 1.0, near: 5.0 };

    fn scene() -> Scene {
        let camera =
            |name: &str, eye| Camera { name: name.to_owned(), ..Camera::look_at(eye, eye + Vec3::X, PERSPECTIVE) };
        Scene { cameras: vec![camera("left", Vec3::NEG_X), camera("0", Vec3::Y)], ..Scene::default() }
    }

    fn flags() -> ViewArgs {
        ViewArgs { eye: None, target: None, fov_y: None, camera: None, view: None }
    }

    fn forward(camera: &Camera) -> Vec3 {
        camera.world_from_camera.transform_vector3(Vec3::NEG_Z)
    }

    #[test]
    fn cameras_are_selected_by_name_then_by_index() {
        let find = |wanted: &str| choose(&scene(), &ViewArgs { camera: Some(wanted.to_owned()), ..flags() }, 1.0);
        assert_eq!(find("left").unwrap().name, "left");
        assert_eq!(find("1").unwrap().name, "0");
        assert_eq!(find("0").unwrap().eye(), Vec3::Y, "a camera of that name goes before the one of that number");
        let error = find("right").unwrap_err().to_string();
        assert!(error.contains("\"right\"") && error.contains("0 \"left\""), "{error}");
    }

    #[test]
    fn the_first_camera_of_the_file_is_the_default() {
        assert_eq!(choose(&scene(), &flags(), 1.0).unwrap(), scene().cameras[0]);
    }

    #[test]
    fn a_scene_without_cameras_is_framed() {
        let camera = choose(&Scene::default(), &flags(), 1.0).unwrap();
        assert!(camera.eye().is_finite() && forward(&camera).dot(camera.eye()) < 0.0);
        let Projection::Perspective { fov_y, .. } = camera.projection else { panic!("{camera:?}") };
        assert_eq!(fov_y, FOV_Y);
    }

    #[test]
    fn a_camera_that_is_too_far_is_blamed_on_the_file_or_on_the_flag() {
        let mut large = lanternfish_scene::generate::demo("cornell").unwrap();
        large.name = "large".to_owned();
        large.cameras.clear();
        let size = large.bounds().size().max_element();
        for instance in &mut large.instances {
            instance.world_from_object = Affine3A::from_scale(Vec3::splat(0.9e12 / size)) * instance.world_from_object;
        }
        let error = choose(&large, &flags(), 1.0).unwrap_err().to_string();
        assert!(error.starts_with("error: large: the scene is so large") && error.contains("--eye"), "{error}");
        let near = ViewArgs { eye: Some(Vec3::ZERO), target: Some(Vec3::X), ..flags() };
        assert!(choose(&large, &near, 1.0).is_ok());
        let error = choose(&scene(), &ViewArgs { eye: Some(Vec3::splat(2e12)), ..flags() }, 1.0).unwrap_err();
        assert!(error.to_string().starts_with("error: --eye: the camera stands at 2e12,2e12,2e12 m"), "{error}");
    }

    #[test]
    fn a_side_goes_before_the_files_cameras() {
        let sides = |view| choose(&scene(), &ViewArgs { view: Some(view), ..flags() }, 1.0).unwrap();
        assert!(forward(&sides(Viewpoint::Left)).abs_diff_eq(Vec3::X, 1e-6));
        assert!(forward(&sides(Viewpoint::Top)).abs_diff_eq(Vec3::NEG_Y, 1e-6));
        let zoomed = ViewArgs { view: Some(Viewpoint::Front), fov_y: Some(0.3), ..flags() };
        let zoomed = choose(&scene(), &zoomed, 1.0).unwrap();
        // Framing adapts the distance to the field of view: smaller angle, larger distance.
        assert!(zoomed.eye().length() > 2.0 * sides(Viewpoint::Front).eye().length());
    }

    #[test]
    fn eye_and_target_move_and_turn() {
        let (eye, target) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, -9.0));
        let moved = choose(&scene(), &ViewArgs { eye: Some(eye), ..flags() }, 1.0).unwrap();
        assert!(moved.eye() == eye && forward(&moved).abs_diff_eq(Vec3::X, 1e-6));
        let turned = choose(&scene(), &ViewArgs { target: Some(Vec3::Y - Vec3::X), ..flags() }, 1.0).unwrap();
        assert!(turned.eye() == Vec3::NEG_X && forward(&turned).abs_diff_eq(Vec3::Y, 1e-6));
        let both = choose(&scene(), &ViewArgs { eye: Some(eye), target: Some(target), ..flags() }, 1.0).unwrap();
        assert!(both.eye() == eye && forward(&both).abs_diff_eq(Vec3::NEG_Z, 1e-6));
        let Projection::Perspective { near, .. } = both.projection else { panic!("{both:?}") };
        assert!(near < 5.0, "a moved camera does not keep a near plane that cuts into the scene");
        assert!(choose(&scene(), &ViewArgs { eye: Some(eye), target: Some(eye), ..flags() }, 1.0).is_err());
    }

    #[test]
    fn the_angle_of_view_is_set_without_moving() {
        let zoomed = choose(&scene(), &ViewArgs { fov_y: Some(0.3), ..flags() }, 1.0).unwrap();
        assert_eq!(zoomed.projection, Projection::Perspective { fov_y: 0.3, near: 5.0 });
        assert_eq!(zoomed.world_from_camera, scene().cameras[0].world_from_camera);
    }
}
