//! Overlay: lines in the scene's space, projected on the host.
//!
//! Nothing hides these lines: they are over the scene.

mod birds_eye;
mod project;

use egui::{Color32, Painter, Rect, Shape, Stroke, Ui};
use glam::Vec3;
use lanternfish::{
    settings::Settings,
    techniques::{ClusterShape, Clustered, TileSize, Tiled},
};
use lanternfish_papers::RasterGrid;
use lanternfish_scene::{Camera, Light, LightKind, Scene};

pub use self::birds_eye::BirdsEye;
use self::project::{Projector, edges, frustum};
use crate::background::Found;

/// Clusters that are drawn at most: those with the most lights.
const MOST_CLUSTERS: usize = 6000;
/// Lights whose ranges are drawn at most: the nearest ones.
const MOST_LIGHTS: usize = 64;
/// Straight pieces of a circle.
const PIECES: usize = 48;

const OF_CAMERA: Color32 = Color32::from_rgb(60, 230, 80);
const OF_CLUSTERING: Color32 = Color32::from_rgb(240, 60, 50);
const OF_GRID: Color32 = Color32::from_rgba_premultiplied(70, 70, 70, 70);
/// What the colours of rays mean.
pub const RAYS: &str = "Green: open; yellow: open in part; red: in shadow";
const OPEN: Color32 = Color32::from_rgb(90, 240, 90);
const IN_PART: Color32 = Color32::from_rgb(250, 210, 60);
const BLOCKED: Color32 = Color32::from_rgb(240, 70, 60);
/// What the colours of rays of indirect light mean.
pub const INDIRECT_RAYS: &str = "64 directions by the cosine, through the scene itself. Blue: to the surface that sends light back; grey: out of the scene";
const HIT: Color32 = Color32::from_rgb(110, 190, 255);
const LEAVES: Color32 = Color32::from_rgba_premultiplied(120, 120, 120, 160);

/// What is drawn over the image.
#[derive(Debug)]
pub struct Overlays {
    /// True if the bird's-eye view is requested.
    pub wants_birds_eye: bool,
    /// The view from above, while it is shown.
    pub birds_eye: Option<BirdsEye>,
    /// True if the view from above shows visible clusters.
    pub clusters: bool,
    /// Whether tiles, or columns of clusters, are drawn over the image.
    pub grid: bool,
    /// True if ranges of lights are drawn.
    pub ranges: bool,
    /// True if lines to the lights of the clicked pixel are drawn.
    pub rays: bool,
    /// True if rays that look for indirect light from the clicked pixel are drawn.
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

/// What overlays are of.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// How it is rendered.
    pub settings: &'a Settings,
    /// Where it is seen from.
    pub camera: &'a Camera,
    /// What lies under the pixel that was clicked.
    pub found: Option<&'a Found>,
    /// Pixels of the image.
    pub size: [u32; 2],
}

/// Draws what is requested over the image, which is at `place`.
pub fn paint(ui: &Ui, place: Rect, overlays: &Overlays, drawn: &Drawn<'_>) {
    let painter = ui.painter().with_clip_rect(place.intersect(ui.clip_rect()));
    let wire = Wire { painter: &painter, projector: Projector::new(drawn.camera, place) };
    if overlays.grid && overlays.birds_eye.is_none() {
        grid(&painter, place, drawn);
    }
    if overlays.ranges {
        ranges(&wire, overlays.birds_eye.as_ref().map_or(drawn.camera, |view| &view.first.camera), drawn);
    }
    if let Some(view) = &overlays.birds_eye {
        from_above(&wire, view, overlays.clusters, drawn.scene);
    }
    if let Some(found) = drawn.found.filter(|_| overlays.indirect_rays) {
        indirect_rays(&wire, found, drawn.scene);
    }
    if let Some(found) = drawn.found.filter(|_| overlays.rays) {
        rays(&wire, found, drawn.scene);
    }
}

/// Lines of the scene's space.
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
                let (sin, cos) = (std::f32::consts::TAU * i as f32 / PIECES as f32).sin_cos();
                middle + radius * (cos * u + sin * v)
            };
            (0..PIECES).for_each(|i| self.line(at(i), at(i + 1), stroke));
        }
    }
}

/// Points of the window between lines that divide the image; none where it is not divided so.
fn spacing(settings: &Settings) -> Option<u32> {
    let culling = &settings.culling;
    let tiles = culling.get::<Tiled>().map(|tiled| tiled.tile_size);
    let tiles = tiles.or_else(|| culling.get::<RasterGrid>().map(|grid| grid.tile_size));
    let clusters = culling.get::<Clustered>().and_then(|clustered| match clustered.shape {
        ClusterShape::Perspective { pixels } => Some(pixels),
        _ => None,
    });
    tiles.map(TileSize::pixels).or(clusters)
}

/// True if something divides the image that could be drawn over it.
pub fn has_grid(settings: &Settings) -> bool {
    spacing(settings).is_some()
}

