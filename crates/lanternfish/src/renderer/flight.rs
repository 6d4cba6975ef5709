//! Frames in the caller's commands: recorded, handed to the device, reported, and never waited for.

use std::{collections::VecDeque, iter};

use glam::{Affine3A, UVec2, Vec3};
use lanternfish_gpu::{Frame, GpuError, Growth, PassTime, is_lost};

use super::{RenderedImage, Renderer};
use crate::{
    context::FrameContext,
    error::RenderError,
    frame::FrameResult,
    gpu_scene::GpuScene,
    request::{SurfaceSource, Target, ViewRequest},
    settings::{Samples, Settings},
    texture::target,
    view::View,
};

/// A frame that was recorded; no other frame of the program has the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameId(u64);

/// What has become of a frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// Which it is.
    pub frame: FrameId,
    /// Whether there was room for all of its lists. If not, it has shown nothing: displays are those of the last frame that was whole.
    pub is_complete: bool,
    /// Whether the device has lost it: everything on the device is gone then ([`GpuError::Lost`]).
    pub is_lost: bool,
    /// Device time of each pass, in order; empty where the device has no timestamp queries.
    pub passes: Vec<PassTime>,
    /// Entries of its lists, by their names; and `deep_images/age`, where slices of deep images are built in turn: frames since the
    /// oldest images were right.
    pub counters: Vec<(String, u64)>,
    /// Lists that have got other room because of what it has counted.
    pub resized: Vec<&'static str>,
}

