//! Overlays: world-space lines, projected on the host.
//!
//! The lines are drawn over the image without a depth test.

mod birds_eye;
mod project;

use egui::{Color32, Painter, Rect, Shape, Stroke, Ui};
use glam::Vec3;
use lanternfish::{
    settings::Settings,
    techniques::{ClusterShape, Clustered},
};
use lanternfish_scene::{Camera, Light, LightKind, Scene};

pub use self::birds_eye::BirdsEye;
use self::project::{Projector, edges, frustum};
use crate::background::ProbeResult;

/// Maximum number of drawn clusters. Those with the most lights are drawn.
const MOST_CLUSTERS: usize = 6000;
/// Maximum number of lights with drawn ranges. The nearest are drawn.
const MOST_LIGHTS: usize = 64;
/// Line segments of a circle.
const SEGMENTS: usize = 48;

const OF_CAMERA: Color32 = Color32::from_rgb(60, 230, 80);
const OF_CLUSTERING: Color32 = Color32::from_rgb(240, 60, 50);
const OF_GRID: Color32 = Color32::from_rgba_premultiplied(70, 70, 70, 70);
/// Colour key of rays to lights.
pub const RAYS: &str = "Green: visible; yellow: partly visible; red: in shadow";
const VISIBLE: Color32 = Color32::from_rgb(90, 240, 90);
const PARTLY_VISIBLE: Color32 = Color32::from_rgb(250, 210, 60);
const BLOCKED: Color32 = Color32::from_rgb(240, 70, 60);
/// Colour key of indirect rays.
pub const INDIRECT_RAYS: &str =
    "64 cosine-distributed rays, traced through the scene's triangles. Blue: hits a surface; grey: leaves the scene";
const HIT: Color32 = Color32::from_rgb(110, 190, 255);
const MISS: Color32 = Color32::from_rgba_premultiplied(120, 120, 120, 160);

/// Switches and state of overlays.
#[derive(Debug)]
pub struct Overlays {
    /// True if a change to or from the bird's-eye view is requested.
    pub wants_birds_eye: bool,
    /// The bird's-eye view; `None` while it is off.
    pub birds_eye: Option<BirdsEye>,
    /// True if the bird's-eye view shows visible clusters.
    pub clusters: bool,
    /// True if tiles or columns of clusters are drawn over the image.
    pub grid: bool,
    /// True if light ranges are drawn.
    pub ranges: bool,
    /// True if rays from the clicked pixel to its lights are drawn.
    pub rays: bool,
    /// True if indirect rays from the clicked pixel are drawn.
    pub indirect_rays: bool,
}

impl Default for Overlays {
    fn default() -> Self {
        Self {
            wants_birds_eye: false,
            birds_eye: None,
            clusters: true,
            grid: false,
            ranges: false,
            rays: false,
            indirect_rays: false,
        }
    }
}

/// The inputs of overlays.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The render settings.
    pub settings: &'a Settings,
    /// The current camera.
    pub camera: &'a Camera,
    /// The probe of the clicked pixel.
    pub probe_result: Option<&'a ProbeResult>,
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
}

/// Draws the requested overlays over the image in `rect`.
pub fn paint(ui: &Ui, rect: Rect, overlays: &Overlays, drawn: &Drawn<'_>) {
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let wire = Wire { painter: &painter, projector: Projector::new(drawn.camera, rect) };
    if overlays.grid && overlays.birds_eye.is_none() {
        grid(&painter, rect, drawn);
    }
    if overlays.ranges {
        ranges(&wire, overlays.birds_eye.as_ref().map_or(drawn.camera, |view| &view.first.camera), drawn);
    }
    if let Some(view) = &overlays.birds_eye {
        draw_birds_eye(&wire, view, overlays.clusters, drawn.scene);
    }
    if let Some(probe_result) = drawn.probe_result.filter(|_| overlays.indirect_rays) {
        indirect_rays(&wire, probe_result, drawn.scene);
    }
    if let Some(probe_result) = drawn.probe_result.filter(|_| overlays.rays) {
        rays(&wire, probe_result, drawn.scene);
    }
}

/// Draws world-space lines.
struct Wire<'a> {
    painter: &'a Painter,
    projector: Projector,
}

