//! Contents of a scene, and the list of adapters.

use std::{fmt::Write as _, path::Path};

use clap::Args;
use glam::Vec3;
use lanternfish::Settings;
use lanternfish_metrics::{read_exr_attributes, read_png_texts};
use lanternfish_scene::{AlphaMode, LightKind, Material, Projection, Scene, printable_name, rig};

use crate::{
    args::{PartArgs, demos},
    ending::has_ending,
    error::CliError,
    flags::as_flags,
    output,
    progress::Progress,
    render::metadata::SOFTWARE,
    report::grouped,
    scene::{self, SceneName},
};

#[derive(Debug, Args)]
pub struct InfoArgs {
    #[arg(help = format!(
        "A glTF 2.0 file (.gltf, .glb), an OBJ file, or a built-in scene: {}; or an image (.png, .exr): prints how it was made",
        demos()
    ))]
    #[arg(required_unless_present = "adapters")]
    pub scene: Option<SceneName>,
    #[command(flatten)]
    pub part: PartArgs,
    /// Lists the adapters of this machine: name, driver and optional features.
    #[arg(long)]
    pub adapters: bool,
}

pub fn run(args: &InfoArgs) -> Result<(), CliError> {
    let mut text = String::new();
    if let Some(image) = args.scene.as_ref().and_then(SceneName::image) {
        text += &describe_image(image)?;
    } else if let Some(source) = &args.scene {
        // Print warnings as `render` does.
        let progress = Progress::start(false);
        let scene = scene::load_part(source, &args.part)?;
        text += &describe(&scene);
        text += &memory(&scene);
        drop(progress);
    }
    if args.adapters {
        text += &adapters()?;
    }
    output::print(&text)
}

/// The texts that `render` and `reference` write into images.
fn describe_image(path: &Path) -> Result<String, CliError> {
    let texts = if has_ending(path, "png") { read_png_texts(path)? } else { read_exr_attributes(path)? };
    let own = texts.iter().filter(|(name, _)| name.as_str() == SOFTWARE || name.starts_with("lanternfish."));
    let own: Vec<_> = own.map(|(name, text)| (name, printable_name(&text.replace(char::is_control, " ")))).collect();
    let width = own.iter().map(|(name, _)| name.chars().count()).max();
    let Some(width) = width else { return Ok("the file does not say how it was made\n".to_owned()) };
    Ok(own.iter().map(|(name, text)| format!("{name:<width$}  {text}\n")).collect())
}

/// Variants, cameras and animations that are listed; all are counted.
const MOST_LISTED: usize = 50;

/// Lines of `name  value`.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn add(&mut self, name: &str, value: impl std::fmt::Display) {
        // Writing to a String cannot fail.
        writeln!(self.0, "{name:<13}{}", printable_name(&value.to_string())).expect("String");
    }

    fn count(&mut self, name: &str, count: usize, more: impl std::fmt::Display) {
        self.add(name, format_args!("{}{more}", grouped(count as u64)));
    }
}

/// What the default settings take to render the scene, within the process's limit.
fn memory(scene: &Scene) -> String {
    let mut lines = Lines::default();
    match Settings::default().memory_plan(scene) {
        Ok(plan) => {
            lines.add("memory", format_args!("{} at most to upload it for `render`", bytes(plan.total())));
            let levels = if plan.in_levels { " in two levels" } else { "" };
            let triangles = grouped(plan.traced_triangles);
            lines.add("  rays", format_args!("{}, {triangles} triangles{levels}", bytes(plan.rays)));
            let size = match plan.skipped_levels {
                0 => String::new(),
                skipped => format!(", at 1/{} of their size to fit", 1 << skipped),
            };
            lines.add("  textures", format_args!("{}{size}", bytes(plan.textures)));
            lines.add("  vertices", format_args!("{}, draws {}", bytes(plan.vertices), bytes(plan.draws)));
        }
        Err(error) => lines.add("memory", as_flags(&error.to_string())),
    }
    lines.0
}

fn bytes(count: u64) -> String {
    format!("{:.1} MB", count as f64 / 1e6)
}

