//! The view of a measurement: a scene with lights and a camera, from flags or from a shot.

use clap::Args;
use lanternfish::settings::{Exposure, ImageSettings, Settings, Shadows};
use lanternfish_cli::{
    apply_lights,
    args::{LightArgs, PartArgs, RenderArgs, ViewArgs},
    camera,
    error::CliError,
    images, light_rig,
    parse::{self, Size},
    report::grouped,
    scene::{self, SceneName},
    shot::{self, Shot},
};
use lanternfish_metrics::RgbImage;
use lanternfish_scene::{Bounds, Camera, Scene};

use crate::{
    bench::Bench,
    ground_truths::{self, GroundTruth, Traced},
    table::Row,
};

/// Flags of a view of a scene.
#[derive(Debug, Args)]
pub struct SubjectArgs {
    /// A shot (.toml), a glTF or OBJ file, or demo:NAME. A shot sets the view, the lights and the look.
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

/// A view of a scene, ready to be rendered.
#[derive(Clone)]
pub struct View {
    pub name: String,
    pub scene: Scene,
    pub camera: Camera,
    /// Requested settings of direct light.
    pub look: Settings,
    pub size: Size,
}

impl View {
    /// Loads the requested scene with its lights, and returns the view with all cameras: one, or those along a shot's
    /// track. Shadows are traced through the BVH, so that the work is equal on every adapter.
    pub fn load(args: &SubjectArgs, keeps_transparent: bool, bench: &Bench) -> Result<(Self, Vec<Camera>), CliError> {
        let shot = shot_of(&args.scene)?;
        let scene = load(&args.scene, &args.part, shot.as_ref(), keeps_transparent, bench)?;
        let Some(shot) = shot else {
            return Self::new(scene, (&args.lights, args.seed), None, std::slice::from_ref(&args.view), args.size);
        };
        Self::of_args(scene, &shot.args, &shot.views(), args.size)
    }

    /// The view of a scene by flags of `render`, with all cameras of `views`.
    pub fn of_args(
        scene: Scene,
        args: &RenderArgs,
        views: &[ViewArgs],
        size: Size,
    ) -> Result<(Self, Vec<Camera>), CliError> {
        Self::new(scene, (&args.lights, args.run.seed), Some(args.settings().image), views, size)
    }

    fn new(
        mut scene: Scene,
        (lights, seed): (&LightArgs, u32),
        shown: Option<ImageSettings>,
        views: &[ViewArgs],
        size: Size,
    ) -> Result<(Self, Vec<Camera>), CliError> {
        apply_lights(&mut scene, lights, seed)?;
        let aspect = size.width as f32 / size.height as f32;
        let (cameras, _) = camera::choose_each(&scene, &Bounds::EMPTY, views, aspect)?;
        light_rig::add(&mut scene, lights, &cameras[0])?;
        // A fixed exposure, so that images are comparable.
        let mut look = Settings::direct_light().with_shadows(Shadows::BVH).with_exposure(Exposure::Ev(0.0));
        lights.settings.0.set(&mut look);
        look.lights.radius = 0.0;
        if let Some(shown) = shown {
            look.image.tone_map = shown.tone_map;
            look.image.exposure = if shown.exposure == Exposure::Auto { look.image.exposure } else { shown.exposure };
        }
        Ok((Self { name: scene.name.clone(), camera: cameras[0].clone(), scene, look, size }, cameras))
    }

    /// The view of another scene.
    pub fn with(&self, scene: Scene) -> Self {
        Self { scene, ..self.clone() }
    }

    /// Triangles, lights and size, as facts of a report.
    pub fn facts(&self) -> Row {
        let facts = Row::default().data("triangles", self.scene.triangle_counts().1);
        let facts = facts.data("lights", self.scene.lights.len());
        facts.data("width", self.size.width).data("height", self.size.height)
    }

    /// The same in words.
    pub fn text(&self) -> String {
        let Size { width, height } = self.size;
        let [triangles, lights] = [self.scene.triangle_counts().1, self.scene.lights.len()].map(|n| grouped(n as u64));
        format!("{width} x {height} pixels, {triangles} triangles, {lights} lights")
    }

    /// Display colours of linear radiance as the view shows it.
    pub fn shown(&self, image: &RgbImage) -> Vec<u8> {
        images::shown(image, self.look.image.exposure, self.look.image.tone_map).0
    }

    /// The view's reference as [`ground_truths`] traces it.
    pub fn reference(&self, bench: &Bench, ground_truth: GroundTruth, spp: u64) -> Result<Traced, CliError> {
        ground_truths::obtain(&bench.folder, ground_truth, &self.subject(spp))
    }

    /// The view for [`ground_truths`].
    pub fn subject(&self, spp: u64) -> ground_truths::Subject<'_> {
        let Self { name, scene, camera, look: settings, size } = self;
        ground_truths::Subject { name, scene, camera, size: *size, settings, spp }
    }
}

/// Reads the shot if `name` is one.
pub fn shot_of(name: &SceneName) -> Result<Option<Shot>, CliError> {
    shot::is_shot(name).then(|| shot::read(name.path())).transpose()
}

/// Reads the scene of a shot, or the scene `name` if there is no shot.
///
/// Transparent surfaces are removed unless `keeps_transparent`: deep images and the BVH do not contain them, but exact
/// rays would hit them.
///
/// # Errors
///
/// Fails if the scene cannot be read or has no surfaces left.
pub fn load(
    name: &SceneName,
    part: &PartArgs,
    shot: Option<&Shot>,
    keeps_transparent: bool,
    bench: &Bench,
) -> Result<Scene, CliError> {
    let (name, part) = shot.map_or((name, part), |shot| (&shot.args.scene, &shot.args.part));
    let doing = format!("Loading {name}");
    let mut scene = bench.step("load", &doing, || scene::load_part(name, part))?;
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