/// Tiles, or columns of clusters: from the left and the top edge.
fn grid(painter: &Painter, place: Rect, drawn: &Drawn<'_>) {
    let Some(pixels) = spacing(drawn.settings) else { return };
    let [width, height] = drawn.size;
    let stroke = Stroke::new(1.0, OF_GRID);
    for x in (pixels..width).step_by(pixels as usize) {
        painter.vline(egui::lerp(place.x_range(), x as f32 / width as f32), place.y_range(), stroke);
    }
    for y in (pixels..height).step_by(pixels as usize) {
        painter.hline(place.x_range(), egui::lerp(place.y_range(), y as f32 / height as f32), stroke);
    }
}

/// Spheres of the lights nearest to a camera, as far as they reach, each in its colour.
fn ranges(wire: &Wire<'_>, camera: &Camera, drawn: &Drawn<'_>) {
    let settings = drawn.settings;
    let reach = |light: &Light| light.effective_range(settings.attenuation, settings.range_threshold);
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

/// The first camera's frustum, that of its clusters, and visible clusters in their whole extent, coloured by their lights.
fn from_above(wire: &Wire<'_>, view: &BirdsEye, shows_clusters: bool, scene: &Scene) {
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

/// The colours of debug view `cluster-lights`: a factor of four each from none to 1,023.
fn heat(lights: u32) -> Color32 {
    const STOPS: [[f32; 3]; 6] = [
        [90.0, 90.0, 90.0],
        [60.0, 60.0, 255.0],
        [0.0, 255.0, 255.0],
        [0.0, 255.0, 0.0],
        [255.0, 255.0, 0.0],
        [255.0, 0.0, 0.0],
    ];
    let place = ((1.0 + lights as f32).log2() / 2.0).min(5.0);
    let first = (place as usize).min(4);
    let fraction = place - first as f32;
    let channel = |i: usize| (STOPS[first][i] + fraction * (STOPS[first + 1][i] - STOPS[first][i])) as u8;
    Color32::from_rgba_unmultiplied(channel(0), channel(1), channel(2), 130)
}

/// From the surface that was clicked to each of its lights.
fn rays(wire: &Wire<'_>, found: &Found, scene: &Scene) {
    let Some(place) = &found.place else { return };
    let size = scene.bounds().size().length();
    for at in &found.lights {
        let Some(light) = scene.lights.get(at.light) else { continue };
        let end = match light.kind {
            LightKind::Directional => place.p - size * light.direction,
            _ => light.position,
        };
        let color = match at.open() {
            open if open >= 0.995 => OPEN,
            open if open > 0.0 => IN_PART,
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

/// From the surface that was clicked to what sends light back to it.
fn indirect_rays(wire: &Wire<'_>, found: &Found, scene: &Scene) {
    let Some(place) = &found.place else { return };
    let size = scene.bounds().size().length();
    for ray in &found.rays {
        let end = place.p + ray.distance.unwrap_or(size) * ray.direction;
        let color = if ray.distance.is_some() { HIT } else { LEAVES };
        wire.line(place.p, end, Stroke::new(1.0, color));
        if let (Some(end), true) = (wire.projector.point(end), ray.distance.is_some()) {
            wire.painter.circle_filled(end, 2.5, color);
        }
    }
}

/// The switches.
pub fn switches(ui: &mut Ui, overlays: &mut Overlays, settings: &Settings) {
    let is_shown = overlays.birds_eye.is_some();
    let words = if is_shown { "Back to the camera (V)" } else { "Bird\u{2019}s-eye view (V)" };
    let button = ui.button(words).on_hover_text(
        "A second camera looks at the first one: its frustum in green, that of its clusters in red, and the clusters in which it sees surfaces",
    );
    overlays.wants_birds_eye ^= button.clicked();
    if let Some(view) = &overlays.birds_eye {
        ui.checkbox(&mut overlays.clusters, "Visible clusters").on_hover_text(
            "In their whole extent, not cut to the surfaces in them. Grey lists no light, blue 3, cyan 15, green 63, yellow 255, red 1,023",
        );
        ui.label(match (view.clusters.len(), view.all) {
            (_, 0) => "Only `culling clustered` has clusters.".to_owned(),
            (drawn, all) if drawn < all => format!("{drawn} of {all} clusters, those with the most lights"),
            (_, all) => format!("{all} visible clusters"),
        });
    }
    ui.add_enabled(has_grid(settings), egui::Checkbox::new(&mut overlays.grid, "Tiles or clusters on the image"))
        .on_hover_text("Where the image is divided into lists of lights");
    ui.checkbox(&mut overlays.ranges, "Ranges of lights")
        .on_hover_text(format!("Spheres of the {MOST_LIGHTS} nearest lights, as far as they reach"));
    ui.checkbox(&mut overlays.rays, "Rays to the lights of the clicked pixel").on_hover_text(RAYS);
    ui.checkbox(&mut overlays.indirect_rays, "Rays of its indirect light").on_hover_text(INDIRECT_RAYS);
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::Culling;

    use super::*;

    #[test]
    fn colours_are_those_of_the_debug_view() {
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
    fn only_what_divides_the_image_has_a_grid() {
        let with = |culling| has_grid(&Settings { culling, ..Settings::default() });
        assert!(with(Culling::default()) && !with(Culling::NONE));
    }
}