fn describe(scene: &Scene) -> String {
    let mut lines = Lines::default();
    lines.add("scene", if scene.name.is_empty() { "(no name)" } else { &scene.name });
    lines.count("meshes", scene.meshes.len(), "");
    lines.count("primitives", scene.meshes.iter().map(|m| m.primitives.len()).sum(), "");
    lines.count("instances", scene.instances.len(), "");
    let (stored, placed) = scene.triangle_counts();
    lines.count("triangles", stored, format_args!(" stored, {} placed", grouped(placed as u64)));

    let modes = scene.materials.iter().map(|material| match material.alpha_mode {
        _ if material.is_transparent() => "blend",
        AlphaMode::Mask { .. } => "mask",
        AlphaMode::Opaque | AlphaMode::Blend | AlphaMode::ShadowCatcher { .. } => "opaque",
    });
    lines.count("materials", scene.materials.len(), by_kind(modes, &["opaque", "mask", "blend"]));
    let features: Vec<_> = scene.materials.iter().flat_map(features).collect();
    if !features.is_empty() {
        let counts = by_kind(features.iter().copied(), &FEATURES);
        lines.add("  with", counts.trim_matches([' ', '(', ')']));
    }
    if !scene.variants.is_empty() {
        lines.count("variants", scene.variants.len(), " of the materials");
    }
    for (index, variant) in scene.variants.iter().enumerate().take(MOST_LISTED) {
        lines.add(&format!("  {index}"), variant);
    }
    lines.count("textures", scene.textures.len(), "");
    let bytes: usize = scene.images.iter().map(|image| image.rgba.len()).sum();
    lines.count("images", scene.images.len(), format_args!(" ({:.1} MiB decoded)", bytes as f64 / f64::from(1 << 20)));

    let kinds = scene.lights.iter().map(|light| match light.kind {
        LightKind::Point => "point",
        LightKind::Spot { .. } => "spot",
        LightKind::Directional => "directional",
        LightKind::Disk { .. } => "disk",
        LightKind::Rectangle { .. } => "rectangle",
    });
    lines.count("lights", scene.lights.len(), by_kind(kinds, &["point", "spot", "directional", "disk", "rectangle"]));
    lines.count("cameras", scene.cameras.len(), "");
    for (index, camera) in scene.cameras.iter().enumerate().take(MOST_LISTED) {
        let projection = match camera.projection {
            Projection::Perspective { fov_y, .. } => format!("perspective, {:.1}° vertical", fov_y.to_degrees()),
            Projection::Frustum { left, right, bottom, top, .. } => format!(
                "perspective, {:.1}° across, {:.1}° vertical",
                (right.atan() - left.atan()).to_degrees(),
                (top.atan() - bottom.atan()).to_degrees()
            ),
            Projection::Orthographic { half_height, .. } => format!("orthographic, {} m high", 2.0 * half_height),
        };
        let name = if camera.name.is_empty() { "(no name)" } else { &camera.name };
        let eye = camera.eye();
        lines.add(
            &format!("  {index}"),
            format_args!("{name}: {projection}, at {:.3},{:.3},{:.3}", eye.x, eye.y, eye.z),
        );
    }

    if !scene.motion.animations.is_empty() {
        lines.count("animations", scene.motion.animations.len(), "");
    }
    for (index, animation) in scene.motion.animations.iter().enumerate().take(MOST_LISTED) {
        let name = if animation.name.is_empty() { "(no name)" } else { &animation.name };
        lines.add(&format!("  {index}"), format_args!("{name}: {:.2} s", animation.duration()));
    }
    if let Some(environment) = &scene.environment {
        lines.add("environment", format_args!("{} × {} pixels", environment.width, environment.height));
    }

    let bounds = scene.bounds();
    if !bounds.is_empty() && rig::is_dark(scene) {
        lines.add("light rig", "studio: the scene has no light of its own, so `render` adds some");
    }
    if bounds.is_empty() {
        lines.add("bounds", "empty: the scene has no geometry");
    } else {
        let (min, max, size) = (bounds.min, bounds.max, bounds.size());
        lines.add(
            "bounds",
            format_args!("{:.3},{:.3},{:.3} to {:.3},{:.3},{:.3} m", min.x, min.y, min.z, max.x, max.y, max.z),
        );
        lines.add("size", format_args!("{:.3} × {:.3} × {:.3} m", size.x, size.y, size.z));
    }
    lines.0
}

/// Features of materials beyond metallic-roughness, in the order of [`FEATURES`].
fn features(material: &Material) -> impl Iterator<Item = &'static str> + use<> {
    let has = [
        material.clearcoat > 0.0,
        material.sheen_color != Vec3::ZERO,
        material.anisotropy != 0.0,
        material.iridescence > 0.0,
        material.transmission > 0.0,
        material.diffuse_transmission > 0.0,
        material.thickness > 0.0,
        material.dispersion > 0.0,
        material.emissive != Vec3::ZERO,
        material.unlit,
    ];
    FEATURES.into_iter().zip(has).filter_map(|(name, has)| has.then_some(name))
}

const FEATURES: [&str; 10] = [
    "clear coat",
    "sheen",
    "anisotropy",
    "iridescence",
    "transmission",
    "diffuse transmission",
    "volume",
    "dispersion",
    "emission",
    "unlit",
];

