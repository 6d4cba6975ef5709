//! Chooses the camera from the flags and the scene's cameras.

use std::cell::LazyCell;

use glam::{Mat3A, Vec3};
use lanternfish_scene::{Bounds, Camera, Projection, Scene, near_plane};

use crate::{args::ViewArgs, error::CliError};

/// Vertical field of view if neither file nor flags set one: 45°, that of a 50 mm lens held upright.
const FOV_Y: f32 = std::f32::consts::FRAC_PI_4;

/// The camera that the flags request: `--camera` or `--view`, else the file's first, else one that frames the whole
/// scene. `--eye`, `--target` and `--fov-y` then move, rotate and zoom it. `aspect` is width / height.
pub fn choose(scene: &Scene, flags: &ViewArgs, aspect: f32) -> Result<Camera, CliError> {
    Cameras::of(scene, &Bounds::EMPTY, aspect).choose(flags)
}

/// As `Cameras::choose`, for every view. The flag is true if a camera was placed inside a closed interior by default.
pub fn choose_each(
    scene: &Scene,
    reach: &Bounds,
    views: &[ViewArgs],
    aspect: f32,
) -> Result<(Vec<Camera>, bool), CliError> {
    let mut cameras = Cameras::of(scene, reach, aspect);
    let chosen = views.iter().map(|view| cameras.choose(view)).collect::<Result<_, _>>()?;
    Ok((chosen, cameras.is_any_inside))
}

/// Chooses cameras for the frames of a sequence.
pub(crate) struct Cameras<'s> {
    scene: &'s Scene,
    /// Computing them visits every vertex, so do it once.
    bounds: LazyCell<Bounds, Box<dyn FnOnce() -> Bounds + 's>>,
    reach: &'s Bounds,
    aspect: f32,
    /// Framing visits every vertex too: the frames of an orbit share it.
    last: Option<(ViewArgs, (Camera, bool))>,
    /// True if a camera was placed inside a closed interior by default.
    pub is_any_inside: bool,
}

impl<'s> Cameras<'s> {
    /// `reach` is the box through which the scene moves, empty if nothing moves: a camera that frames the scene shows
    /// all of it.
    pub fn of(scene: &'s Scene, reach: &'s Bounds, aspect: f32) -> Self {
        let bounds: Box<dyn FnOnce() -> Bounds + 's> = Box::new(|| scene.bounds());
        Self { scene, bounds: LazyCell::new(bounds), reach, aspect, last: None, is_any_inside: false }
    }

    /// As [`choose`].
    pub fn choose(&mut self, flags: &ViewArgs) -> Result<Camera, CliError> {
        let still = ViewArgs { orbit_angle: 0.0, ..flags.clone() };
        let (_, (camera, is_inside)) = match self.last.take() {
            Some(chosen) if chosen.0 == still => self.last.insert(chosen),
            _ => {
                let chosen = choose_within(self.scene, &self.bounds, self.reach, &still, self.aspect)?;
                self.last.insert((still, chosen))
            }
        };
        self.is_any_inside |= *is_inside;
        Ok(revolved(camera, &self.bounds, *is_inside, flags))
    }
}

/// True if the box that moving parts reach is visibly larger than their box at 0 s.
fn reaches_beyond(reach: &Bounds, bounds: &Bounds) -> bool {
    let beyond = (bounds.min - reach.min).max(reach.max - bounds.max);
    !reach.is_empty() && !bounds.is_empty() && beyond.max_element() > 0.02 * bounds.size().max_element()
}

/// The camera of an orbit at `flags.orbit_angle`; see `--orbit` for its axis.
fn revolved<F: FnOnce() -> Bounds>(
    camera: &Camera,
    bounds: &LazyCell<Bounds, F>,
    is_inside: bool,
    flags: &ViewArgs,
) -> Camera {
    // The image without an orbit, to the bit.
    if flags.orbit_angle == 0.0 {
        return camera.clone();
    }
    let center = match flags.target {
        Some(target) => target,
        None if is_inside => camera.eye(),
        // Without geometry: the point that is framed then.
        None if bounds.is_empty() => Vec3::ZERO,
        None => bounds.center(),
    };
    let rotation = Mat3A::from_rotation_y(flags.orbit_angle);
    let mut revolved = camera.clone();
    let pose = &mut revolved.world_from_camera;
    pose.matrix3 = rotation * pose.matrix3;
    pose.translation = (center + rotation * (camera.eye() - center)).into();
    revolved
}

/// Note for a closed interior whose camera was placed by default.
pub(crate) const INSIDE: &str = "a closed interior, seen from inside; --eye and --target choose another viewpoint, --view iso \
                          shows it from outside";

