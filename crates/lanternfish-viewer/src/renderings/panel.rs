//! Panel and input of the image viewer.

use egui::{Key, Rect, Ui, Vec2};
use lanternfish::{
    output::metered_exposure,
    settings::{Exposure, ToneMap},
};

use super::{ImageOfFile, place::Place, shown::Look};
use crate::wipe::{self, Painted, Textures};

/// The state that the panel changes.
#[derive(Debug)]
pub struct State {
    /// All images; at least one.
    pub renderings: Vec<ImageOfFile>,
    /// Index of the left image.
    pub a: usize,
    /// Index of the right image; `None` shows only the left one.
    pub b: Option<usize>,
    /// Exposure and tone mapping of radiance.
    pub look: Look,
    /// Position of the line, as a fraction of the viewport's width.
    pub line: f32,
    /// True if the difference map replaces both images.
    pub shows_map: bool,
    /// Zoom and pan.
    pub place: Place,
    /// True if the panel is shown.
    pub shows_panel: bool,
    /// The last error message.
    pub message: String,
}

/// State of the comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Difference {
    /// Only one image is shown.
    OfOne,
    /// The sizes differ.
    Sizes,
    /// The comparison is in progress.
    Pending,
    /// Mean of the difference map, 0 to 1.
    Mean(f32),
}

/// Requests of the panel to the window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Requested {
    /// Close the window.
    pub close: bool,
}

impl State {
    /// Compares the first two images. `Exposure::Auto` meters the first radiance image.
    pub fn new(renderings: Vec<ImageOfFile>, exposure: Exposure, tone_map: ToneMap) -> Self {
        let ev = match exposure {
            Exposure::Ev(ev) => ev,
            Exposure::Auto => {
                let of = |rendering: &ImageOfFile| {
                    metered_exposure(rendering.image.pixels.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]))
                };
                renderings.iter().find(|rendering| rendering.is_radiance).map_or(0.0, of)
            }
        };
        Self {
            b: (renderings.len() > 1).then_some(1),
            renderings,
            a: 0,
            look: Look { ev, tone_map },
            line: 0.5,
            shows_map: false,
            place: Place::default(),
            shows_panel: true,
            message: String::new(),
        }
    }

    /// Adds images. The first of them becomes B.
    pub fn add(&mut self, renderings: Vec<ImageOfFile>) {
        if !renderings.is_empty() {
            self.b = Some(self.renderings.len());
        }
        self.renderings.extend(renderings);
    }

    fn size(&self) -> Vec2 {
        let size = self.renderings[self.a].size().as_vec2();
        Vec2::new(size.x, size.y)
    }

    fn painted(&self, textures: &Textures) -> Painted {
        match textures {
            Textures { map: Some(_), .. } if self.shows_map => Painted::Map,
            Textures { b: Some(_), .. } => Painted::Both(self.line),
            _ => Painted::A,
        }
    }
}

/// Draws the panel and the images, and handles input.
pub fn show(ui: &mut Ui, state: &mut State, textures: &Textures, difference: Difference) -> Requested {
    let mut requested = Requested::default();
    keys(ui, state, &mut requested);
    if state.shows_panel {
        egui::Panel::left("renderings").default_size(300.0).show(ui, |ui| {
            ui.heading("Images");
            egui::ScrollArea::vertical().show(ui, |ui| comparison(ui, state, difference));
        });
    }
    egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| rendering(ui, state, textures));
    requested
}

fn keys(ui: &Ui, state: &mut State, requested: &mut Requested) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let size = state.size();
    let scale = ui.ctx().pixels_per_point();
    ui.input_mut(|input| {
        let mut pressed = |key| input.consume_key(egui::Modifiers::NONE, key);
        requested.close = pressed(Key::Escape);
        state.shows_panel ^= pressed(Key::F3);
        state.shows_map ^= pressed(Key::M);
        if pressed(Key::F) {
            state.place.fit();
        }
        if pressed(Key::Num1) {
            state.place.enlarge_to(size, 1.0 / scale);
        }
        if let Some(b) = state.b.filter(|_| pressed(Key::Space)) {
            (state.a, state.b) = (b, Some(state.a));
        }
    });
}

