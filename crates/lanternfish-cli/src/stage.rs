//! A scene with its cameras and its light: how `render` and `reference` begin.

use lanternfish_scene::{Bounds, Camera, Scene};

use crate::{
    camera::{self, Cameras},
    error::CliError,
    light_rig::{self, AddedLights, Lighting},
    motion::{Motion, NOTHING_MOVES},
    progress::Progress,
    render::lit_scene,
    shot::{Shot, ShotFrame},
};

/// A frame, and the camera that was chosen for it at 0 s.
#[derive(Debug)]
pub struct Posed {
    pub frame: ShotFrame,
    pub camera: Camera,
}

impl Posed {
    pub fn of(frame: ShotFrame, cameras: &mut Cameras<'_>) -> Result<Self, CliError> {
        let camera = cameras.choose(&frame.view)?;
        Ok(Self { frame, camera })
    }
}

/// The scene of a shot in its state at 0 s.
pub struct Stage<P> {
    pub scene: Scene,
    /// What moves in it.
    pub motion: Option<Motion>,
    /// The frame that light is added around.
    pub first: Posed,
    /// The frames, with their cameras.
    pub posed: P,
    /// What the flags' rig, or the default one, added.
    pub rig: AddedLights,
    /// How the images depend on light, now that it is known how the scene moves.
    pub lighting: Lighting,
}

impl<P> Stage<P> {
    /// Reads the scene, chooses the cameras of the `first` and of other frames, and adds light around the first, all at
    /// 0 s, whichever frames are requested. `check` sees the scene before cameras and light are chosen, which visits
    /// every placed triangle.
    pub fn of(
        shot: &Shot,
        (first, pose): (ShotFrame, impl FnOnce(&mut Cameras<'_>) -> Result<P, CliError>),
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
        let mut cameras = Cameras::of(&scene, &reach, args.output.size.aspect());
        let (first, posed) = (Posed::of(first, &mut cameras)?, pose(&mut cameras)?);
        if cameras.is_any_inside {
            progress.note(camera::INSIDE);
        }
        drop(cameras);
        // A ground would hide what moves below it.
        let sinks = !reach.is_empty() && reach.min.y < scene.bounds().min.y - 1e-3 * reach.size().max_element();
        lighting.takes_ground &= !sinks;
        let rig = light_rig::light(&mut scene, &args.lights, &first.camera, lighting, |note| progress.note(note))?;
        Ok(Self { scene, motion, first, posed, rig, lighting })
    }
}