impl Wire<'_> {
    fn line(&self, a: Vec3, b: Vec3, stroke: Stroke) {
        if let Some(points) = self.projector.segment(a, b) {
            self.painter.add(Shape::line_segment(points, stroke));
        }
    }

    fn edges(&self, corners: &[Vec3; 8], stroke: Stroke) {
        edges(corners).for_each(|[a, b]| self.line(a, b, stroke));
    }

    /// Three great circles.
    fn sphere(&self, middle: Vec3, radius: f32, stroke: Stroke) {
        for [u, v] in [[Vec3::X, Vec3::Y], [Vec3::Y, Vec3::Z], [Vec3::Z, Vec3::X]] {
            let at = |i: usize| {
                let (sin, cos) = (std::f32::consts::TAU * i as f32 / SEGMENTS as f32).sin_cos();
                middle + radius * (cos * u + sin * v)
            };
            (0..SEGMENTS).for_each(|i| self.line(at(i), at(i + 1), stroke));
        }
    }
}

/// Side of a tile or cluster column, pixels; `None` if the settings use neither.
fn spacing(settings: &Settings) -> Option<u32> {
    let tiles = settings.get("tile-size").and_then(|pixels| pixels.parse().ok());
    let clusters = settings.culling.get::<Clustered>().and_then(|clustered| match clustered.shape {
        ClusterShape::Perspective { pixels } => Some(pixels),
        _ => None,
    });
    tiles.or(clusters)
}

/// True if the settings divide the image into tiles or cluster columns.
pub fn has_grid(settings: &Settings) -> bool {
    spacing(settings).is_some()
}

/// Draws the edges of tiles or cluster columns, which start at the left and top edges.
fn grid(painter: &Painter, rect: Rect, drawn: &Drawn<'_>) {
    let Some(pixels) = spacing(drawn.settings) else { return };
    let [width, height] = drawn.size;
    let stroke = Stroke::new(1.0, OF_GRID);
    for x in (pixels..width).step_by(pixels as usize) {
        painter.vline(egui::lerp(rect.x_range(), x as f32 / width as f32), rect.y_range(), stroke);
    }
    for y in (pixels..height).step_by(pixels as usize) {
        painter.hline(rect.x_range(), egui::lerp(rect.y_range(), y as f32 / height as f32), stroke);
    }
}

/// Draws range spheres of the lights nearest to a camera, in each light's colour.
fn ranges(wire: &Wire<'_>, camera: &Camera, drawn: &Drawn<'_>) {
    let settings = drawn.settings;
    let reach = |light: &Light| light.effective_range(settings.lights.attenuation, settings.lights.range_threshold);
    let size = drawn.scene.bounds().size().length();
    let is_shown = |light: &&Light| light.kind != LightKind::Directional && reach(light) < 10.0 * size;
    let mut lights: Vec<&Light> = drawn.scene.lights.iter().filter(is_shown).collect();
    let distance = |light: &Light| light.position.distance(camera.eye());
    lights.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    for light in lights.into_iter().take(MOST_LIGHTS) {
        let color = light.intensity / light.intensity.max_element().max(f32::MIN_POSITIVE);
        let [r, g, b] = color.to_array().map(|channel| (80.0 + 175.0 * channel.clamp(0.0, 1.0)) as u8);
        wire.sphere(light.position, reach(light), Stroke::new(1.0, Color32::from_rgba_unmultiplied(r, g, b, 150)));
        if let Some(at) = wire.projector.point(light.position) {
            wire.painter.circle_filled(at, 2.5, Color32::from_rgb(r, g, b));
        }
    }
}

/// Draws the first camera's frustum, its cluster grids, and visible clusters in full extent, coloured by light count.
fn draw_birds_eye(wire: &Wire<'_>, view: &BirdsEye, shows_clusters: bool, scene: &Scene) {
    if shows_clusters {
        for (corners, lights) in &view.clusters {
            wire.edges(corners, Stroke::new(1.0, heat(*lights)));
        }
    }
    for outline in &view.outlines {
        wire.edges(outline, Stroke::new(1.5, OF_CLUSTERING));
    }
    let camera = &view.first.camera;
    let corners = frustum(camera, view.aspect, [camera.projection.near(), birds_eye::far_of(camera, &scene.bounds())]);
    wire.edges(&corners, Stroke::new(2.0, OF_CAMERA));
}

/// The colours of debug view `cluster-lights`: 0 to 1,023 lights, a factor of four per colour.
fn heat(lights: u32) -> Color32 {
    const STOPS: [[f32; 3]; 6] = [
        [90.0, 90.0, 90.0],
        [60.0, 60.0, 255.0],
        [0.0, 255.0, 255.0],
        [0.0, 255.0, 0.0],
        [255.0, 255.0, 0.0],
        [255.0, 0.0, 0.0],
    ];
    let position = ((1.0 + lights as f32).log2() / 2.0).min(5.0);
    let first = (position as usize).min(4);
    let fraction = position - first as f32;
    let channel = |i: usize| (STOPS[first][i] + fraction * (STOPS[first + 1][i] - STOPS[first][i])) as u8;
    Color32::from_rgba_unmultiplied(channel(0), channel(1), channel(2), 130)
}

