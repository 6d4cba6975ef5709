//! The subject of a measurement: a scene with lights and views, from flags or from a shot.

use clap::Args;
use lanternfish::settings::{Exposure, Settings, Shadows};
use lanternfish_cli::{
    apply_lights,
    args::{LightArgs, PartArgs, ViewArgs},
    camera,
    error::CliError,
    light_rig,
    parse::{self, Size},
    progress::Progress,
    scene::{self, SceneName},
    shot::{self, Shot},
};
use lanternfish_scene::{Bounds, Camera, Scene};

/// Flags of a view of a scene.
#[derive(Debug, Args)]
pub struct SubjectArgs {
    /// A shot (.toml), a glTF or OBJ file, or demo:NAME. A shot sets the view, the lights and the look; flicker is measured along its
    /// track.
    #[arg(default_value = "demo:atrium")]
    pub scene: SceneName,
    /// Width and height of every image, pixels.
    #[arg(long, value_name = "WxH", default_value = "640x360", value_parser = parse::size)]
    pub size: Size,
    /// Seed of the light positions of --lights rain.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    /// Scene of the file.
    #[command(flatten, next_help_heading = "View")]
    pub part: PartArgs,
    /// The camera.
    #[command(flatten, next_help_heading = "View")]
    pub view: ViewArgs,
    /// Lights and environment.
    #[command(flatten, next_help_heading = "Lights (in addition to those of the file)")]
    pub lights: LightArgs,
}

/// A scene with lights, views and settings, ready to be rendered.
pub struct Subject {
    pub scene: Scene,
    /// The views: one, or those along a shot's track.
    pub cameras: Vec<Camera>,
    /// Requested settings with direct light only, with shadows through the BVH, so that the work is equal on every adapter.
    pub look: Settings,
}

impl Subject {
    pub fn load(args: &SubjectArgs, keeps_transparent: bool, progress: &mut Progress) -> Result<Self, CliError> {
        let shot = shot_of(&args.scene)?;
        let views = shot.as_ref().map_or_else(|| vec![args.view.clone()], |shot| shot.views());
        let (lights, seed) = match &shot {
            Some(shot) => (&shot.args.lights, shot.args.run.seed),
            None => (&args.lights, args.seed),
        };
        let mut scene = load(&args.scene, &args.part, shot.as_ref(), keeps_transparent, progress)?;
        apply_lights(&mut scene, lights, seed)?;
        let Size { width, height } = args.size;
        let (cameras, _) = camera::choose_each(&scene, &Bounds::EMPTY, &views, width as f32 / height as f32)?;
        light_rig::add(&mut scene, lights, &cameras[0])?;
        // A fixed exposure, so that images are comparable.
        let mut look = Settings::direct_light().with_shadows(Shadows::BVH).with_exposure(Exposure::Ev(0.0));
        lights.settings.set(&mut look);
        look.lights.radius = 0.0;
        if let Some(shot) = &shot {
            let image = shot.args.settings().image;
            look.image.tone_map = image.tone_map;
            if image.exposure != Exposure::Auto {
                look.image.exposure = image.exposure;
            }
        }
        Ok(Self { scene, cameras, look })
    }
}

/// Reads the shot if `name` is one.
pub fn shot_of(name: &SceneName) -> Result<Option<Shot>, CliError> {
    shot::is_shot(name).then(|| shot::read(name.path(), Vec::new())).transpose()
}

/// Reads the scene of a shot, or the scene `name` if there is no shot.
///
/// Transparent surfaces are removed unless `keeps_transparent`: deep images and the BVH do not contain them, but exact rays would hit them.
///
/// # Errors
///
/// Fails if the scene cannot be read or has no surfaces left.
pub fn load(
    name: &SceneName,
    part: &PartArgs,
    shot: Option<&Shot>,
    keeps_transparent: bool,
    progress: &mut Progress,
) -> Result<Scene, CliError> {
    let (name, part) = shot.map_or((name, part), |shot| (&shot.args.scene, &shot.args.part));
    let doing = format!("Loading {name}");
    let mut scene = progress.step("load", &doing, || scene::load_part(name, part))?;
    if !keeps_transparent {
        leave_out_transparent(&mut scene);
    }
    if scene.bounds().is_empty() {
        return Err(CliError::new(format_args!("{name}: no opaque surfaces"), "choose a scene with opaque surfaces"));
    }
    Ok(scene)
}

fn leave_out_transparent(scene: &mut Scene) {
    for mesh in &mut scene.meshes {
        mesh.primitives.retain(|primitive| !scene.materials[primitive.material].is_transparent());
    }
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::{AlphaMode, Material, Mesh, Primitive};

    use super::*;

    #[test]
    fn transparent_surfaces_are_left_out() {
        let modes = [AlphaMode::Blend, AlphaMode::Opaque, AlphaMode::Mask { cutoff: 0.5 }];
        let materials = modes.map(|alpha_mode| Material { alpha_mode, ..Material::default() }).to_vec();
        let primitives = (0..3).map(|material| Primitive { material, ..Primitive::default() }).collect();
        let mut scene = Scene { materials, meshes: vec![Mesh { primitives, ..Mesh::default() }], ..Scene::default() };
        leave_out_transparent(&mut scene);
        let left: Vec<usize> = scene.meshes[0].primitives.iter().map(|primitive| primitive.material).collect();
        assert_eq!(left, [1, 2]);
    }
}
