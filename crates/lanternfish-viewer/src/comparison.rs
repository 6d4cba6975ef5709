//! Side B of the comparison: the scene under other settings, or the path tracer's image; and the difference of A and B.

use std::sync::Arc;

use glam::UVec2;
use lanternfish::{
    RenderError,
    settings::{Exposure, Settings},
};
use lanternfish_gpu::ShaderTexts;
use lanternfish_scene::{Camera, Scene};

use crate::{
    background::{Background, Look, ProbeResult, Report, Subject, Traced},
    difference::Difference,
    texture::{texture, write},
    viewport::Viewport,
    wipe::{Other, Wipe},
};

/// Side B, and its threads.
#[derive(Debug, Default)]
pub struct Comparison {
    rendered: Option<Viewport>,
    /// True if the scene has changed since the second viewport was created or updated.
    is_behind: bool,
    background: Option<Background>,
    /// Scene, settings, camera and size of the path tracer's image.
    tracing: Option<(Arc<Scene>, Settings, Camera, UVec2)>,
    look: Option<(Look, u64)>,
    traced: Option<(wgpu::TextureView, Traced)>,
    difference: Difference,
    /// The two images of the last comparison; see [`Self::pair`].
    compared: Option<(u64, u64)>,
    map: Option<wgpu::TextureView>,
    mean: Option<f32>,
}

/// Changes of side B since the last poll.
#[derive(Debug, Default)]
pub struct News {
    /// True if anything has changed.
    pub is_new: bool,
    /// Duration of the second viewport's last frame, ms, if it has just ended. It includes the wait for the first
    /// viewport's frame.
    pub ms: Option<f64>,
    /// The result of the last requested probe.
    pub probe_result: Option<ProbeResult>,
    /// The last error message.
    pub failed: Option<String>,
}

impl Comparison {
    /// Releases the first viewport's scene before it changes, so that the change does not copy it.
    pub fn release_scene(&mut self) {
        self.is_behind = true;
        if let Some(viewport) = &mut self.rendered {
            viewport.scene = Arc::default();
        }
        self.forget_traced();
        if let Some(background) = &mut self.background {
            background.forget();
        }
        self.forget_difference();
    }

    /// Replaces the shaders, as for the first viewport.
    pub fn edit_shaders(&mut self, texts: ShaderTexts, camera: &Camera) -> Result<(), RenderError> {
        self.forget_difference();
        self.rendered.as_mut().map_or(Ok(()), |viewport| viewport.edit_shaders(texts, camera))
    }

    /// Draws side B in the size of A if it is requested, or starts the path tracer. Call it while neither side has a
    /// frame in flight. `rests`: nothing moves, and A has its full resolution.
    pub fn draw(&mut self, first: &Viewport, wipe: &Wipe, camera: &Camera, rests: bool) -> Result<(), RenderError> {
        if wipe.other != Other::Settings {
            self.rendered = None;
        }
        if wipe.other != Other::PathTracer {
            self.forget_traced();
        }
        if !rests || wipe.other == Other::Nothing {
            self.forget_difference();
        }
        match wipe.other {
            Other::Settings => self.render(first, wipe, camera, rests)?,
            Other::PathTracer => self.trace(first, camera, rests)?,
            Other::Nothing => {}
        }
        if rests && wipe.other == Other::PathTracer {
            self.compare(first)?;
        }
        Ok(())
    }

    fn render(&mut self, first: &Viewport, wipe: &Wipe, camera: &Camera, rests: bool) -> Result<(), RenderError> {
        let viewport = match &mut self.rendered {
            Some(viewport) => viewport,
            None => {
                self.is_behind = false;
                self.rendered.insert(first.comparison(&wipe.settings)?)
            }
        };
        if self.is_behind {
            viewport.follow(first)?;
            self.is_behind = false;
        }
        viewport.set(&wipe.settings)?;
        viewport.resize(first.size());
        // The images of ended frames are compared, before the next frame begins.
        if rests && viewport.shows(camera) {
            self.compare(first)?;
        }
        match &mut self.rendered {
            Some(viewport) if viewport.has_more(camera) => viewport.draw(camera),
            _ => Ok(()),
        }
    }