/// Draws rays from the clicked surface to each of its lights.
fn rays(wire: &Wire<'_>, probe_result: &ProbeResult, scene: &Scene) {
    let Some(place) = &probe_result.place else { return };
    let size = scene.bounds().size().length();
    for at in &probe_result.lights {
        let Some(light) = scene.lights.get(at.light) else { continue };
        let end = match light.kind {
            LightKind::Directional => place.p - size * light.direction,
            _ => light.position,
        };
        let color = match at.open() {
            visibility if visibility >= 0.995 => VISIBLE,
            visibility if visibility > 0.0 => PARTLY_VISIBLE,
            _ => BLOCKED,
        };
        wire.line(place.p, end, Stroke::new(1.5, color));
        if let Some(end) = wire.projector.point(end) {
            wire.painter.circle_filled(end, 3.0, color);
        }
    }
    if let Some(at) = wire.projector.point(place.p) {
        wire.painter.circle_filled(at, 3.0, Color32::WHITE);
    }
}

/// Draws indirect rays from the clicked surface to their hit points.
fn indirect_rays(wire: &Wire<'_>, probe_result: &ProbeResult, scene: &Scene) {
    let Some(place) = &probe_result.place else { return };
    let size = scene.bounds().size().length();
    for ray in &probe_result.rays {
        let end = place.p + ray.distance.unwrap_or(size) * ray.direction;
        let color = if ray.distance.is_some() { HIT } else { MISS };
        wire.line(place.p, end, Stroke::new(1.0, color));
        if let (Some(end), true) = (wire.projector.point(end), ray.distance.is_some()) {
            wire.painter.circle_filled(end, 2.5, color);
        }
    }
}

/// Draws the switches of overlays.
pub fn switches(ui: &mut Ui, overlays: &mut Overlays, settings: &Settings) {
    let is_shown = overlays.birds_eye.is_some();
    let text = if is_shown { "Back to the camera (V)" } else { "Bird\u{2019}s-eye view (V)" };
    let button = ui.button(text).on_hover_text(
        "A second camera shows the first one: its frustum in green, its cluster grid in red, and its visible clusters",
    );
    overlays.wants_birds_eye ^= button.clicked();
    if let Some(view) = &overlays.birds_eye {
        ui.checkbox(&mut overlays.clusters, "Visible clusters").on_hover_text(
            "In full extent. Lights per cluster: grey 0, blue 3, cyan 15, green 63, yellow 255, red 1,023",
        );
        ui.label(match (view.clusters.len(), view.all) {
            (_, 0) => "Only `culling clustered` has clusters.".to_owned(),
            (drawn, all) if drawn < all => format!("{drawn} of {all} clusters, those with the most lights"),
            (_, all) => format!("{all} visible clusters"),
        });
    }
    ui.add_enabled(has_grid(settings), egui::Checkbox::new(&mut overlays.grid, "Tiles or clusters on the image"))
        .on_hover_text("Tiles or clusters, each with its list of lights");
    ui.checkbox(&mut overlays.ranges, "Ranges of lights")
        .on_hover_text(format!("Range spheres of the {MOST_LIGHTS} nearest lights"));
    ui.checkbox(&mut overlays.rays, "Rays to the lights of the clicked pixel").on_hover_text(RAYS);
    ui.checkbox(&mut overlays.indirect_rays, "Rays of its indirect light").on_hover_text(INDIRECT_RAYS);
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::Culling;

    use super::*;
    use crate::testing;

    #[test]
    fn colours_match_the_debug_view() {
        let rgb = |lights| {
            let color = heat(lights).to_srgba_unmultiplied();
            [color[0], color[1], color[2]].map(|byte| byte > 128)
        };
        assert_eq!(
            [15, 63, 255, 1023, 100_000].map(rgb).map(|[r, g, b]| (r, g, b)),
            [
                (false, true, true),
                (false, true, false),
                (true, true, false),
                (true, false, false),
                (true, false, false)
            ]
        );
    }

    #[test]
    fn only_tiles_and_clusters_have_a_grid() {
        let with = |culling: Culling| spacing(&Settings::default().with_culling(culling));
        let clustered = Clustered { shape: ClusterShape::Perspective { pixels: 48 }, ..Clustered::default() };
        assert_eq!((with(Culling::NONE), with(clustered.into())), (None, Some(48)));
        testing::know_papers();
        for name in ["tiled", "raster-grid"] {
            assert_eq!(with(Culling::named(name).unwrap()), Some(16), "{name}");
        }
    }
}
