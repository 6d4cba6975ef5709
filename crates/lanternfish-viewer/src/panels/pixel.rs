//! The surface at the clicked pixel, and the lights that reach it.

use egui::Ui;
use glam::{UVec2, Vec2, Vec3};
use lanternfish_reference::Probed;
use lanternfish_scene::{AlphaMode, Camera, Material, Scene};

use super::{Facts, State};
use crate::{background::ProbeResult, clusters::ClusterAt, overlay};

/// The clicked pixel.
#[derive(Clone, Debug)]
pub struct Pointed {
    /// Position in the image, 0 to 1 from the top left.
    pub at: Vec2,
    /// Index of the eye's image: 0 is the left or only one.
    pub eye: usize,
    /// The camera at the time of the click; in stereo, the camera between the eyes.
    pub camera: Camera,
    /// The result of the probe; `None` while it is pending.
    pub probe_result: Option<ProbeResult>,
    /// The cluster that contains the surface, if there are clusters.
    pub cluster: Option<ClusterAt>,
    /// The tile that contains the pixel, and the number of lights in its list, if there are tiles.
    pub tile: Option<(UVec2, u32)>,
    /// True if the scene has changed since.
    pub is_outdated: bool,
}

impl Pointed {
    /// The surface at the pixel.
    pub fn place(&self) -> Option<&Probed> {
        self.probe_result.as_ref()?.place.as_ref()
    }
}

/// Draws the panel. Returns true if the camera shall focus on the surface.
pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>) -> bool {
    let Some(pointed) = state.pointed.clone() else {
        ui.label("Click on the image.");
        return false;
    };
    let Some(probe_result) = &pointed.probe_result else {
        ui.label("Reading…");
        return false;
    };
    let Some(place) = &probe_result.place else {
        ui.label("Environment: no surface");
        return false;
    };
    let is_requested =
        ui.button("Focus (F)").on_hover_text("Point the camera at the surface, and orbit around it").clicked();
    ui.checkbox(&mut state.overlays.rays, "Rays to its lights").on_hover_text(overlay::RAYS);
    ui.checkbox(&mut state.overlays.indirect_rays, "Rays of indirect light").on_hover_text(overlay::INDIRECT_RAYS);
    egui::Grid::new("pixel").show(ui, |ui| {
        for (name, value) in facts_of(place, &pointed, facts.scene) {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        }
    });
    if pointed.is_outdated {
        ui.weak("Before the last change:");
    }
    lights(ui, probe_result, facts.scene);
    is_requested
}

fn facts_of(place: &Probed, pointed: &Pointed, scene: &Scene) -> Vec<(&'static str, String)> {
    // The scene may have changed since the click.
    let Some(instance) = scene.instances.get(place.instance) else { return Vec::new() };
    let mesh = scene.meshes.get(instance.mesh).map_or("", |mesh| mesh.name.as_str());
    let mut rows = vec![
        ("position", of_vector(place.p, " m")),
        ("distance", format!("{:.3} m", place.distance)),
        ("normal", of_vector(place.normal, "")),
        ("instance", named(place.instance, &instance.name)),
        ("mesh", format!("{}, primitive {}", named(instance.mesh, mesh), place.primitive)),
    ];
    if let Some((tile, lights)) = pointed.tile {
        rows.push(("tile", format!("{}, {}", tile.x, tile.y)));
        rows.push(("lists", format!("{lights} lights")));
    }
    if let Some(cluster) = &pointed.cluster {
        let coords = cluster.coords;
        rows.push(("cluster", format!("{}, {}, {}", coords.x, coords.y, coords.z)));
        let lists = |lights| format!("{lights} lights, for {} fragments", cluster.fragments);
        rows.push(("lists", cluster.lights.map_or("no lights: the cluster has no fragments".to_owned(), lists)));
    }
    if let Some(material) = scene.materials.get(place.material) {
        rows.push(("material", named(place.material, &material.name)));
        rows.extend(of_material(material));
    }
    rows
}

/// The material's factors, which textures multiply.
fn of_material(material: &Material) -> Vec<(&'static str, String)> {
    let textured = |texture: bool| if texture { " × texture" } else { "" };
    let color = of_vector(material.base_color.truncate(), textured(material.base_color_texture.is_some()));
    let surface = textured(material.metallic_roughness_texture.is_some());
    let mut rows = vec![
        ("base colour", color),
        ("metallic", format!("{:.2}{surface}", material.metallic)),
        ("roughness", format!("{:.2}{surface}", material.perceptual_roughness)),
    ];
    if material.emissive != Vec3::ZERO {
        let unit = if material.emissive_texture.is_some() { " nits × texture" } else { " nits" };
        rows.push(("emission", of_vector(material.emissive, unit)));
    }
    match material.alpha_mode {
        AlphaMode::Opaque | AlphaMode::ShadowCatcher { .. } => {}
        AlphaMode::Mask { cutoff } => rows.push(("alpha", format!("{:.2}, cut at {cutoff:.2}", material.base_color.w))),
        AlphaMode::Blend => rows.push(("alpha", format!("{:.2}, alpha blend", material.base_color.w))),
    }
    if material.transmission > 0.0 {
        rows.push(("transmission", format!("{:.2}", material.transmission)));
    }
    if material.diffuse_transmission > 0.0 {
        rows.push(("diffuse transmission", format!("{:.2}", material.diffuse_transmission)));
    }
    if material.clearcoat > 0.0 {
        rows.push(("clear coat", format!("{:.2}", material.clearcoat)));
    }
    if material.sheen_color != Vec3::ZERO {
        rows.push(("sheen", format!("{:.2}", material.sheen_color)));
    }
    if material.anisotropy > 0.0 {
        rows.push(("anisotropy", format!("{:.2}", material.anisotropy)));
    }
    if material.iridescence > 0.0 {
        rows.push(("film", format!("{:.2}, {:.0} nm", material.iridescence, material.iridescence_thickness)));
    }
    rows
}

fn lights(ui: &mut Ui, probe_result: &ProbeResult, scene: &Scene) {
    ui.strong(match probe_result.light_count {
        0 => "No light in range".to_owned(),
        all if all > probe_result.lights.len() => {
            format!("{} of {all} lights in range, the strongest", probe_result.lights.len())
        }
        1 => "1 light in range".to_owned(),
        all => format!("{all} lights in range"),
    });
    if probe_result.lights.is_empty() {
        return;
    }
    egui::ScrollArea::vertical().id_salt("pixel/lights").max_height(220.0).show(ui, |ui| {
        egui::Grid::new("lights at the pixel").striped(true).show(ui, |ui| {
            for at in &probe_result.lights {
                let name = scene.lights.get(at.light).map_or("", |light| light.name.as_str());
                ui.label(named(at.light, name));
                ui.label(format!("{:.4} lx", at.irradiance.dot(Vec3::new(0.2126, 0.7152, 0.0722))));
                ui.label(if at.distance.is_finite() { format!("{:.2} m", at.distance) } else { "far".to_owned() });
                ui.label(match at.open() {
                    0.0 => "in shadow".to_owned(),
                    visibility if visibility < 0.995 => format!("{:.0} % visible", 100.0 * visibility),
                    _ => "visible".to_owned(),
                });
                ui.end_row();
            }
        });
    });
}

/// `#index`, followed by the name if there is one.
pub fn named(index: usize, name: &str) -> String {
    if name.is_empty() { format!("#{index}") } else { format!("#{index} {name}") }
}

fn of_vector(v: Vec3, unit: &str) -> String {
    format!("{:.3}, {:.3}, {:.3}{unit}", v.x, v.y, v.z)
}
