//! A scene with its cameras and its light: how `render` and `reference` begin.

use lanternfish_scene::{Bounds, Camera, Scene};

use crate::{
    args::ViewArgs,
    camera,
    error::CliError,
    light_rig::{self, AddedLights, Lighting},
    motion::{Motion, NOTHING_MOVES},
    progress::Progress,
    render::lit_scene,
    shot::Shot,
};

/// The scene of a shot in its state at 0 s.
pub struct Stage {
    pub scene: Scene,
    /// What moves in it.
    pub motion: Option<Motion>,
    /// One for each view.
    pub cameras: Vec<Camera>,
    /// What the flags' rig, or the default one, added.
    pub rig: AddedLights,
    /// How the images depend on light, now that it is known how the scene moves.
    pub lighting: Lighting,
}

impl Stage {
    /// Reads the scene, chooses a camera for each view, and adds light around the first, all at 0 s, whichever frames are requested.
    /// `check` sees the scene before cameras and light are chosen, which visits every placed triangle.
    pub fn of(
        shot: &Shot,
        views: &[ViewArgs],
        mut lighting: Lighting,
        progress: &mut Progress,
        check: impl FnOnce(&Scene, &mut Progress) -> Result<(), CliError>,
    ) -> Result<Self, CliError> {
        let args = &shot.args;
        let (mut scene, motion) = lit_scene(args, progress)?;
        if motion.is_none() && shot.has_only_a_time() {
            progress.note(NOTHING_MOVES);
        }
        check(&scene, progress)?;
        let reach = motion.as_ref().map_or(Ok(Bounds::EMPTY), |motion| motion.bounds(&mut scene))?;
        let (cameras, is_inside) = camera::choose_each(&scene, &reach, views, args.output.size.aspect())?;
        if is_inside {
            progress.note(camera::INSIDE);
        }
        // A ground would hide what moves below it.
        let sinks = !reach.is_empty() && reach.min.y < scene.bounds().min.y - 1e-3 * reach.size().max_element();
        lighting.takes_ground &= !sinks;
        let rig = light_rig::light(&mut scene, &args.lights, &cameras[0], lighting, |note| progress.note(note))?;
        Ok(Self { scene, motion, cameras, rig, lighting })
    }
}