/// The frames that are recorded and not forgotten.
#[derive(Debug, Default)]
pub(super) struct Flight {
    /// The frame whose commands the caller has.
    recorded: Option<FrameId>,
    /// What the last frame has left.
    last: Option<Last>,
    /// What has become of the caller's frames, found while something else was waited for.
    found: VecDeque<FrameReport>,
    /// Frames since the oldest deep images of a frame were right; of frames that are on their way.
    ages: VecDeque<(FrameId, (&'static str, u64))>,
}

impl Flight {
    /// Nothing of the last frame can be read any more: another one uses what it has left, or it is no longer what it was.
    pub(super) fn forget(&mut self) {
        (self.recorded, self.last) = (None, None);
    }
}

#[derive(Debug)]
struct Last {
    frame: FrameId,
    views: Vec<View>,
    results: Vec<FrameResult>,
    counters: Vec<(String, u64)>,
}

impl Renderer {
    /// Compiles what frames of these views need, and makes room for their lists: it renders them, into textures of its own, and waits
    /// for the device. Without it the first frames take longer, and are not shown as long as they lack room. Surfaces that are given need
    /// not be there yet: the scene's own are rendered.
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
                Target::Sums { direct, indirect } => vec![of(view, direct), of(view, indirect)],
            })
            .collect();
        let elsewhere = views.iter().zip(&textures).map(|(view, textures)| {
            let target = match (view.target, &textures[..]) {
                (Target::Display(_, format), [texture]) => Target::Display(texture, format),
                (Target::Radiance(_), [texture]) => Target::Radiance(texture),
                (Target::Sums { .. }, [direct, indirect]) => Target::Sums { direct, indirect },
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
        self.submitted(frame);
        // These frames are before none.
        self.passes.forget_shown();
        let lost = |error| GpuError::ReadBack { what: "ready".to_owned(), source: Box::new(error) };
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
        // Of the caller's frames it is told later.
        let earlier: Vec<_> = iter::from_fn(|| self.poll()).take_while(|report| report.frame < frame).collect();
        self.flight.found.extend(earlier);
        Ok(())
    }

    /// Adds a frame of these views to the caller's commands. It never waits for the device: where a list turns out to need more room than
    /// there is, a later frame has it, and this one is not shown ([`FrameReport::is_complete`]).
    ///
    /// Hand the commands to the device, and then tell [`Self::submitted`]; frames are recorded one after the other, and up to 64 of them may
    /// be on their way: of further ones nothing is known. Between the two, update no scene that it shows. After an error the commands hold a part of a frame, or nothing:
    /// drop them.
    ///
    /// Images may be rendered in between ([`Self::render`]). They wait, and what frames of the one kind keep is not used by the other: deep
    /// images are built again, means begin again.
    ///
    /// With [`crate::Settings::accumulate`] above 1 each frame is added to the mean of those before it, as long as views and scene stay the
    /// same.
    pub fn record(
        &mut self,
        commands: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
        views: &[ViewRequest<'_>],
    ) -> Result<FrameId, RenderError> {
        self.check_device()?;
        let requested = self.requested(scene, views)?;
        self.use_growth(Growth::Deferred)?;
        self.checked_work(|this| {
            let is_averaged = this.effective.accumulate > 1;
            let index = if is_averaged { this.passes.progressive.begin(scene, &requested) } else { 0 };
            let moved: Vec<View> = requested.iter().map(|view| view.of_frame(index)).collect();
            let context = FrameContext { scene, views: &moved, is_averaged, requests: views };
            let pool = this.pool.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
            let mut frame = Frame::within(&this.device, &this.queue, &mut this.profiler, pool, commands);
            let results = this.engine.within(|| this.passes.record(&mut frame, &context))?;
            let frame = FrameId(frame.finish());
            if is_averaged {
                this.passes.progressive.finish(scene, &requested, index);
            }
            let counters = scene.counters().to_vec();
            this.flight.recorded = Some(frame);
            // Of further frames nothing is told.
            this.flight.ages.truncate(63);
            this.flight
                .ages
                .extend(this.passes.structure.as_ref().and_then(|structure| Some((frame, structure.age()?))));
            this.flight.last = Some(Last { frame, views: moved, results, counters });
            Ok(frame)
        })
    }

    /// Says that the commands of a frame were handed to the device. A frame of which that is known already is left as it is.
    pub fn submitted(&mut self, frame: FrameId) {
        if self.flight.recorded == Some(frame) {
            self.flight.recorded = None;
            let pool = self.pool.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
            lanternfish_gpu::submitted(frame.0, &mut self.profiler, pool);
        }
    }

    /// Says that the commands of a frame will never be handed to the device. What frames have kept of it is forgotten: deep images, means,
    /// what was shown.
    pub fn discard(&mut self, frame: FrameId) {
        if self.flight.recorded == Some(frame) {
            self.forget_frames();
        }
    }

    /// What has become of a frame that was submitted: of each once, in their order, as soon as the device is done with it. None: of no
    /// further one yet. It never waits. Of more than 64 frames that are on their way at one time, the newest are never told of.
    pub fn poll(&mut self) -> Option<FrameReport> {
        if let Some(found) = self.flight.found.pop_front() {
            return Some(found);
        }
        let pool = self.pool.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
        let outcome = pool.outcome(&self.device)?;
        let ages = &mut self.flight.ages;
        while ages.front().is_some_and(|(frame, _)| frame.0 < outcome.frame) {
            ages.pop_front();
        }
        let age = ages.pop_front_if(|(frame, _)| frame.0 == outcome.frame).map(|(_, age)| age);
        let counters = outcome.lists.into_iter().map(|(name, count)| (name.to_owned(), count));
        // Of a lost device, what has arrived before cannot be read.
        let is_lost = outcome.is_lost || is_lost(&self.device);
        Some(FrameReport {
            frame: FrameId(outcome.frame),
            is_complete: outcome.is_complete,
            is_lost,
            passes: if is_lost { Vec::new() } else { self.profiler.times_of(outcome.frame) },
            counters: counters.chain(age.map(|(name, age)| (name.to_owned(), age))).collect(),
            resized: outcome.resized,
        })
    }

    /// Waits for the last frame that was recorded and submitted, and reads the images of those of its views whose target is
    /// [`Target::Own`]. Of a frame that is not whole they are what there was room for.
    pub fn read(&mut self, frame: FrameId) -> Result<Vec<RenderedImage>, RenderError> {
        self.check_device()?;
        let last = self.flight.last.take_if(|last| last.frame == frame).ok_or(RenderError::Gone)?;
        let renderings = self.images_of(&last.counters, &last.views, &last.results);
        self.flight.last = Some(last);
        renderings
    }

    /// The views that are requested.
    fn requested(&self, scene: &GpuScene, views: &[ViewRequest<'_>]) -> Result<Vec<View>, RenderError> {
        scene.check(&self.device, &self.needs)?;
        let view = |request: &ViewRequest<'_>| {
            if matches!(request.target, Target::Sums { .. }) {
                check_sums(&self.settings)?;
            }
            request.check(&self.device)?;
            let [clip_from_view, world_from_view] = request.matrices();
            // An image of the environment stands in the sky's place.
            let sky = if scene.environment.is_some() { Vec3::ZERO } else { scene.sky };
            let size = UVec2::from(request.size);
            let eye = Affine3A::from_mat4(world_from_view);
            let view = View::of_matrices(clip_from_view, eye, size, sky, &scene.bounds);
            Ok(View { samples: self.effective.samples.count(), ..view })
        };
        views.iter().map(view).collect()
    }

    /// An error where the device is lost, or the caller still has the commands of a frame.
    pub(super) fn check_device(&self) -> Result<(), RenderError> {
        match self.flight.recorded {
            Some(_) => Err(RenderError::NotSubmitted),
            None => check_lost(&self.device),
        }
    }
}

/// An error where the device is lost: it would do nothing, and say nothing of that.
pub(super) fn check_lost(device: &wgpu::Device) -> Result<(), RenderError> {
    if is_lost(device) { Err(GpuError::Lost.into()) } else { Ok(()) }
}

/// An error unless sums can be asked for under these settings.
fn check_sums(settings: &Settings) -> Result<(), RenderError> {
    let needed = "images of its own (`Target::Sums` takes one sample a pixel, `accumulate 1` and no debug view)";
    let faults = [
        (settings.samples != Samples::One, "`samples`"),
        (settings.accumulate > 1, "`accumulate`"),
        (settings.debug_view.is_some(), "`debug-view`"),
    ];
    let fault = faults.iter().find(|(is_fault, _)| *is_fault);
    fault.map_or(Ok(()), |(_, setting)| Err(RenderError::Together { setting, needed }))
}
