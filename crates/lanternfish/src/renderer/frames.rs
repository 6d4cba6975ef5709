//! Images that are the mean of several frames ([`crate::progressive`]).

use std::ops::ControlFlow;

use lanternfish_gpu::{GpuError, checked};
use lanternfish_scene::Camera;

use super::{RenderedImage, Renderer, Report};
use crate::{
    context::FrameContext,
    error::RenderError,
    frame::FrameResult,
    gpu_scene::GpuScene,
    prepass::ShownViews,
    settings::{DebugView, Settings},
    view::View,
};

const NO_MEAN_OF_DEBUG_VIEWS: RenderError = RenderError::Together { setting: "`debug-view`", needed: "`accumulate 1`" };

/// Returns an error if frames of these settings have no mean.
pub(super) fn check(settings: &Settings) -> Result<(), RenderError> {
    match settings.image.accumulate {
        0 => Err(RenderError::NoFrames),
        // A base colour can be averaged like radiance; other quantities cannot.
        2.. if settings.image.debug_view.is_some_and(|view| view != DebugView::BaseColor) => {
            Err(NO_MEAN_OF_DEBUG_VIEWS)
        }
        _ => Ok(()),
    }
}

impl Renderer {
    /// As [`Self::render_views`], and calls back with the number of frames after every frame of a mean. The callback
    /// may end the work: [`RenderError::Interrupted`].
    pub fn render_frames(
        &mut self,
        scene: &GpuScene,
        views: &[(&Camera, [u32; 2])],
        mut tell: impl FnMut(u32) -> ControlFlow<()>,
    ) -> Result<Vec<RenderedImage>, RenderError> {
        let views = self.views(scene, views)?;
        self.image_frames(|this| {
            if this.effective.image.accumulate == 1 {
                let results = this.frame(&FrameContext { scene, views: &views, is_averaged: false, requests: &[] })?;
                return this.renderings(scene, &views, &results);
            }
            this.passes.progressive.reset();
            let (mut results, mut cost) = (Vec::new(), Report::default());
            for count in 1..=this.effective.image.accumulate {
                results = this.next_frame(scene, &views)?;
                cost.add(this.finished()?);
                if tell(count).is_break() {
                    return Err(RenderError::Interrupted);
                }
            }
            let mut renderings = this.renderings(scene, &views, &results)?;
            if let Some(first) = renderings.first_mut() {
                (first.report.passes, first.report.commands) = (cost.passes, cost.commands);
            }
            Ok(renderings)
        })
    }

    /// Adds one frame to the mean of these views and returns the mean. Repeated calls refine the image. The counter
    /// `progressive/frames` of the first report is the number of frames in the mean.
    ///
    /// The mean stays on the device while cameras, sizes and scene equal those of the previous call; otherwise this
    /// frame starts a new mean. [`Self::update`] counts as a new scene for any change.
    /// [`ImageSettings::accumulate`](crate::settings::ImageSettings::accumulate) is ignored; if it is above 1, the mean
    /// continues from frames of [`Self::render`].
    pub fn refine(
        &mut self,
        scene: &GpuScene,
        views: &[(&Camera, [u32; 2])],
    ) -> Result<Vec<RenderedImage>, RenderError> {
        if self.passes.debug_views.is_some() {
            return Err(NO_MEAN_OF_DEBUG_VIEWS);
        }
        let views = self.views(scene, views)?;
        self.image_frames(|this| {
            let results = this.next_frame(scene, &views)?;
            this.renderings(scene, &views, &results)
        })
    }

    /// Runs `work`, which renders images with frames that may wait for the device.
    pub(super) fn image_frames<R>(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<R, RenderError>,
    ) -> Result<R, RenderError> {
        self.check_device()?;
        self.use_growth(self.image_growth)?;
        self.checked_work(work)
    }

    /// Runs `work`, which renders, and converts device errors to [`RenderError`]. After an error the next frame uses no
    /// state of earlier frames.
    pub(crate) fn checked_work<R>(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<R, RenderError>,
    ) -> Result<R, RenderError> {
        let device = self.device.clone();
        let result = checked(&device, "render", || work(self));
        if result.is_err() {
            self.forget_frames();
        }
        result
    }

    /// Makes the next [`Self::refine`] start a new mean, for a change that it does not detect.
    #[doc(hidden)]
    pub fn reset(&mut self) {
        self.passes.progressive.reset();
        self.passes.shown.iter_mut().for_each(ShownViews::forget);
    }

    /// Submits the next frame of the views' mean.
    pub(super) fn next_frame(&mut self, scene: &GpuScene, views: &[View]) -> Result<Vec<FrameResult>, RenderError> {
        let index = self.passes.progressive.begin(scene, views);
        let moved: Vec<View> = views.iter().map(|view| view.of_frame(index)).collect();
        let results = self.frame(&FrameContext { scene, views: &moved, is_averaged: true, requests: &[] })?;
        self.passes.progressive.finish(scene, views, index);
        Ok(results)
    }

    /// Waits for the last frame and returns its cost, without counters.
    fn finished(&mut self) -> Result<Report, RenderError> {
        let lost = |error| GpuError::ReadBack { what: "frame".to_owned(), source: Box::new(error) };
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
        let (passes, commands) = (self.profiler.times_of(self.last_frame), self.profiler.commands_of(self.last_frame));
        Ok(Report { passes, commands, ..Report::default() })
    }
}
