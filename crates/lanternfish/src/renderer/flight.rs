//! Frames in the caller's command encoder: recorded, submitted and reported with deferred readback.

use std::{
    collections::VecDeque,
    iter,
    sync::{Arc, Weak},
};

use glam::{Affine3A, UVec2, Vec3};
use lanternfish_gpu::{Frame, GpuError, Growth, PassCommands, PassTime, is_lost};

use super::{RenderedImage, Renderer};
use crate::{
    context::FrameContext,
    error::RenderError,
    frame::FrameResult,
    gpu_scene::GpuScene,
    prepass::ShownViews,
    request::{SurfaceSource, Target, ViewRequest},
    settings::{Samples, Settings},
    texture::target,
    view::View,
};

/// The identifier of a recorded frame, unique in the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameId(u64);

/// A recorded frame whose commands the caller holds: after their submission, pass it to [`Renderer::submitted`]. If it
/// is dropped instead, the renderer takes the commands for dropped: its next call that renders or reads discards the
/// frame, and resets the state that depends on it, which is deep images, means and previous views.
#[derive(Debug)]
#[must_use = "call `Renderer::submitted` with it after its commands are submitted; dropped, the frame is discarded"]
pub struct PendingFrame {
    id: FrameId,
    /// The renderer observes whether it is alive.
    _alive: Arc<()>,
}

impl PendingFrame {
    /// The identifier under which the frame is reported and read.
    pub fn id(&self) -> FrameId {
        self.id
    }
}

/// The outcome of a frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// The frame.
    pub frame: FrameId,
    /// True if all of its lists had enough capacity. An incomplete frame shows nothing: displays hold the last complete
    /// frame.
    pub is_complete: bool,
    /// True if the device was lost; all its resources are lost too ([`GpuError::Lost`]).
    pub is_lost: bool,
    /// Device time of each pass, in order; empty if the device has no timestamp queries.
    pub passes: Vec<PassTime>,
    /// Dispatches of each pass, by label, in order. They are counted on any device.
    pub commands: Vec<PassCommands>,
    /// Entries of its lists, by name. `deep_images/age`, if deep images are built in slices: the age of the oldest
    /// images, frames.
    pub counters: Vec<(String, u64)>,
    /// Lists whose capacity changed because of this frame's counts.
    pub resized: Vec<&'static str>,
}

