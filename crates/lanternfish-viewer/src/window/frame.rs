//! A frame of the window: panels, requests, drawing and painting.

use std::time::{Duration, Instant};

use glam::UVec2;
use lanternfish_scene::Recorder;

use super::{REST, Viewer};
use crate::{
    panels::{self, Facts, Requested},
    wipe::Textures,
};

impl Viewer {
    /// Runs one frame of the window, and starts a frame of the image if none is in flight.
    pub(super) fn show(&mut self) -> Requested {
        if let Some(recorder) = &self.recorder {
            // A recorded step takes at least its own length in real time.
            std::thread::sleep(Duration::from_secs_f32(recorder.step()).saturating_sub(self.last.elapsed()));
        }
        let passed = self.last.elapsed().as_secs_f32().min(0.25);
        let seconds = self.recorder.as_ref().map_or(passed, Recorder::step);
        self.last = Instant::now();
        let was_idle = !self.is_busy();
        self.poll();
        let right = match self.state.eyes() {
            Some(_) => self.viewport.right_image(),
            None => self.comparison.rendering(),
        };
        let shown = [Some(self.viewport.rendering()), right, self.comparison.map()];
        for (registered, texture) in self.renderings.iter_mut().zip(shown) {
            self.surface.register(&self.viewport.interface().device, registered, texture);
        }
        let (requested, output) = self.panels(seconds);
        if let Some(recorder) = &mut self.recorder {
            recorder.note(&mut self.state.controls);
        }
        self.viewport_size =
            UVec2::new(requested.viewport_size.x as u32, requested.viewport_size.y as u32).max(UVec2::ONE);
        if requested.is_moving {
            self.moved = Some(Instant::now());
        }
        self.moved = self.moved.filter(|since| since.elapsed() < REST);
        self.wants_screenshot |= requested.screenshot;
        if !self.viewport.is_busy() {
            self.keep_image();
        }
        if let Some((at, eye)) = requested.pixel {
            self.point(at, eye);
        }
        if let Some(edit) = requested.edit.clone() {
            self.edit(edit);
        }
        if let Some(form) = requested.write {
            self.write(form);
        }
        // While something moves, the frame is drawn before the paint, for low latency. At rest the window is painted
        // first, since a driver may delay the paint until the submitted frame is complete. Recording of the first frame
        // compiles shaders.
        let paints_first = was_idle && !self.moves() || self.viewport.drawn() == 0;
        if !paints_first && !self.is_busy() {
            self.toggle_birds_eye();
            self.draw_both(seconds);
        }
        self.surface.paint(self.viewport.interface(), output);
        self.repaint_limiter.painted();
        if !self.viewport.paints_apart() {
            self.slice_scheduler.painted();
        }
        self.painted = (Instant::now(), self.viewport.mean());
        if paints_first {
            if self.viewport.drawn() > 0 {
                self.repaint_limiter.took(1e3 * self.last.elapsed().as_secs_f64());
            }
            if !self.is_busy() {
                self.toggle_birds_eye();
                self.draw_both(seconds);
            }
        }
        requested
    }

    /// Runs the panels. `viewport_size` of the result is in pixels.
    fn panels(&mut self, seconds: f32) -> (Requested, egui::FullOutput) {
        let Self { surface, state, viewport, comparison, name, renderings, frame_ms, memory, repaint_limiter, .. } =
            self;
        let [a, b, map] = renderings.each_ref().map(|registered| registered.as_ref().map(|(id, _)| *id));
        let facts = Facts {
            name,
            scene: &viewport.scene,
            triangle_count: viewport.scene.triangle_counts().1,
            adapter: &viewport.gpu.description,
            size: viewport.size().into(),
            eyes: viewport.eyes(),
            averaged: viewport.averaged(),
            passes: viewport.report.as_ref().map_or(&[], |report| &report.passes),
            counters: viewport.report.as_ref().map_or(&[], |report| &report.counters),
            memory,
            frame_ms: *frame_ms,
            window_ms: repaint_limiter.ms(),
            textures: Textures { a, b, map },
            progress_of_b: comparison.progress(),
            mean_difference: comparison.mean(),
        };
        let mut requested = Requested::default();
        let output = surface.panels(|ui| {
            requested = std::mem::take(&mut requested).and(panels::show(ui, state, &facts, seconds));
        });
        requested.viewport_size *= output.pixels_per_point;
        (requested, output)
    }
}