fn comparison(ui: &mut Ui, state: &mut State, difference: Difference) {
    which(ui, state);
    ui.separator();
    if state.renderings.iter().any(|rendering| rendering.is_radiance) {
        ui.horizontal(|ui| {
            let label = ui.label("exposure").on_hover_text("Exposure in stops, for radiance images (EXR): +1 doubles");
            ui.add(egui::DragValue::new(&mut state.look.ev).speed(0.02).suffix(" EV")).labelled_by(label.id);
        });
        ui.horizontal(|ui| {
            let label = ui.label("tone-map").on_hover_text("Tone-mapping curve from radiance to display values");
            let list = egui::ComboBox::from_id_salt("tone-map").selected_text(state.look.tone_map.to_string());
            let shown = list.show_ui(ui, |ui| {
                for curve in ToneMap::ALL {
                    ui.selectable_value(&mut state.look.tone_map, *curve, curve.to_string());
                }
            });
            shown.response.labelled_by(label.id);
        });
        ui.separator();
    }
    match difference {
        Difference::OfOne => {
            ui.label("Drop another image on the window to compare the two.");
        }
        difference => {
            ui.add(egui::Slider::new(&mut state.line, 0.0..=1.0).show_value(false).text("line"));
            ui.checkbox(&mut state.shows_map, "Difference map (M)")
                .on_hover_text("FLIP: black is no visible difference, pale yellow the largest one");
            ui.label(match difference {
                Difference::Sizes => "The sizes differ: B is stretched, and no difference is computed.".to_owned(),
                Difference::Mean(mean) => format!("Mean difference (FLIP): {mean:.4}"),
                _ => "Mean difference (FLIP): …".to_owned(),
            });
        }
    }
    ui.separator();
    ui.horizontal(|ui| {
        if ui.button("Fit (F)").clicked() {
            state.place.fit();
        }
        if ui.button("1:1 (1)").clicked() {
            let size = state.size();
            state.place.enlarge_to(size, 1.0 / ui.ctx().pixels_per_point());
        }
    });
    ui.weak("Wheel: zoom. Drag: move. Space: swap A and B. F3: hide this panel. Escape: close.");
    ui.label(&state.message);
}

/// One row per image: its name, and its side.
fn which(ui: &mut Ui, state: &mut State) {
    let State { renderings, a, b, .. } = state;
    egui::Grid::new("which").striped(true).show(ui, |ui| {
        for (i, rendering) in renderings.iter().enumerate() {
            ui.selectable_value(a, i, "A");
            if ui.selectable_label(*b == Some(i), "B").on_hover_text("Click again to show A only").clicked() {
                *b = (*b != Some(i)).then_some(i);
            }
            let size = rendering.size();
            ui.label(&rendering.name).on_hover_text(format!("{} × {} pixels", size.x, size.y));
            ui.end_row();
        }
    });
}

/// Draws the images, and zooms and pans them by input.
fn rendering(ui: &mut Ui, state: &mut State, textures: &Textures) {
    let viewport = ui.available_rect_before_wrap();
    let response = ui.interact(viewport, ui.scope_id().with("renderings"), egui::Sense::click_and_drag());
    let size = state.size();
    let painted = state.painted(textures);
    wipe::paint(ui, viewport, state.place.image_rect(viewport, size), painted, textures);
    if let Painted::Both(_) = painted {
        wipe::line(ui, viewport, &mut state.line);
    }
    if response.dragged() {
        state.place.pan(viewport, size, response.drag_delta());
    }
    let Some(at) = response.hover_pos() else { return };
    let notches = ui.input(|input| input.smooth_scroll_delta.y) / 50.0;
    if notches != 0.0 {
        state.place.enlarge(viewport, size, at, 1.25f32.powf(notches));
    }
    pixel_values(ui, state, viewport, at);
}

/// Draws the values of the pixel under the pointer in the corner.
fn pixel_values(ui: &Ui, state: &State, viewport: Rect, at: egui::Pos2) {
    let pixel = state.place.pixel(viewport, state.size(), at);
    let [x, y] = [pixel.x, pixel.y].map(|coordinate| coordinate.floor() as i64);
    let value = |name: &str, index: usize| {
        let [r, g, b] = state.renderings[index].value([x, y])?;
        Some(format!("{name} {r:.4}  {g:.4}  {b:.4}"))
    };
    let Some(of_a) = value("A", state.a) else { return };
    let lines: Vec<_> =
        [Some(format!("{x}, {y}")), Some(of_a), state.b.and_then(|b| value("B", b))].into_iter().flatten().collect();
    let font = egui::FontId::monospace(12.0);
    let galley = ui.painter().layout_no_wrap(lines.join("\n"), font, egui::Color32::WHITE);
    let corner = viewport.left_bottom() + Vec2::new(6.0, -6.0 - galley.size().y);
    let back = Rect::from_min_size(corner, galley.size()).expand(4.0);
    ui.painter().rect_filled(back, 3.0, egui::Color32::from_black_alpha(170));
    ui.painter().galley(corner, galley, egui::Color32::WHITE);
}
