//! Two images of one scene in one place: what is on either side of a line, and the line.

use egui::{Rect, Ui, pos2};
use lanternfish::Settings;

/// What stands on the right of the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Other {
    /// There is no line.
    #[default]
    Nothing,
    /// The scene by other settings.
    Settings,
    /// The path tracer's image.
    PathTracer,
    /// The scene's deep images, as points.
    DeepImages,
}

/// The two sides. The left one, A, is the image by the settings of the panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Wipe {
    /// The right side, B.
    pub other: Other,
    /// Settings of B.
    pub settings: Settings,
    /// True if the panel of settings is B's.
    pub edits_b: bool,
    /// Where the line is: a share of the image's width.
    pub line: f32,
    /// True if the map of what differs is shown in the place of both.
    pub shows_map: bool,
}

impl Wipe {
    /// No line yet; B would be like A.
    pub fn new(settings: &Settings) -> Self {
        Self { other: Other::Nothing, settings: settings.clone(), edits_b: false, line: 0.5, shows_map: false }
    }
}

/// What of the two sides there is to show.
#[derive(Clone, Copy, Debug, Default)]
pub struct Textures {
    /// A.
    pub a: Option<egui::TextureId>,
    /// B.
    pub b: Option<egui::TextureId>,
    /// What differs.
    pub map: Option<egui::TextureId>,
}

/// Points to either side of the line at which a hand takes hold of it.
const GRIP: f32 = 6.0;

/// What of the two sides is painted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Painted {
    /// A alone.
    A,
    /// A on the left of a line, B on its right: where it is, as a share of the place's width.
    Both(f32),
    /// What differs.
    Map,
}

impl Wipe {
    /// What is painted, of what there is.
    pub fn painted(&self, textures: &Textures) -> Painted {
        match (self.other, textures) {
            (Other::Nothing, _) => Painted::A,
            (_, Textures { map: Some(_), .. }) if self.shows_map => Painted::Map,
            (_, Textures { b: None, .. }) => Painted::A,
            _ => Painted::Both(self.line),
        }
    }
}

/// RepaintLimiter both sides into a place; `whole` is where all of an image would be, which may be more or less than the place. The line is
/// moved by [`line`], which comes after what else takes hold of the place.
pub fn paint(ui: &Ui, place: Rect, whole: Rect, painted: Painted, textures: &Textures) {
    let image = |texture: Option<egui::TextureId>, from: f32, to: f32| {
        let Some(texture) = texture.filter(|_| to > from) else { return };
        let x = |fraction: f32| egui::lerp(place.x_range(), fraction);
        let part = Rect::from_x_y_ranges(x(from)..=x(to), place.y_range());
        let uv = Rect::from_min_max(egui::Pos2::ZERO, pos2(1.0, 1.0));
        ui.painter().with_clip_rect(part.intersect(ui.clip_rect())).image(texture, whole, uv, egui::Color32::WHITE);
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

/// The line over the image, and the hand that drags it. `fraction`: where it is, of the place's width.
pub fn line(ui: &mut Ui, place: Rect, fraction: &mut f32) {
    let x = egui::lerp(place.x_range(), *fraction);
    let grip = Rect::from_x_y_ranges(x - GRIP..=x + GRIP, place.y_range());
    let response = ui.interact(grip, ui.scope_id().with("wipe"), egui::Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Line between A and B"));
    if let Some(hand) = response.interact_pointer_pos().filter(|_| response.dragged() && place.width() > 0.0) {
        *fraction = ((hand.x - place.left()) / place.width()).clamp(0.0, 1.0);
    }
    let is_held = response.hovered() || response.dragged();
    let response = response.on_hover_and_drag_cursor(egui::CursorIcon::ResizeHorizontal);
    let color = if is_held { egui::Color32::WHITE } else { egui::Color32::from_white_alpha(160) };
    let x = egui::lerp(place.x_range(), *fraction);
    ui.painter().vline(x, place.y_range(), egui::Stroke::new(1.5, color));
    for (letter, side, align) in [("A", -8.0, egui::Align2::RIGHT_TOP), ("B", 8.0, egui::Align2::LEFT_TOP)] {
        let font = egui::FontId::proportional(16.0);
        ui.painter().text(pos2(x + side, response.rect.top() + 6.0), align, letter, font, color);
    }
}