    fn trace(&mut self, first: &Viewport, camera: &Camera, rests: bool) -> Result<(), RenderError> {
        let is_of = |of: &(Arc<Scene>, Settings, Camera, UVec2)| {
            Arc::ptr_eq(&of.0, &first.scene)
                && lit_alike(&of.1, first.settings())
                && of.2 == *camera
                && of.3 == first.size()
        };
        if self.tracing.as_ref().is_some_and(|of| !rests || !is_of(of)) {
            self.forget_traced();
        }
        if !rests {
            return Ok(());
        }
        let background = self.background.get_or_insert_with(Background::start);
        // Auto-exposure may change A's exposure with each frame.
        let frames = first.drawn();
        if self
            .look
            .is_none_or(|(look, of_frames)| of_frames != frames || look.tone_map != first.settings().image.tone_map)
        {
            let ev = match first.settings().image.exposure {
                Exposure::Ev(ev) => ev,
                Exposure::Auto => first.exposure()?.unwrap_or(0.0),
            };
            let look = Look { ev, tone_map: first.settings().image.tone_map };
            if self.look.is_none_or(|(before, _)| before != look) {
                background.show_as(look);
            }
            self.look = Some((look, frames));
        }
        if self.tracing.is_none() {
            background.trace(Subject::new(&first.scene, first.settings()), camera, first.size());
            self.tracing = Some((Arc::clone(&first.scene), first.settings().clone(), camera.clone(), first.size()));
        }
        Ok(())
    }

    fn forget_traced(&mut self) {
        if self.tracing.take().is_some() {
            self.background.iter_mut().for_each(Background::stop);
        }
        (self.traced, self.look) = (None, None);
    }

    /// Starts a comparison of the current images, unless it is done or in progress.
    fn compare(&mut self, first: &Viewport) -> Result<(), RenderError> {
        if !self.can_be_compared(first) {
            return Ok(());
        }
        let other = match (&self.rendered, &self.traced) {
            (Some(viewport), _) if viewport.size() == first.size() => viewport.pixels()?,
            (None, Some((_, traced))) if traced.size == first.size() => traced.bytes.as_chunks().0.to_vec(),
            _ => return Ok(()),
        };
        self.difference.compare(first.pixels()?, other, first.size());
        self.compared = Some(self.pair(first));
        Ok(())
    }

    /// Identifies the current images of A and B: frames drawn, or samples per pixel.
    fn pair(&self, first: &Viewport) -> (u64, u64) {
        let other = match &self.rendered {
            Some(viewport) => viewport.drawn(),
            None => self.traced.as_ref().map_or(0, |(_, traced)| traced.samples),
        };
        (first.drawn(), other)
    }

    /// True if there are two images that have not been compared, and no comparison is in progress.
    fn can_be_compared(&self, first: &Viewport) -> bool {
        let are_there = first.averaged() > 0 && self.progress() > 0;
        are_there && self.compared != Some(self.pair(first)) && !self.difference.is_working()
    }

    fn forget_difference(&mut self) {
        self.difference.stop();
        (self.compared, self.map, self.mean) = (None, None, None);
    }

    /// Requests a probe at a position of A's image, 0 to 1 from the top left.
    pub fn probe(&mut self, first: &Viewport, camera: &Camera, at: [f32; 2]) {
        let background = self.background.get_or_insert_with(Background::start);
        let size = first.size();
        let at = [f64::from(at[0]) * f64::from(size.x), f64::from(at[1]) * f64::from(size.y)];
        background.probe(Subject::new(&first.scene, first.settings()), camera, at, size);
    }

