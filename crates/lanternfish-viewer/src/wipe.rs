//! Comparison of two images with a wipe: A on the left of a line, B on its right.

use egui::{Rect, Ui, pos2};
use lanternfish::Settings;

/// Side B of the comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Other {
    /// No comparison.
    #[default]
    Nothing,
    /// The scene under other settings.
    Settings,
    /// The path tracer's image.
    PathTracer,
}

/// The state of the comparison. A, on the left, is the image of the main settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Wipe {
    /// The right side, B.
    pub other: Other,
    /// Settings of B.
    pub settings: Settings,
    /// True if the panel of settings is B's.
    pub edits_b: bool,
    /// Position of the line, as a fraction of the image's width.
    pub line: f32,
    /// True if the difference map replaces both images.
    pub shows_map: bool,
}

impl Wipe {
    /// Creates a comparison without a B. B's settings start equal to A's.
    pub fn new(settings: &Settings) -> Self {
        Self { other: Other::Nothing, settings: settings.clone(), edits_b: false, line: 0.5, shows_map: false }
    }
}

/// The available textures of both sides.
#[derive(Clone, Copy, Debug, Default)]
pub struct Textures {
    /// A.
    pub a: Option<egui::TextureId>,
    /// B.
    pub b: Option<egui::TextureId>,
    /// Difference map.
    pub map: Option<egui::TextureId>,
}

/// Distance from the line at which it can be dragged, points.
const GRIP: f32 = 6.0;

/// The content that is painted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Painted {
    /// Only A.
    A,
    /// A and B, with the position of the line as a fraction of the viewport's width.
    Both(f32),
    /// Difference map.
    Map,
}

impl Wipe {
    /// Selects the content from the available textures.
    pub fn painted(&self, textures: &Textures) -> Painted {
        match (self.other, textures) {
            (Other::Nothing, _) => Painted::A,
            (_, Textures { map: Some(_), .. }) if self.shows_map => Painted::Map,
            (_, Textures { b: None, .. }) => Painted::A,
            _ => Painted::Both(self.line),
        }
    }
}

/// Paints both sides into `viewport`. `image_rect` is the rectangle of the complete image, which may be larger or
/// smaller. [`line`] draws and moves the line; call it after other interactions with the viewport.
pub fn paint(ui: &Ui, viewport: Rect, image_rect: Rect, painted: Painted, textures: &Textures) {
    let image = |texture: Option<egui::TextureId>, from: f32, to: f32| {
        let Some(texture) = texture.filter(|_| to > from) else { return };
        let x = |fraction: f32| egui::lerp(viewport.x_range(), fraction);
        let part = Rect::from_x_y_ranges(x(from)..=x(to), viewport.y_range());
        let uv = Rect::from_min_max(egui::Pos2::ZERO, pos2(1.0, 1.0));
        ui.painter().with_clip_rect(part.intersect(ui.clip_rect())).image(
            texture,
            image_rect,
            uv,
            egui::Color32::WHITE,
        );
    };
    match painted {
        Painted::A => image(textures.a, 0.0, 1.0),
        Painted::Map => image(textures.map, 0.0, 1.0),
        Painted::Both(line) => {
            image(textures.a, 0.0, line);
            image(textures.b, line, 1.0);
        }
    }
}

/// Draws the line, and moves it by dragging. `fraction`: its position, as a fraction of the viewport's width.
pub fn line(ui: &mut Ui, viewport: Rect, fraction: &mut f32) {
    let x = egui::lerp(viewport.x_range(), *fraction);
    let grip = Rect::from_x_y_ranges(x - GRIP..=x + GRIP, viewport.y_range());
    let response = ui.interact(grip, ui.scope_id().with("wipe"), egui::Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Line between A and B"));
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged() && viewport.width() > 0.0) {
        *fraction = ((pointer.x - viewport.left()) / viewport.width()).clamp(0.0, 1.0);
    }
    let is_held = response.hovered() || response.dragged();
    let response = response.on_hover_and_drag_cursor(egui::CursorIcon::ResizeHorizontal);
    let color = if is_held { egui::Color32::WHITE } else { egui::Color32::from_white_alpha(160) };
    let x = egui::lerp(viewport.x_range(), *fraction);
    ui.painter().vline(x, viewport.y_range(), egui::Stroke::new(1.5, color));
    for (letter, side, align) in [("A", -8.0, egui::Align2::RIGHT_TOP), ("B", 8.0, egui::Align2::LEFT_TOP)] {
        let font = egui::FontId::proportional(16.0);
        let at = pos2(x + side, response.rect.top() + 6.0);
        let letters = ui.painter().layout_no_wrap(letter.to_owned(), font, color);
        let place = align.anchor_size(at, letters.size());
        // Seen on white, too.
        ui.painter().rect_filled(place.expand2(egui::vec2(4.0, 1.0)), 3.0, egui::Color32::from_black_alpha(160));
        ui.painter().galley(place.min, letters, color);
    }
}
