//! Panels around the image: settings, passes and their times, animation, keys.

mod keys;
mod lights;
mod memory;
mod parameters;
mod passes;
mod pixel;
mod rendering;
mod sides;
mod stereo;
mod sun;
#[cfg(test)]
mod tests;
mod written;

use egui::Ui;
use glam::Vec2;
use lanternfish::Settings;
use lanternfish_gpu::{AdapterDescription, PassTime};
use lanternfish_scene::{Eyes, Scene};

pub use self::{
    lights::{Edit, Listing},
    memory::Memory,
    pixel::Pointed,
    written::Written,
};
use crate::{
    Form,
    controls::Controls,
    overlay::{self, Overlays},
    stereo::Stereo,
    wipe::{Other, Textures, Wipe},
};

/// What the panels change.
#[derive(Debug)]
pub struct State {
    /// What is requested.
    pub settings: Settings,
    /// What is on the other side of the line, and where that is.
    pub wipe: Wipe,
    /// True if two eyes see it.
    pub stereo: Stereo,
    /// The pixel that was clicked.
    pub pointed: Option<Pointed>,
    /// Which lights are listed.
    pub listing: Listing,
    /// Those that a click on "as it was" goes back to.
    pub usual: Settings,
    /// The camera and how it moves.
    pub controls: Controls,
    /// What is drawn over the image.
    pub overlays: Overlays,
    /// The pass whose writing is shown.
    pub written: Option<Written>,
    /// What is played.
    pub clip: Option<Clip>,
    /// A line that tells of the last thing that went wrong, or was done.
    pub message: String,
    /// True if the page of keys is shown.
    pub shows_keys: bool,
    /// True if the panels are shown.
    pub shows_panels: bool,
    /// Whether everything behind headings was last unfolded at once, or folded.
    pub is_unfolded: bool,
    /// What becomes of all headings in this frame: unfolded, or folded.
    pub unfold: Option<bool>,
}

impl State {
    /// The eyes that the image is for; none: one.
    pub fn eyes(&self) -> Option<Eyes> {
        self.stereo.of(&self.controls.camera)
    }

    /// Shows it to two eyes, or to one again. There is no B beside two eyes.
    pub fn show_stereo(&mut self, is_shown: bool) {
        self.stereo.is_shown = is_shown;
        if is_shown && self.wipe.other != Other::Nothing {
            (self.wipe.other, self.wipe.shows_map, self.wipe.edits_b) = (Other::Nothing, false, false);
            self.message = stereo::ALONE.to_owned();
        }
    }
}

/// What is played, an animation of the scene or light rain or both, and which moment of it is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Names of all animations.
    pub names: Vec<String>,
    /// Which of them is played, by its index. None: light rain alone.
    pub animation: Option<usize>,
    /// Seconds until the animation begins again; of light rain alone, as many as can be chosen.
    pub duration: f32,
    /// Whether there is light rain. It falls on where an animation begins again.
    pub has_rain: bool,
    /// When, s.
    pub time: f32,
    /// True if time passes.
    pub is_playing: bool,
}

impl Clip {
    /// Lets `seconds` pass. An animation begins again after its end by itself; time does so where nothing else needs it.
    pub fn go_on(&mut self, seconds: f32) {
        self.time += seconds;
        if !self.has_rain {
            self.time = self.time.rem_euclid(self.duration.max(1e-3));
        }
    }

    /// What is left where the rain falls no more.
    pub fn without_rain(self) -> Option<Self> {
        self.animation.map(|_| Self { has_rain: false, ..self })
    }
}

/// What the panels tell of.
#[derive(Debug)]
pub struct Facts<'a> {
    /// The scene's name.
    pub name: &'a str,
    /// The scene.
    pub scene: &'a Scene,
    /// Its triangles.
    pub triangle_count: usize,
    /// What renders.
    pub adapter: &'a AdapterDescription,
    /// Pixels of the image, or of each eye's.
    pub size: [u32; 2],
    /// The eyes that it is for; none: one.
    pub eyes: Option<Eyes>,
    /// Frames that it is the mean of.
    pub averaged: u32,
    /// Device time of each pass of the last frame.
    pub passes: &'a [PassTime],
    /// Entries of its lists, by their names.
    pub counters: &'a [(String, u64)],
    /// What is on the device.
    pub memory: &'a Memory,
    /// Milliseconds from when a frame is begun to when the device is done with it.
    pub frame_ms: f64,
    /// Milliseconds that panels and painting take, once that is known.
    pub window_ms: Option<f64>,
    /// The images.
    pub textures: Textures,
    /// Frames that the other side's image is the mean of, or samples of each of its pixels.
    pub progress_of_b: u64,
    /// How different the two sides look, 0 to 1, once that is known.
    pub mean_difference: Option<f32>,
}

