//! Plays the frames: once to count, then several times to measure.
//!
//! Counting reads images and lists back, which takes time. So counting and timing are separate, and timed runs read
//! back nothing [VanGelderen2020, §6.1.1]. A timed frame only reads a few words: the lengths of its lists, by which the
//! renderer sets capacities.

use std::time::Instant;

use lanternfish::{Change, FrameReport, GpuScene, Renderer, Settings, Target, ViewRequest};
use lanternfish_gpu::{Engine, Gpu, PassCommands};
use lanternfish_scene::{Camera, Eyes};

use super::{category::Category, counted::Counted, plan::Plan, report::Report, series::Series};
use crate::{
    error::CliError,
    parse::Size,
    pass_costs::pass_costs,
    progress::{Bar, Progress},
    report::settings_by_name,
    warm,
};

/// Most submissions of a frame until its lists fit.
const TRIES: usize = 32;

/// A plan on a device.
pub struct Player<'a> {
    gpu: &'a Gpu,
    plan: Plan,
    renderer: Renderer,
    uploaded: GpuScene,
}

/// Times of all runs.
#[derive(Debug, Default)]
pub struct Times {
    /// Device times, by pass.
    pub passes: Vec<Series>,
    /// Host times.
    pub host: Vec<Series>,
    /// Dispatches of each pass in the last frame.
    pub commands: Vec<PassCommands>,
    /// The device's clocks before each run, if a program tells them.
    pub clocks: Vec<String>,
}

impl<'a> Player<'a> {
    /// Compiles the shaders and uploads the scene.
    pub fn new(gpu: &'a Gpu, plan: Plan, progress: &mut Progress) -> Result<Self, CliError> {
        Self::with_engine(gpu, &Engine::new(&gpu.device, &gpu.queue), plan, progress)
    }

    /// As [`Self::new`], with the shaders of this engine.
    pub fn with_engine(gpu: &'a Gpu, engine: &Engine, plan: Plan, progress: &mut Progress) -> Result<Self, CliError> {
        let settings = plan.settings.for_scene(&plan.scene);
        let renderer = progress.step("compile", "Compiling shaders", || Renderer::with_engine(engine, settings))?;
        let uploaded = progress.step("upload", "Building the BVH, uploading", || renderer.upload(&plan.scene))?;
        Ok(Self { gpu, plan, renderer, uploaded })
    }

    /// Renders with other settings, for these eyes, each of this size.
    pub fn set(&mut self, settings: &Settings, eyes: Option<Eyes>, size: Size) -> Result<(), CliError> {
        (self.plan.settings, self.plan.eyes, self.plan.size) = (settings.clone(), eyes, size);
        if self.renderer.set(settings.for_scene(&self.plan.scene))? == Change::Upload {
            self.uploaded = self.renderer.upload(&self.plan.scene)?;
        }
        Ok(())
    }

    /// Replays only the first so many frames.
    pub fn limit(&mut self, most: usize) {
        self.plan.limit(most);
    }

    /// A report of the plan, before anything is counted or timed.
    pub fn report(&self, source: &str, scene: String, runs: usize, seed: u32) -> Report {
        let (plan, adapter) = (&self.plan, &self.gpu.description);
        let settings = settings_by_name(&plan.settings, seed).into_iter();
        Report {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            source: source.to_owned(),
            scene,
            adapter: adapter.name.clone(),
            driver: adapter.driver.clone(),
            width: plan.size.width,
            height: plan.size.height,
            eyes: plan.eyes(),
            lights: plan.scene.lights.len(),
            settings: settings.map(|(name, value)| (name.to_owned(), value)).collect(),
            runs,
            moments: plan.moments(),
            ..Report::default()
        }
    }

    /// Counts and times every frame.
    pub fn measure(&mut self, report: &mut Report, progress: &mut Progress) -> Result<(), CliError> {
        report.frames = self.count(progress)?;
        let times = self.time(report.runs, progress)?;
        (report.passes, report.host, report.clocks) = (times.passes, times.host, times.clocks);
        report.costs = pass_costs(&times.commands, |name| report.mean_count(name));
        let memory = self.renderer.memory();
        report.memory = Some((memory.bytes, memory.device_bytes));
        report.estimate();
        Ok(())
    }

    /// Counts every frame.
    pub fn count(&mut self, progress: &mut Progress) -> Result<Vec<Counted>, CliError> {
        let (bar, all) = (progress.bar(), self.plan.frames());
        progress.step("count", "Counting", || {
            let one = |frame: usize| {
                bar.show_left(frame as f64 / all as f64, format!("counting: frame {frame} of {all}"));
                self.bring(frame)?;
                let (cameras, size) = (self.plan.cameras(frame)?, self.plan.size);
                let views: Vec<_> = cameras.iter().map(|camera| (camera, [size.width, size.height])).collect();
                let renderings = self.renderer.render_views(&self.uploaded, &views)?;
                Ok(Counted::of(&renderings, &self.renderer.cluster_contents()?))
            };
            (0..all).map(one).collect()
        })
    }