    /// The changes since the last call. Does not block.
    pub fn poll(&mut self, first: &Viewport) -> News {
        let mut news = News::default();
        if let Some(ms) = self.rendered.as_mut().and_then(Viewport::poll) {
            (news.ms, news.is_new) = (Some(ms), true);
        }
        while let Some(report) = self.background.as_mut().and_then(Background::poll) {
            news.is_new = true;
            match report {
                Report::RenderedImage(traced) => self.show(first, traced),
                Report::Pixel(result) => news.probe_result = Some(result),
                Report::Failed(what) => news.failed = Some(what),
            }
        }
        if let Some(compared) = self.difference.poll() {
            news.is_new = true;
            match compared {
                Ok(compared) => {
                    let interface = first.interface();
                    let map = texture(&interface.device, compared.size);
                    write(&interface.queue, &map, &compared.map);
                    (self.map, self.mean) = (Some(map), Some(compared.mean));
                }
                Err(what) => news.failed = Some(what),
            }
        }
        news
    }

    fn show(&mut self, first: &Viewport, traced: Traced) {
        let interface = first.interface();
        let reused = self.traced.take().filter(|(_, before)| before.size == traced.size);
        let texture = reused.map_or_else(|| texture(&interface.device, traced.size), |(texture, _)| texture);
        write(&interface.queue, &texture, &traced.bytes);
        self.traced = Some((texture, traced));
    }

    /// B's image, if there is one.
    pub fn rendering(&self) -> Option<&wgpu::TextureView> {
        let traced = || self.traced.as_ref().map(|(texture, _)| texture);
        self.rendered.as_ref().map(Viewport::rendering).or_else(traced)
    }

    /// The settings that were asked for B, if B is rendered.
    pub fn settings(&self) -> Option<&Settings> {
        self.rendered.as_ref().map(Viewport::requested)
    }

    /// Error map of the two sides, once it is computed.
    pub fn map(&self) -> Option<&wgpu::TextureView> {
        self.map.as_ref()
    }

    /// Mean of the error map, 0 to 1.
    pub fn mean(&self) -> Option<f32> {
        self.mean
    }

    /// Number of frames that B averages, or its samples per pixel.
    pub fn progress(&self) -> u64 {
        match &self.rendered {
            Some(viewport) => u64::from(viewport.averaged()),
            None => self.traced.as_ref().map_or(0, |(_, traced)| traced.samples),
        }
    }

    /// The viewport of B, if B is rendered.
    pub fn viewport(&self) -> Option<&Viewport> {
        self.rendered.as_ref()
    }

    /// The viewport of B, if B is rendered.
    pub fn viewport_mut(&mut self) -> Option<&mut Viewport> {
        self.rendered.as_mut()
    }

    /// True if a frame of B is still in flight.
    pub fn is_busy(&self) -> bool {
        self.rendered.as_ref().is_some_and(Viewport::is_busy)
    }

    /// True if a thread works on a result.
    pub fn is_working(&self) -> bool {
        self.difference.is_working() || self.background.as_ref().is_some_and(Background::is_working)
    }

    /// True if another frame would change B, or B has no image yet.
    pub fn has_more(&self, first: &Viewport, wipe: &Wipe, camera: &Camera) -> bool {
        match wipe.other {
            Other::Nothing => self.rendering().is_some(),
            Other::Settings => {
                let is_drawn = self.rendered.as_ref().is_some_and(|viewport| !viewport.has_more(camera));
                !is_drawn || self.is_behind || self.can_be_compared(first)
            }
            Other::PathTracer => self.tracing.is_none() || self.can_be_compared(first),
        }
    }
}

/// True if the path tracer's image is the same under both settings.
fn lit_alike(a: &Settings, b: &Settings) -> bool {
    let of = |settings: &Settings| {
        let lights = &settings.lights;
        (settings.materials.model, lights.falloff(), lights.range_threshold, lights.radius, lights.sun_diameter)
    };
    of(a) == of(b)
}

#[cfg(test)]
mod tests;