/// What is asked of the window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Requested {
    /// A file with the image.
    pub screenshot: bool,
    /// What is seen, in a form that renders it.
    pub write: Option<Form>,
    /// What lies under a pixel: shares of an image's sides, and which eye's it is.
    pub pixel: Option<(Vec2, usize)>,
    /// Another light.
    pub edit: Option<Edit>,
    /// To be closed.
    pub close: bool,
    /// Points that are left for the image, or each eye's, across and down.
    pub room: Vec2,
    /// True if the camera was moved by hand.
    pub is_moving: bool,
}

impl Requested {
    /// What was asked first, and now.
    pub fn and(self, now: Self) -> Self {
        Self {
            screenshot: self.screenshot | now.screenshot,
            close: self.close | now.close,
            write: now.write.or(self.write),
            pixel: now.pixel.or(self.pixel),
            edit: now.edit.or(self.edit),
            ..now
        }
    }
}

/// Draws everything, and takes what was clicked and pressed. `seconds`: since the last time.
pub fn show(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, seconds: f32) -> Requested {
    let mut requested = Requested::default();
    keys::take(ui, state, &mut requested);
    if state.shows_panels {
        egui::Panel::left("settings").default_size(290.0).show(ui, |ui| {
            ui.heading(if state.wipe.edits_b { "Settings of B" } else { "Settings" });
            scrolled("settings/all").show(ui, |ui| settings(ui, state));
        });
        egui::Panel::right("frame").default_size(290.0).show(ui, |ui| {
            passes::head(ui, facts, &mut requested);
            ui.separator();
            scrolled("frame/all").show(ui, |ui| right(ui, state, facts, &mut requested));
        });
        egui::Panel::bottom("below").show(ui, |ui| below(ui, state));
    }
    egui::CentralPanel::default()
        .frame(egui::Frame::NONE)
        .show(ui, |ui| rendering::show(ui, state, facts, seconds, &mut requested));
    state.unfold = None;
    if state.shows_keys {
        let window = egui::Window::new("Keys").collapsible(false).vscroll(true).open(&mut state.shows_keys);
        window.show(ui.ctx(), keys::page);
    }
    requested
}

/// What is wider than its panel is scrolled: a wider panel would leave another room for the image, whose mean would begin again.
fn scrolled(name: &str) -> egui::ScrollArea {
    egui::ScrollArea::both().id_salt(name).auto_shrink([false, true])
}

/// What is behind headings on the right.
fn right(ui: &mut Ui, state: &mut State, facts: &Facts<'_>, requested: &mut Requested) {
    let unfold = state.unfold;
    let heading = |name: &'static str| egui::CollapsingHeader::new(name).open(unfold);
    heading("Two eyes").show(ui, |ui| stereo::show(ui, state));
    heading("Two sides").show(ui, |ui| sides::show(ui, state, facts));
    heading("Pixel").show(ui, |ui| {
        if pixel::show(ui, state, facts) {
            focus(state, requested);
        }
    });
    heading("Lights").show(ui, |ui| {
        if let Some(edit) = lights::show(ui, state, facts) {
            requested.edit = Some(edit);
        }
    });
    heading("Overlays").show(ui, |ui| overlay::switches(ui, &mut state.overlays, &state.settings));
    heading("Passes").default_open(true).show(ui, |ui| passes::show(ui, state, facts));
    heading("Memory").show(ui, |ui| memory::show(ui, facts));
}

/// The settings of the side that the panel is of.
fn settings(ui: &mut Ui, state: &mut State) {
    let of_b = state.wipe.edits_b;
    let exchange = |state: &mut State| std::mem::swap(&mut state.settings, &mut state.wipe.settings);
    if of_b {
        exchange(state);
    }
    let shown = state.settings.debug_view;
    parameters::show(ui, state);
    if state.settings.debug_view != shown {
        // Another one was chosen by hand.
        state.written = None;
    }
    if of_b {
        exchange(state);
    }
}

/// Looks at the surface that was clicked.
fn focus(state: &mut State, requested: &mut Requested) {
    if let Some(place) = state.pointed.as_ref().and_then(Pointed::place) {
        state.controls.focus(place.p);
        requested.is_moving = true;
    }
}

/// What is played, and what went wrong.
fn below(ui: &mut Ui, state: &mut State) {
    ui.horizontal(|ui| {
        if let Some(clip) = &mut state.clip {
            if ui.button(if clip.is_playing { "Pause" } else { "Play" }).clicked() {
                clip.is_playing = !clip.is_playing;
            }
            let name = clip.animation.and_then(|animation| clip.names.get(animation));
            let name = name.map_or("light rain", String::as_str);
            egui::ComboBox::from_id_salt("animation").selected_text(name).show_ui(ui, |ui| {
                for (i, name) in clip.names.iter().enumerate() {
                    ui.selectable_value(&mut clip.animation, Some(i), name);
                }
            });
            let times = clip.time.min(0.0)..=clip.duration.max(clip.time);
            ui.add(egui::Slider::new(&mut clip.time, times).suffix(" s"));
        }
        ui.label(format!("{:.2} m/s", state.controls.speed))
            .on_hover_text("How fast the camera flies: the wheel changes it");
        ui.label(&state.message);
        if ui.small_button("Keys (F1)").clicked() {
            state.shows_keys = true;
        }
    });
}