    /// Times every frame in `runs` equal runs.
    pub fn time(&mut self, runs: usize, progress: &mut Progress) -> Result<Times, CliError> {
        let (bar, mut times) = (progress.bar(), Times::default());
        let all = || (0..runs).try_for_each(|run| self.run(&mut times, run, runs, &bar));
        progress.step("time", "Timing", all)?;
        Ok(times)
    }

    /// Adds the run of number `run` of `runs`: every frame once, after a warm-up with the first.
    pub(crate) fn run(&mut self, times: &mut Times, run: usize, runs: usize, bar: &Bar) -> Result<(), CliError> {
        let frames = self.plan.frames();
        self.bring(0)?;
        let cameras = self.plan.cameras(0)?;
        times.clocks.extend(self.warm_up(&cameras)?);
        for frame in 0..frames {
            bar.show_left(
                (run * frames + frame) as f64 / (runs * frames) as f64,
                format!("run {} of {runs}, frame {frame} of {frames}", run + 1),
            );
            self.frame(times, run, frame)?;
        }
        times.passes.iter_mut().chain(&mut times.host).for_each(|series| series.fill(run + 1, frames));
        Ok(())
    }

    /// Renders these views until the device is warm.
    fn warm_up(&mut self, cameras: &[Camera]) -> Result<Option<String>, CliError> {
        let requests = self.requests(cameras);
        let (gpu, renderer, uploaded) = (self.gpu, &mut self.renderer, &self.uploaded);
        warm::up(gpu, || Ok(renderer.ready(uploaded, &requests)?))
    }

    /// Moves the scene to a frame's time.
    fn bring(&mut self, frame: usize) -> Result<(), CliError> {
        if self.plan.go_to(frame)? {
            self.renderer.update(&mut self.uploaded, &self.plan.scene)?;
        }
        Ok(())
    }

    fn requests<'c>(&self, cameras: &'c [Camera]) -> Vec<ViewRequest<'c>> {
        let size = [self.plan.size.width, self.plan.size.height];
        let request = |(key, camera)| ViewRequest::of_camera(key, camera, size, Target::Own);
        (0..).zip(cameras).map(request).collect()
    }

    fn frame(&mut self, times: &mut Times, run: usize, frame: usize) -> Result<(), CliError> {
        let frames = self.plan.frames();
        let moved = self.plan.go_to(frame)?;
        let started = Instant::now();
        if moved {
            self.renderer.update(&mut self.uploaded, &self.plan.scene)?;
        }
        let updated = ms_since(started);
        let cameras = self.plan.cameras(frame)?;
        for _ in 0..TRIES {
            let started = Instant::now();
            let mut commands = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let id = self.renderer.record(&mut commands, &self.uploaded, &self.requests(&cameras))?;
            let commands = commands.finish();
            let recorded = ms_since(started);
            self.gpu.queue.submit([commands]);
            let id = self.renderer.submitted(id);
            self.gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| lost(&error))?;
            let total = ms_since(started);
            let report = std::iter::from_fn(|| self.renderer.poll()).find(|report| report.frame == id);
            let report = report.ok_or_else(|| lost(&"a completed frame has no report"))?;
            if !report.is_complete {
                continue;
            }
            times.add(run, frame, frames, &report, [updated, recorded, total]);
            times.commands = report.commands;
            return Ok(());
        }
        Err(CliError::new(
            format_args!("frame {frame}: its lists did not fit after {TRIES} tries"),
            "choose a smaller --size, or fewer lights",
        ))
    }
}

impl Times {
    fn add(
        &mut self,
        run: usize,
        frame: usize,
        frames: usize,
        report: &FrameReport,
        [update, record, total]: [f64; 3],
    ) {
        for pass in &report.passes {
            named(&mut self.passes, &pass.name, Category::of(&pass.name)).add(run, frame, frames, pass.ms);
        }
        for (name, ms) in [("host/update", update), ("host/record", record), ("host/frame", total)] {
            named(&mut self.host, name, Category::Host).add(run, frame, frames, ms);
        }
    }
}

/// The series of this name, created if missing.
fn named<'s>(all: &'s mut Vec<Series>, name: &str, category: Category) -> &'s mut Series {
    let index = all.iter().position(|series| series.name == name).unwrap_or_else(|| {
        all.push(Series::new(name, category));
        all.len() - 1
    });
    &mut all[index]
}

fn ms_since(started: Instant) -> f64 {
    1e3 * started.elapsed().as_secs_f64()
}

fn lost(error: &dyn std::fmt::Display) -> CliError {
    CliError::new(format_args!("the device did not finish a frame: {error}"), "the driver's log may say why")
}