/// Counts per kind, ` (3 point, 1 spot)`; empty if there are none.
fn by_kind<'k>(kinds: impl Iterator<Item = &'k str> + Clone, names: &[&str]) -> String {
    let counts: Vec<_> = names
        .iter()
        .map(|kind| (kinds.clone().filter(|k| k == kind).count(), kind))
        .filter(|(count, _)| *count > 0)
        .map(|(count, kind)| format!("{} {kind}", grouped(count as u64)))
        .collect();
    if counts.is_empty() { String::new() } else { format!(" ({})", counts.join(", ")) }
}

fn adapters() -> Result<String, CliError> {
    let adapters = lanternfish_gpu::adapters();
    if adapters.is_empty() {
        return Err(lanternfish_gpu::GpuError::NoAdapter.into());
    }
    let mut text = String::new();
    for adapter in adapters {
        let mut lines = Lines::default();
        let yes =
            |has: bool, with: &str, without: &str| if has { format!("yes: {with}") } else { format!("no: {without}") };
        lines.add("adapter", &adapter.name);
        lines.add("  kind", format_args!("{}, through {}", adapter.device_type, adapter.backend));
        lines.add("  driver", &adapter.driver);
        lines.add(
            "  ray query",
            yes(adapter.ray_query, "supports --shadows ray-query and --indirect-tracer ray-query", "rays use the BVH"),
        );
        lines.add(
            "  arrays",
            yes(adapter.texture_arrays, "supports --textures array", "textures are bound per material"),
        );
        lines.add("  timestamps", yes(adapter.timestamps, "--timings times every pass", "--timings has counters only"));
        text += &lines.0;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;
    use lanternfish_scene::{
        Camera, Environment, Image, Instance, Light, Mesh, Primitive, Texture,
        motion::{Animation, Motion},
    };

    use super::*;

    #[test]
    fn all_scene_contents_are_counted() {
        let primitive = Primitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, 2.0, 0.5)],
            indices: vec![0, 1, 2],
            ..Primitive::default()
        };
        let instance =
            |x| Instance { name: String::new(), mesh: 0, world_from_object: Affine3A::from_translation(x * Vec3::X) };
        let material = |alpha_mode| Material { alpha_mode, ..Material::default() };
        let scene = Scene {
            name: "court".to_owned(),
            meshes: vec![Mesh { name: String::new(), primitives: vec![primitive; 2] }],
            instances: (0..1000).map(|i| instance(i as f32)).collect(),
            materials: vec![
                Material { clearcoat: 0.5, unlit: true, ..material(AlphaMode::Opaque) },
                material(AlphaMode::Blend),
                Material { clearcoat: 1.0, ..material(AlphaMode::Opaque) },
            ],
            variants: vec!["red".to_owned(), "blue".to_owned()],
            textures: vec![Texture { image: 0, sampler: 0 }],
            images: vec![Image { name: String::new(), width: 1024, height: 512, rgba: vec![0; 2 << 20] }],
            lights: vec![Light::point(Vec3::ZERO, Vec3::ONE), Light::directional(Vec3::Y, Vec3::ONE)],
            cameras: vec![Camera {
                name: "door".to_owned(),
                ..Camera::look_at(Vec3::Z, Vec3::ZERO, Projection::Perspective { fov_y: 0.5, near: 0.1 })
            }],
            environment: Some(Environment { width: 2, height: 1, pixels: vec![Vec3::ONE; 2], rotation: 0.0 }),
            motion: Motion {
                animations: vec![Animation { name: "nod".to_owned(), ..Animation::default() }],
                ..Motion::default()
            },
            ..Scene::default()
        };
        let text = describe(&scene);
        for line in [
            "scene        court",
            "meshes       1",
            "primitives   2",
            "instances    1,000",
            "triangles    2 stored, 2,000 placed",
            "materials    3 (2 opaque, 1 blend)",
            "  with       2 clear coat, 1 unlit",
            "variants     2 of the materials",
            "  1          blue",
            "textures     1",
            "images       1 (2.0 MiB decoded)",
            "lights       2 (1 point, 1 directional)",
            "cameras      1",
            "animations   1",
            "  0          nod: 0.00 s",
            "  0          door: perspective, 28.6° vertical, at 0.000,0.000,1.000",
            "environment  2 × 1 pixels",
            "bounds       0.000,0.000,0.000 to 1000.000,2.000,0.500 m",
        ] {
            assert!(text.lines().any(|l| l == line), "{line:?} is not in\n{text}");
        }
        assert!(!text.contains("light rig"), "{text}");
        let dark = describe(&Scene { lights: Vec::new(), environment: None, ..scene });
        assert!(dark.lines().any(|line| line.starts_with("light rig    studio")), "{dark}");
        let empty = describe(&Scene::default());
        assert!(empty.contains("no geometry") && !empty.contains("light rig"), "{empty}");
    }
}