/// Recorded frames whose state is stored.
#[derive(Debug, Default)]
pub(super) struct Flight {
    /// The frame whose commands the caller holds, and whether its [`PendingFrame`] is alive.
    recorded: Option<(FrameId, Weak<()>)>,
    /// The results of the last frame.
    last: Option<Last>,
    /// Outcomes of the caller's frames that arrived while another operation waited.
    outcomes: VecDeque<FrameReport>,
    /// The scene's revision and the views of the last frame, with temporal antialiasing.
    shown: Option<(u64, Vec<View>)>,
    /// Age of the oldest deep images at each frame in flight, frames.
    ages: VecDeque<(FrameId, (&'static str, u64))>,
}

impl Flight {
    /// Drops the results of the last frame: another frame has overwritten them, or they are out of date.
    pub(super) fn forget(&mut self) {
        (self.recorded, self.last) = (None, None);
    }
}

/// Destination of a frame's commands.
enum Commands<'a> {
    /// The caller's command encoder.
    Encoder(&'a mut wgpu::CommandEncoder),
    /// Command buffers, one for each pass.
    Slices(&'a mut Vec<wgpu::CommandBuffer>),
}

#[derive(Debug)]
struct Last {
    frame: FrameId,
    views: Vec<View>,
    results: Vec<FrameResult>,
    counters: Vec<(String, u64)>,
}

impl Renderer {
    /// Compiles the pipelines for frames of these views and allocates their lists: renders them into textures of its
    /// own and waits for the device. Without this call the first frames take longer, and they are incomplete until the
    /// lists are large enough. A caller's G-buffer may be missing; the scene's surfaces are used instead.
    pub fn ready(&mut self, scene: &GpuScene, views: &[ViewRequest<'_>]) -> Result<(), RenderError> {
        let requested = self.requested(scene, views)?;
        let device = self.device.clone();
        let throw_away = |view: &ViewRequest<'_>, format| {
            target(&device, "ready", UVec2::from(view.size), format, wgpu::TextureUsages::empty())
        };
        let of = |view: &ViewRequest<'_>, to: &wgpu::TextureView| throw_away(view, to.texture().format());
        let textures: Vec<Vec<_>> = views
            .iter()
            .map(|view| match view.target {
                Target::Own => Vec::new(),
                Target::Display(_, format) => vec![throw_away(view, format)],
                Target::Radiance(to) => vec![of(view, to)],
                Target::Demodulated { direct, indirect } => vec![of(view, direct), of(view, indirect)],
            })
            .collect();
        let elsewhere = views.iter().zip(&textures).map(|(view, textures)| {
            let target = match (view.target, &textures[..]) {
                (Target::Display(_, format), [texture]) => Target::Display(texture, format),
                (Target::Radiance(_), [texture]) => Target::Radiance(texture),
                (Target::Demodulated { .. }, [direct, indirect]) => Target::Demodulated { direct, indirect },
                (target, _) => target,
            };
            ViewRequest { target, surface: SurfaceSource::Own, ..*view }
        });
        let elsewhere: Vec<_> = elsewhere.collect();
        self.image_frames(|this| {
            if views.iter().any(|view| matches!(view.surface, SurfaceSource::Given { .. })) {
                this.engine.within(|| this.passes.irradiance.given.ready(&this.device).map(|_| ()))?;
            }
            let context = FrameContext { scene, views: &requested, is_averaged: false, requests: &elsewhere };
            this.frame(&context).map(|_| ())
        })?;
        let mut commands = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("ready") });
        let frame = self.record(&mut commands, scene, &elsewhere)?;
        self.queue.submit([commands.finish()]);
        let frame = self.submitted(frame);
        // The next frame has no predecessor.
        self.passes.shown.iter_mut().for_each(ShownViews::forget);
        let lost = |error| GpuError::ReadBack { what: "ready".to_owned(), source: Box::new(error) };
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
        // Outcomes of the caller's frames are reported by a later `poll`.
        let earlier: Vec<_> = iter::from_fn(|| self.poll()).take_while(|report| report.frame < frame).collect();
        self.flight.outcomes.extend(earlier);
        Ok(())
    }

    /// Adds a frame of these views to the caller's commands. Never waits for the device: if a list overflows, this
    /// frame is not shown ([`FrameReport::is_complete`]) and a later frame has a larger list.
    ///
    /// Submit the commands, then call [`Self::submitted`] with the pending frame; or drop both, which discards the
    /// frame. Record one frame at a time. Up to 64 frames may be in flight; further ones are not reported. Do not
    /// update a scene of the frame between recording and submission. After an error the commands hold part of a frame
    /// or nothing: drop them.
    ///
    /// Images may be rendered between frames ([`Self::render`]). They wait for the device, and the two kinds of frames
    /// share no state: deep images are rebuilt and means restart.
    ///
    /// If [`ImageSettings::accumulate`](crate::settings::ImageSettings::accumulate) is above 1, each frame is added to
    /// the mean of the frames before it, as long as views and scene do not change. With temporal antialiasing, the
    /// first frame after a change belongs to no mean.
    pub fn record(
        &mut self,
        commands: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
        views: &[ViewRequest<'_>],
    ) -> Result<PendingFrame, RenderError> {
        self.record_into(Commands::Encoder(commands), scene, views)
    }

    /// Like [`Self::record`], but returns the frame as command buffers, one for each pass. Submit all of them in order,
    /// in as many submissions as desired, then call [`Self::submitted`]. The device executes submissions in order, so a
    /// program that submits slices of a slow frame one after the other can paint its interface between them. The image
    /// is the same to the bit.
    pub fn record_slices(
        &mut self,
        scene: &GpuScene,
        views: &[ViewRequest<'_>],
    ) -> Result<(PendingFrame, Vec<wgpu::CommandBuffer>), RenderError> {
        let mut slices = Vec::new();
        Ok((self.record_into(Commands::Slices(&mut slices), scene, views)?, slices))
    }

    fn record_into(
        &mut self,
        commands: Commands<'_>,
        scene: &GpuScene,
        views: &[ViewRequest<'_>],
    ) -> Result<PendingFrame, RenderError> {
        self.check_device()?;
        let requested = self.requested(scene, views)?;
        self.use_growth(Growth::Deferred)?;
        self.checked_work(|this| {
            // A moving view has temporal antialiasing; its mean begins when it rests.
            let rests = this.passes.antialiasing.is_none() || {
                let now = Some((scene.revision(), requested.clone()));
                std::mem::replace(&mut this.flight.shown, now.clone()) == now
            };
            let is_averaged = this.effective.image.accumulate > 1 && rests;
            let index = if is_averaged { this.passes.progressive.begin(scene, &requested) } else { 0 };
            let moved: Vec<View> = requested.iter().map(|view| view.of_frame(index)).collect();
            let context = FrameContext { scene, views: &moved, is_averaged, requests: views };
            let pool = this.pool.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
            let (device, queue, profiler) = (&this.device, &this.queue, &mut this.profiler);
            let mut frame = match commands {
                Commands::Encoder(commands) => Frame::within(device, queue, profiler, pool, commands),
                Commands::Slices(slices) => Frame::sliced(device, queue, profiler, pool, slices),
            };
            let results = this.engine.within(|| this.passes.record(&mut frame, &context))?;
            let frame = FrameId(frame.finish());
            if is_averaged {
                this.passes.progressive.finish(scene, &requested, index);
            }
            let counters = scene.counters().to_vec();
            let alive = Arc::new(());
            this.flight.recorded = Some((frame, Arc::downgrade(&alive)));
            // Further frames are not reported.
            this.flight.ages.truncate(63);
            let ages = this.passes.structures.iter().filter_map(|(_, structure)| structure.age());
            this.flight.ages.extend(ages.max_by_key(|(_, age)| *age).map(|age| (frame, age)));
            this.flight.last = Some(Last { frame, views: moved, results, counters });
            Ok(PendingFrame { id: frame, _alive: alive })
        })
    }

    /// Marks the commands of a frame as submitted. Returns the identifier for [`Self::read`] and
    /// [`FrameReport::frame`]. A frame that an error has reset since, or that another renderer recorded, stays
    /// unreported.
    pub fn submitted(&mut self, frame: PendingFrame) -> FrameId {
        if self.flight.recorded.take_if(|(recorded, _)| *recorded == frame.id).is_some() {
            let pool = self.pool.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
            lanternfish_gpu::submitted(frame.id.0, &mut self.profiler, pool);
        }
        frame.id
    }

    /// The report of the next finished frame, in the order of submission; `None` if no further frame has finished. Each
    /// frame is reported once. Never waits. If more than 64 frames are in flight, the newest are never reported.
    pub fn poll(&mut self) -> Option<FrameReport> {
        if let Some(report) = self.flight.outcomes.pop_front() {
            return Some(report);
        }
        let pool = self.pool.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
        let outcome = pool.outcome(&self.device)?;
        let ages = &mut self.flight.ages;
        while ages.front().is_some_and(|(frame, _)| frame.0 < outcome.frame) {
            ages.pop_front();
        }
        let age = ages.pop_front_if(|(frame, _)| frame.0 == outcome.frame).map(|(_, age)| age);
        let counters = outcome.lists.into_iter().map(|(name, count)| (name.to_owned(), count));
        // Results of a lost device cannot be read, even if they arrived before.
        let is_lost = outcome.is_lost || is_lost(&self.device);
        Some(FrameReport {
            frame: FrameId(outcome.frame),
            is_complete: outcome.is_complete,
            is_lost,
            passes: if is_lost { Vec::new() } else { self.profiler.times_of(outcome.frame) },
            commands: self.profiler.commands_of(outcome.frame),
            counters: counters.chain(age.map(|(name, age)| (name.to_owned(), age))).collect(),
            resized: outcome.resized,
        })
    }

    /// Waits for the last recorded and submitted frame and reads the images of its views with the target
    /// [`Target::Own`]. The images of an incomplete frame lack what did not fit the lists.
    pub fn read(&mut self, frame: FrameId) -> Result<Vec<RenderedImage>, RenderError> {
        self.check_device()?;
        let last = self.flight.last.take_if(|last| last.frame == frame).ok_or(RenderError::Gone)?;
        let renderings = self.images_of(&last.counters, &last.views, &last.results);
        self.flight.last = Some(last);
        renderings
    }

    /// Converts the requests to views.
    fn requested(&self, scene: &GpuScene, views: &[ViewRequest<'_>]) -> Result<Vec<View>, RenderError> {
        scene.check(&self.device, &self.needs)?;
        let view = |request: &ViewRequest<'_>| {
            if matches!(request.target, Target::Demodulated { .. }) {
                check_demodulated(&self.settings)?;
            }
            request.check(&self.device)?;
            let [clip_from_view, world_from_view] = request.matrices();
            // An environment image replaces the sky.
            let sky = if scene.environment.is_some() { Vec3::ZERO } else { scene.sky };
            let size = UVec2::from(request.size);
            let eye = Affine3A::from_mat4(world_from_view);
            let view = View::of_matrices(clip_from_view, eye, size, sky, &scene.bounds);
            Ok(self.completed(view, scene))
        };
        views.iter().map(view).collect()
    }

    /// Returns an error if the device is lost or the caller holds the commands of a frame. Discards a frame whose
    /// [`PendingFrame`] was dropped.
    pub(crate) fn check_device(&mut self) -> Result<(), RenderError> {
        match &self.flight.recorded {
            Some((_, alive)) if alive.strong_count() > 0 => return Err(RenderError::NotSubmitted),
            Some(_) => self.forget_frames(),
            None => (),
        }
        check_lost(&self.device)
    }
}

/// Returns an error if the device is lost: it would do nothing without reporting it.
pub(super) fn check_lost(device: &wgpu::Device) -> Result<(), RenderError> {
    if is_lost(device) { Err(GpuError::Lost.into()) } else { Ok(()) }
}

/// Returns an error if these settings do not support demodulated irradiance.
fn check_demodulated(settings: &Settings) -> Result<(), RenderError> {
    let needed =
        "another target (`Target::Demodulated` supports one sample per pixel, `accumulate 1` and no debug view)";
    let faults = [
        (settings.image.samples != Samples::One, "`samples`"),
        (settings.image.accumulate > 1, "`accumulate`"),
        (settings.image.debug_view.is_some(), "`debug-view`"),
    ];
    let fault = faults.iter().find(|(is_fault, _)| *is_fault);
    fault.map_or(Ok(()), |(_, setting)| Err(RenderError::Together { setting, needed }))
}
