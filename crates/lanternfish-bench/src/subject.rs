//! What benches of light measure: a scene, its lights and its views, from flags or from a shot.

use lanternfish::settings::{Exposure, Settings, Shadows};
use lanternfish_scene::{Camera, Scene};

use super::deep_images::leave_out_blended;
use lanternfish_cli::{
    apply_lights,
    args::{LightArgs, PartArgs, ViewArgs},
    camera,
    error::CliError,
    light_rig,
    parse::Size,
    progress::Progress,
    scene::{self, SceneName},
    shot,
};

/// A scene without blended surfaces, ready to be rendered.
pub struct Subject {
    pub scene: Scene,
    /// The views: one, or those along a shot's track.
    pub cameras: Vec<Camera>,
    /// Direct light as it is asked for, through the BVH, so that it is the same work on every adapter.
    pub look: Settings,
}

/// Where a subject comes from.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    /// The scene, or a shot, which then says everything but the size.
    pub scene: &'a SceneName,
    pub part: &'a PartArgs,
    pub view: &'a ViewArgs,
    pub lights: &'a LightArgs,
    pub seed: u32,
    pub size: Size,
}

impl Subject {
    pub fn load(source: &Source<'_>, progress: &mut Progress) -> Result<Self, CliError> {
        let shot = shot::is_shot(source.scene).then(|| shot::read(source.scene.path(), Vec::new())).transpose()?;
        let views = shot.as_ref().map_or_else(|| vec![source.view.clone()], |shot| shot.views());
        let (name, part, lights, seed) = match &shot {
            Some(shot) => (&shot.args.scene, &shot.args.part, &shot.args.lights, shot.args.run.seed),
            None => (source.scene, source.part, source.lights, source.seed),
        };
        let doing = format!("Loading {name}");
        let mut scene = progress.step("load", &doing, || scene::load_part(name, part.scene_of_file.as_deref()))?;
        leave_out_blended(&mut scene);
        if scene.bounds().is_empty() {
            return Err(CliError::new(format_args!("{name}: no opaque surface"), "name a scene that has some"));
        }
        apply_lights(&mut scene, lights, seed)?;
        let Size { width, height } = source.size;
        let (cameras, _) = camera::choose_each(&scene, &views, width as f32 / height as f32)?;
        light_rig::add(&mut scene, lights, &cameras[0])?;
        let mut look = Settings {
            shadows: Shadows::BVH,
            attenuation: lights.attenuation,
            range_threshold: lights.range_threshold,
            // One for all pictures, which are compared with each other.
            exposure: Exposure::Ev(0.0),
            ..Settings::direct_light()
        };
        if let Some(shot) = &shot {
            look.tone_map = shot.args.look.tone_map;
            if shot.args.look.exposure != Exposure::Auto {
                look.exposure = shot.args.look.exposure;
            }
        }
        Ok(Self { scene, cameras, look })
    }
}
