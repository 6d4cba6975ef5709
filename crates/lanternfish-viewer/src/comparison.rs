//! What is on the other side of the line: the scene by other settings, or the path tracer's image of it; and how far the two sides differ.

use std::sync::Arc;

use glam::UVec2;
use lanternfish::{
    RenderError,
    settings::{Exposure, Settings},
};
use lanternfish_gpu::ShaderTexts;
use lanternfish_scene::{Camera, Scene};

use crate::{
    background::{Background, Found, Look, Subject, Told, Traced},
    cloud::Cloud,
    difference::Difference,
    texture::{texture, write},
    viewport::Viewport,
    wipe::{Other, Wipe},
};

/// The other side, and what works for it.
#[derive(Debug, Default)]
pub struct Comparison {
    rendered: Option<Viewport>,
    cloud: Option<Cloud>,
    /// The scene has become another since the second rendering was made or brought up to date.
    is_behind: bool,
    background: Option<Background>,
    /// What the path tracer's image is of.
    tracing: Option<(Arc<Scene>, Settings, Camera, UVec2)>,
    look: Option<(Look, u64)>,
    traced: Option<(wgpu::TextureView, Traced)>,
    difference: Difference,
    /// Which two images were compared last.
    compared: Option<(u64, u64)>,
    map: Option<wgpu::TextureView>,
    mean: Option<f32>,
}

/// What has come of the other side.
#[derive(Debug, Default)]
pub struct News {
    /// True if anything is other than before.
    pub is_new: bool,
    /// Milliseconds of a frame of the second rendering that has just ended, behind one of the first.
    pub ms: Option<f64>,
    /// What lies under the pixel that was asked about.
    pub found: Option<Found>,
    /// What went wrong.
    pub failed: Option<String>,
}

impl Comparison {
    /// Lets go of the first rendering's scene, which is about to become another: it need not be copied then.
    pub fn let_go(&mut self) {
        self.is_behind = true;
        if let Some(viewport) = &mut self.rendered {
            viewport.scene = Arc::default();
        }
        self.cloud = None;
        self.forget_traced();
        if let Some(background) = &mut self.background {
            background.forget();
        }
        self.forget_difference();
    }

    /// Renders with the shaders of the first, which are others now.
    pub fn edit_shaders(&mut self, texts: ShaderTexts, camera: &Camera) -> Result<(), RenderError> {
        self.forget_difference();
        self.rendered.as_mut().map_or(Ok(()), |viewport| viewport.edit_shaders(texts, camera))
    }

    /// Draws the other side, where it is requested, as large as the first, or lets the path tracer go on with it. To be called while neither
    /// is busy. `rests`: nothing moves, and the image is whole.
    pub fn draw(&mut self, first: &Viewport, wipe: &Wipe, camera: &Camera, rests: bool) -> Result<(), RenderError> {
        if wipe.other != Other::Settings {
            self.rendered = None;
        }
        if wipe.other != Other::PathTracer {
            self.forget_traced();
        }
        if wipe.other != Other::DeepImages {
            self.cloud = None;
        }
        match wipe.other {
            Other::Settings => self.render(first, wipe, camera)?,
            Other::PathTracer => self.trace(first, camera, rests)?,
            Other::DeepImages => self.draw_cloud(first, camera)?,
            Other::Nothing => {}
        }
        if rests && matches!(wipe.other, Other::Settings | Other::PathTracer) {
            self.compare(first)?;
        } else {
            self.forget_difference();
        }
        Ok(())
    }

    fn render(&mut self, first: &Viewport, wipe: &Wipe, camera: &Camera) -> Result<(), RenderError> {
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
        if viewport.has_more(camera) {
            viewport.draw(camera)?;
        }
        Ok(())
    }