/// The camera of `flags` at another time. Only a camera of the file moves: it takes its transform from `scene` and
/// stays otherwise as it was `chosen`.
///
/// A camera that frames the scene keeps its first framing, so that the image does not sway with moving objects.
pub(crate) fn follow(
    scene: &Scene,
    bounds: &Bounds,
    flags: &ViewArgs,
    aspect: f32,
    chosen: &Camera,
) -> Result<Camera, CliError> {
    let is_of_file = flags.camera.is_some()
        || (flags.view.is_none() && !flags.is_turned() && flags.recorded.is_none() && !scene.cameras.is_empty());
    if !is_of_file {
        return Ok(chosen.clone());
    }
    let bounds = *bounds;
    let bounds = LazyCell::new(move || bounds);
    let (camera, is_inside) = choose_within(scene, &bounds, &Bounds::EMPTY, flags, aspect)?;
    Ok(revolved(&camera, &bounds, is_inside, flags))
}

/// The camera of `flags` without their orbit, and whether it was placed inside a closed interior by default.
fn choose_within<F: FnOnce() -> Bounds>(
    scene: &Scene,
    bounds: &LazyCell<Bounds, F>,
    reach: &Bounds,
    flags: &ViewArgs,
    aspect: f32,
) -> Result<(Camera, bool), CliError> {
    let fov_y = flags.fov_y.unwrap_or(FOV_Y);
    let is_placed = flags.eye.is_some() || flags.target.is_some();
    let (mut camera, is_inside) = match (&flags.camera, flags.view, scene.cameras.first()) {
        _ if let Some(camera) = &flags.recorded => (camera.clone(), false),
        (Some(wanted), ..) => (named(scene, wanted)?.clone(), false),
        _ if flags.is_turned() => {
            let turn = [flags.azimuth, flags.elevation].map(|angle| angle.map(f32::to_radians));
            (Camera::framing_turned(scene, turn, fov_y, aspect), false)
        }
        (None, Some(side), _) => (Camera::framing_scene(scene, Some(side), fov_y, aspect), false),
        (None, None, Some(camera)) => (camera.clone(), false),
        // Only its orientation may have been kept.
        (None, None, None) if is_placed || flags.pose.is_some() => (Camera::framing(bounds, fov_y, aspect), false),
        (None, None, None) => match Camera::overview(scene, flags.fov_y, aspect) {
            (_, false) if reaches_beyond(reach, bounds) => (Camera::framing(reach, fov_y, aspect), false),
            overview => overview,
        },
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
    let near = || match camera.projection {
        Projection::Perspective { near, .. } | Projection::Frustum { near, .. } => near,
        Projection::Orthographic { .. } => near_plane(bounds),
    };
    if let Some([fx, fy, cx, cy]) = flags.intrinsics {
        let [width, height] = flags.size.map(|side| side as f32);
        let ([left, right], [bottom, top]) = ([-cx / fx, (width - cx) / fx], [(cy - height) / fy, cy / fy]);
        camera.projection = Projection::Frustum { left, right, bottom, top, near: near() };
    } else if let Some(fov_y) = flags.fov_y {
        camera.projection = Projection::Perspective { fov_y, near: near() };
    }
    if let Some(pose) = flags.pose {
        camera.world_from_camera = flags.pose_convention.to_opengl(pose);
        if let Projection::Perspective { near, .. } | Projection::Frustum { near, .. } = &mut camera.projection {
            *near = near.min(near_plane(bounds));
        }
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
        CliError::new(what, format!("choose one of these by its number or name: {}", available.join(", ")))
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
        ViewArgs::default()
    }

    fn forward(camera: &Camera) -> Vec3 {
        camera.world_from_camera.transform_vector3(Vec3::NEG_Z)
    }

    #[test]
    fn framed_scenes_stay_in_the_image_while_they_move() {
        let scene = Scene { cameras: Vec::new(), ..lanternfish_scene::generate::demo("furnace").unwrap() };
        let bounds = scene.bounds();
        let reach = Bounds { max: bounds.max + 4.0 * bounds.size().x * Vec3::X, ..bounds };
        let of = |flags: ViewArgs, reach| choose_each(&scene, reach, &[flags], 1.5).unwrap().0.swap_remove(0);
        let shows = |camera: &Camera, bounds: &Bounds| {
            let camera_from_world = camera.world_from_camera.inverse();
            let slope = (0.5 * FOV_Y).tan();
            bounds.corners().iter().all(|corner| {
                let p = camera_from_world.transform_point3(*corner);
                p.z < 0.0 && p.x.abs() <= -1.5 * slope * p.z && p.y.abs() <= -slope * p.z
            })
        };
        let (still, moving) = (of(flags(), &Bounds::EMPTY), of(flags(), &reach));
        assert!(shows(&still, &bounds) && !shows(&still, &reach) && shows(&moving, &reach));
        // Not what flags place, nor what hardly moves.
        let placed = ViewArgs { eye: Some(20.0 * Vec3::Z), ..flags() };
        assert_eq!(of(placed.clone(), &reach), of(placed, &Bounds::EMPTY));
        assert_eq!(of(flags(), &bounds), still);
    }

    #[test]
    fn cameras_are_selected_by_name_then_by_index() {
        let find = |wanted: &str| choose(&scene(), &ViewArgs { camera: Some(wanted.to_owned()), ..flags() }, 1.0);
        assert_eq!(find("left").unwrap().name, "left");
        assert_eq!(find("1").unwrap().name, "0");
        assert_eq!(find("0").unwrap().eye(), Vec3::Y, "a camera of that name goes before the one of that number");
        assert_eq!(choose(&scene(), &flags(), 1.0).unwrap(), scene().cameras[0], "the default");
        let error = find("right").unwrap_err().to_string();
        assert!(error.contains("\"right\"") && error.contains("0 \"left\""), "{error}");
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
        // So do angles.
        for (azimuth, elevation, expected) in [(Some(90.0), 0.0, Vec3::NEG_X), (None, 90.0, Vec3::NEG_Y)] {
            let turned = ViewArgs { azimuth, elevation: Some(elevation), ..flags() };
            assert!(forward(&choose(&scene(), &turned, 1.0).unwrap()).abs_diff_eq(expected, 1e-6));
        }
    }

    #[test]
    fn eye_and_target_move_and_turn() {
        let zoomed = choose(&scene(), &ViewArgs { fov_y: Some(0.3), ..flags() }, 1.0).unwrap();
        assert_eq!(zoomed.projection, Projection::Perspective { fov_y: 0.3, near: 5.0 });
        assert_eq!(zoomed.world_from_camera, scene().cameras[0].world_from_camera, "without moving");
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
    fn an_orbit_starts_at_the_single_image_and_keeps_distance_and_height() {
        let mut framed = lanternfish_scene::generate::demo("furnace").unwrap();
        framed.cameras.clear();
        framed.instances.iter_mut().for_each(|instance| {
            instance.world_from_object =
                Affine3A::from_translation(Vec3::new(7.0, 3.0, -2.0)) * instance.world_from_object;
        });
        let mut with_camera = framed.clone();
        with_camera.cameras = scene().cameras;
        let target = Vec3::new(8.0, 1.0, 2.0);
        let aimed = ViewArgs { eye: Some(Vec3::new(4.0, 5.0, 6.0)), target: Some(target), ..flags() };
        let middle = framed.bounds().center();
        let top = ViewArgs { view: Some(Viewpoint::Top), ..flags() };
        for (scene, still, center) in [
            (&framed, &flags(), middle),
            (&framed, &top, middle),
            (&framed, &aimed, target),
            (&with_camera, &flags(), middle),
        ] {
            let orbit = |i: u16| ViewArgs { orbit_angle: (f32::from(i) * 60.0).to_radians(), ..still.clone() };
            let views: Vec<_> = (0..6).map(orbit).collect();
            let (cameras, is_inside) = choose_each(scene, &Bounds::EMPTY, &views, 1.5).unwrap();
            assert!(!is_inside);
            assert_eq!(cameras[0], choose(scene, still, 1.5).unwrap());
            // The last camera is as far from the first as any two neighbours are.
            for (camera, next) in cameras.iter().zip(cameras.iter().cycle().skip(1)) {
                assert_eq!((camera.validate(), camera.projection), (Ok(()), cameras[0].projection));
                let turned = |v: Vec3| glam::Quat::from_rotation_y(60f32.to_radians()) * v;
                let (expected, eye) = (center + turned(camera.eye() - center), next.eye());
                assert!(eye.abs_diff_eq(expected, 1e-4), "{eye} is not at {expected}");
                assert!(forward(next).abs_diff_eq(turned(forward(camera)), 1e-5));
                assert!((eye.y - camera.eye().y).abs() < 1e-5);
            }
        }
        // Counter-clockwise seen from above: from the front to the right.
        let front = ViewArgs { view: Some(Viewpoint::Front), orbit_angle: 90f32.to_radians(), ..flags() };
        assert!(forward(&choose(&framed, &front, 1.0).unwrap()).abs_diff_eq(Vec3::NEG_X, 1e-5));
    }

    #[test]
    fn in_a_closed_interior_an_orbit_rotates_the_camera_where_it_is() {
        let camera = Camera::look_at(Vec3::X, Vec3::ZERO, PERSPECTIVE);
        let bounds = LazyCell::new(|| Bounds { min: Vec3::NEG_ONE, max: Vec3::splat(3.0) });
        let half = ViewArgs { orbit_angle: 180f32.to_radians(), ..flags() };
        let revolved = revolved(&camera, &bounds, true, &half);
        assert!(revolved.eye() == Vec3::X && forward(&revolved).abs_diff_eq(Vec3::X, 1e-6));
    }
}