    fn draw_cloud(&mut self, first: &Viewport, camera: &Camera) -> Result<(), RenderError> {
        let cloud = match self.cloud.take().filter(|cloud| cloud.is_of(first)) {
            Some(cloud) => self.cloud.insert(cloud),
            None => self.cloud.insert(Cloud::new(first)?),
        };
        if cloud.is_drawn(camera, first.size()) { Ok(()) } else { cloud.draw(first, camera) }
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
        // What the first side is shown at may be another with each of its frames.
        let frames = first.drawn();
        if self.look.is_none_or(|(look, viewport)| viewport != frames || look.tone_map != first.settings().tone_map) {
            let ev = match first.settings().exposure {
                Exposure::Ev(ev) => ev,
                Exposure::Auto => first.exposure()?.unwrap_or(0.0),
            };
            let look = Look { ev, tone_map: first.settings().tone_map };
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

    /// Compares the two sides as they are now, unless that is done, or on its way.
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

    /// Which two images there are.
    fn pair(&self, first: &Viewport) -> (u64, u64) {
        let other = match &self.rendered {
            Some(viewport) => viewport.drawn(),
            None => self.traced.as_ref().map_or(0, |(_, traced)| traced.samples),
        };
        (first.drawn(), other)
    }

    /// Whether there are two images that have not been compared, and nothing is being compared.
    fn can_be_compared(&self, first: &Viewport) -> bool {
        let are_there = first.averaged() > 0 && self.progress() > 0;
        are_there && self.compared != Some(self.pair(first)) && !self.difference.is_working()
    }

    fn forget_difference(&mut self) {
        self.difference.stop();
        (self.compared, self.map, self.mean) = (None, None, None);
    }

    /// Asks what is seen at a place of the first side's image: shares of its sides.
    pub fn probe(&mut self, first: &Viewport, camera: &Camera, at: [f32; 2]) {
        let background = self.background.get_or_insert_with(Background::start);
        let size = first.size();
        let at = [f64::from(at[0]) * f64::from(size.x), f64::from(at[1]) * f64::from(size.y)];
        background.probe(Subject::new(&first.scene, first.settings()), camera, at, size);
    }

    /// What has come since it was asked last. It never waits.
    pub fn poll(&mut self, first: &Viewport) -> News {
        let mut news = News::default();
        if let Some(ms) = self.rendered.as_mut().and_then(Viewport::poll) {
            (news.ms, news.is_new) = (Some(ms), true);
        }
        while let Some(told) = self.background.as_mut().and_then(Background::poll) {
            news.is_new = true;
            match told {
                Told::RenderedImage(traced) => self.show(first, traced),
                Told::Pixel(found) => news.found = Some(found),
                Told::Failed(what) => news.failed = Some(what),
            }
        }
        if let Some(compared) = self.difference.poll() {
            news.is_new = true;
            match compared {
                Ok(compared) => {
                    let map = texture(&first.gpu.device, compared.size);
                    write(&first.gpu.queue, &map, &compared.map);
                    (self.map, self.mean) = (Some(map), Some(compared.mean));
                }
                Err(what) => news.failed = Some(what),
            }
        }
        news
    }

    fn show(&mut self, first: &Viewport, traced: Traced) {
        let kept = self.traced.take().filter(|(_, before)| before.size == traced.size);
        let texture = kept.map_or_else(|| texture(&first.gpu.device, traced.size), |(texture, _)| texture);
        write(&first.gpu.queue, &texture, &traced.bytes);
        self.traced = Some((texture, traced));
    }

    /// The other side's image, where there is one.
    pub fn rendering(&self) -> Option<&wgpu::TextureView> {
        match (&self.rendered, &self.cloud) {
            (Some(viewport), _) => Some(viewport.rendering()),
            (None, Some(cloud)) => cloud.rendering(),
            (None, None) => self.traced.as_ref().map(|(texture, _)| texture),
        }
    }

    /// The settings that the other side is rendered by.
    pub fn settings(&self) -> Option<&Settings> {
        self.rendered.as_ref().map(Viewport::settings)
    }

    /// Where the two sides differ, as a heat map, once that is known.
    pub fn map(&self) -> Option<&wgpu::TextureView> {
        self.map.as_ref()
    }

    /// The mean of the map.
    pub fn mean(&self) -> Option<f32> {
        self.mean
    }

    /// Frames that the other side is the mean of, or samples of each of its pixels.
    pub fn progress(&self) -> u64 {
        match &self.rendered {
            Some(viewport) => u64::from(viewport.averaged()),
            None => self.traced.as_ref().map_or(0, |(_, traced)| traced.samples),
        }
    }

    /// True if the device has not yet done what it was told of the other side.
    pub fn is_busy(&self) -> bool {
        self.rendered.as_ref().is_some_and(Viewport::is_busy)
    }

    /// True if a thread works on something that will be told.
    pub fn is_working(&self) -> bool {
        self.difference.is_working() || self.background.as_ref().is_some_and(Background::is_working)
    }

    /// Whether another frame would change the other side, or it is not there yet.
    pub fn has_more(&self, first: &Viewport, wipe: &Wipe, camera: &Camera) -> bool {
        match wipe.other {
            Other::Nothing => self.rendering().is_some(),
            Other::Settings => {
                let is_drawn = self.rendered.as_ref().is_some_and(|viewport| !viewport.has_more(camera));
                !is_drawn || self.is_behind || self.can_be_compared(first)
            }
            Other::DeepImages => {
                !self.cloud.as_ref().is_some_and(|cloud| cloud.is_of(first) && cloud.is_drawn(camera, first.size()))
            }
            Other::PathTracer => self.tracing.is_none() || self.can_be_compared(first),
        }
    }
}

/// True if the path tracer's image is the same under both.
fn lit_alike(a: &Settings, b: &Settings) -> bool {
    let of = |settings: &Settings| {
        (settings.materials, settings.attenuation, settings.range_threshold, settings.light_radius)
    };
    of(a) == of(b)
}

#[cfg(test)]
mod tests;
