//! Renders frame after frame: moves the scene to its time, renders, writes.

use std::{
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering::Relaxed},
    },
};

use lanternfish::{
    Aovs, FrameMemory, GpuScene, RenderedImage, Renderer, Report,
    debug_views::Scale,
    settings::{Exposure, Settings},
};
use lanternfish_gpu::PassProgress;
use lanternfish_metrics::Animation;
use lanternfish_scene::{Bounds, Camera, Scene};

use super::{existing::EYES, metadata};
use crate::{
    args::RenderArgs,
    camera,
    error::CliError,
    images, legend,
    light_rig::{self, AddedLights, FillLight, Lighting},
    motion::Motion,
    output::Output,
    outputs::{Names, Surfaces},
    parse::Frames,
    progress::{Bar, Progress},
    report::grouped,
    stage::Posed,
    stereo::{self, StereoLayout},
};

/// The state that renders images.
pub struct RenderedImages<'a> {
    args: &'a RenderArgs,
    renderer: Renderer,
    uploaded: GpuScene,
    /// The scene as the last frame left it, if anything may change in the next; the uploaded scene has the same state.
    scene: Option<Scene>,
    motion: Option<Motion>,
    /// The bounds of the scene as it was loaded, if something moves.
    bounds: Option<Bounds>,
    aspect: f32,
    scale: Option<Scale>,
    /// The lights of a rig that follow the camera of an orbit, and the orbit's angle at which they are.
    revolving: AddedLights,
    orbit_angle: f32,
    may_lack_light: Option<Lighting>,
    /// The metered images, if they are also the next frame's.
    metered: Option<Drawn>,
    /// Number of frames rendered so far, each of one or two images.
    drawn_count: u32,
    /// Names of the scene, if its surfaces are written, too.
    pub names: Option<Names>,
    /// The animation to which frames are added, if they have no files of their own.
    pub animation: Option<Animation>,
    /// The cost of all rendered images.
    pub cost: Report,
    /// Exposure of the images, EV, once chosen.
    pub exposure: Option<f32>,
}

/// The images of a frame, one per eye.
struct Drawn {
    renderings: Vec<RenderedImage>,
    /// The camera at the time of the frame; that of the head, in stereo.
    camera: Camera,
    /// Number of frames that were rendered before it.
    before: u32,
}

/// Progress of an image: its frames, and the passes of the frame that is rendered.
struct ShownFrames {
    bar: Bar,
    all: u32,
    done: AtomicU32,
    /// True for the first image of the process, which compiles what the driver has not stored.
    is_first: bool,
}

impl ShownFrames {
    fn new(bar: Bar, all: u32, is_first: bool) -> Self {
        Self { bar, all, done: AtomicU32::new(0), is_first }
    }

    fn pass(&self, PassProgress { label, index, count }: PassProgress<'_>) {
        let done = self.done.load(Relaxed);
        let doing = match self.is_first && done == 0 {
            true => "Rendering (the first time compiles shaders, once)",
            false => "Rendering",
        };
        match self.all {
            // A frame has several parts if the host reads a result, or if it starts over with larger lists: no count of
            // its passes is known.
            1 => self.bar.tell(format!("{doing}: {label}")),
            all => {
                let fraction = f64::from(done) / f64::from(all);
                let pass = format!("pass {} of {count}, {label}", index + 1);
                self.bar.show(fraction, format!("{doing}: frame {} of {all}, {pass}", done + 1));
            }
        }
    }

    fn done(&self, done: u32) {
        self.done.store(done, Relaxed);
        self.bar.show_left(f64::from(done) / f64::from(self.all), format!("Rendering: {done} of {} frames", self.all));
    }
}

/// True if one image sets the exposure of all.
pub fn are_metered(settings: &Settings, output: &Output) -> bool {
    settings.image.exposure == Exposure::Auto && settings.image.debug_view.is_none() && !output.is_radiance()
}

impl<'a> RenderedImages<'a> {
    /// `scene` was just uploaded, in its state at 0 s. It is kept if something moves, also by an orbit, or if it
    /// `may_lack_light`.
    pub fn new(
        args: &'a RenderArgs,
        renderer: Renderer,
        uploaded: GpuScene,
        scene: Scene,
        motion: Option<Motion>,
        revolving: AddedLights,
        may_lack_light: Option<Lighting>,
    ) -> Self {
        let size = args.output.size;
        let aspect = size.aspect();
        let may_change = args.track.orbit.is_some() && !revolving.is_empty();
        let bounds = motion.is_some().then(|| scene.bounds());
        let scene = Some(scene).filter(|_| motion.is_some() || may_change || may_lack_light.is_some());
        let scale = renderer.settings().image.debug_view.and_then(Scale::of);
        let (cost, exposure, metered) = (Report::default(), None, None);
        Self {
            args,
            renderer,
            uploaded,
            scene,
            motion,
            bounds,
            aspect,
            scale,
            revolving,
            orbit_angle: 0.0,
            may_lack_light,
            metered,
            drawn_count: 0,
            names: None,
            animation: None,
            cost,
            exposure,
        }
    }

    /// Chooses the exposure of all images by the sequence's first frame, whether requested or not; metering each alone
    /// would flicker. May add light to a scene that is nearly black. If the first frame `is_next`, its images are
    /// reused.
    pub fn meter(&mut self, first: &Posed, is_next: bool, progress: &mut Progress) -> Result<(), CliError> {
        if let Some(ev) = self.revolving.exposure() {
            self.renderer.set_exposure(Exposure::Ev(ev))?;
        }
        let mut drawn = self.drawn(first, progress)?;
        let flags = &self.args.lights;
        if let Some(lighting) = self.may_lack_light
            && let Some(scene) = &mut self.scene
            && let Some(fill) = FillLight::of(&drawn.renderings[0], scene, &first.camera, flags, &self.revolving)
        {
            if light_rig::has_light(flags) {
                progress.note(&fill.advice());
            } else {
                self.revolving = fill.add(scene, &first.camera, self.revolving, flags, lighting);
                self.uploaded = self.renderer.upload(scene)?;
                drawn = self.drawn(first, progress)?;
                progress.note(&fill.note());
            }
        }
        if let Some(ev) = drawn.renderings[0].exposure {
            self.renderer.set_exposure(Exposure::Ev(ev))?;
            let when = &self.args.track;
            let all = match (when.frames, when.orbit) {
                (_, Some(_)) => ", metered in frame 1",
                (Some(Frames::Span(_)), None) => ", metered at 0 s",
                (Some(Frames::Count(count)), None) if count > 1 => ", metered in the first image",
                _ => "",
            };
            progress.note(&format!("shown at {ev:+} EV{all}; --exposure {ev} repeats it, larger is brighter"));
        }
        self.metered = Some(drawn).filter(|_| is_next);
        Ok(())
    }

    /// Memory of the device after the last image.
    pub fn memory(&self) -> FrameMemory {
        self.renderer.memory()
    }

    /// Renders a frame only for the history that it leaves to the next one.
    pub fn show(&mut self, frame: &Posed, progress: &mut Progress) -> Result<(), CliError> {
        self.drawn(frame, progress).map(|_| ())
    }

    /// Renders a frame and writes it. `next`: the frame that motion of its surfaces leads to.
    pub fn make(
        &mut self,
        frame: &Posed,
        next: Option<&Posed>,
        output: &Output,
        progress: &mut Progress,
    ) -> Result<(), CliError> {
        let Drawn { mut renderings, camera, before } = match self.metered.take() {
            Some(metered) => metered,
            None => self.drawn(frame, progress)?,
        };
        let aovs = match self.names {
            Some(_) => Some(self.aovs(frame, &camera, next, progress)?),
            None => None,
        };
        let wrong: usize = renderings.iter_mut().map(images::make_finite).sum();
        progress.warn((wrong > 0).then(|| {
            format!("{} pixels are no finite numbers, and black: --debug-view nan shows them", grouped(wrong as u64))
        }));
        let texts = metadata::texts(self.renderer.settings(), self.args.run.seed, before);
        let writing = format!("Writing {}", output.path.display());
        let layers = self.args.stereo.stereo.is_some() && self.args.stereo.stereo_layout == StereoLayout::Layers;
        if layers {
            let named: Vec<_> = EYES.into_iter().zip(&renderings).collect();
            progress.step("write", &writing, || output.write_layers(&named, &texts))?;
        }
        let first = renderings.remove(0);
        self.exposure = self.exposure.or(first.exposure.filter(|_| !output.is_radiance()));
        let rendering = match renderings.pop() {
            Some(second) => stereo::side_by_side(first, second),
            None => first,
        };
        self.cost.add(rendering.report.clone());
        let rendering = match &self.scale {
            Some(scale) if self.args.output.legend => legend::below(rendering, scale),
            _ => rendering,
        };
        if let Some(animation) = &mut self.animation {
            let size = [rendering.width, rendering.height];
            progress.step("write", &writing, || animation.add(size, &rendering.display))?;
        } else if !layers {
            let quantities = self.args.quantities();
            let surfaces = aovs.as_ref().zip(self.names.as_ref());
            let surfaces = surfaces.map(|(aovs, names)| Surfaces { aovs, names, quantities });
            progress.step("write", &writing, || output.write(&rendering, surfaces.as_ref(), &texts))?;
        }
        Ok(())
    }

    /// What the surfaces of a frame are, which was just drawn from `drawn_from`.
    fn aovs(
        &mut self,
        frame: &Posed,
        drawn_from: &Camera,
        next: Option<&Posed>,
        progress: &mut Progress,
    ) -> Result<Aovs, CliError> {
        let next = match next {
            Some(next) => {
                let camera = self.moved(next, progress)?;
                Some(self.renderer.moment(&self.uploaded, &camera))
            }
            None => None,
        };
        if next.is_some() {
            self.moved(frame, progress)?;
        }
        let size = self.args.output.size;
        let size = [size.width, size.height];
        let (renderer, uploaded) = (&mut self.renderer, &self.uploaded);
        progress.step("outputs", "Drawing outputs", || Ok(renderer.aovs(uploaded, drawn_from, size, next.as_ref())?))
    }

    /// Moves the scene to a frame's time; returns the camera at that time.
    fn moved(&mut self, Posed { frame, camera }: &Posed, progress: &mut Progress) -> Result<Camera, CliError> {
        let Some(scene) = &mut self.scene else { return Ok(camera.clone()) };
        let moment = self.motion.as_ref().zip(frame.time);
        let angle = frame.view.orbit_angle;
        let is_revolved = angle != self.orbit_angle && !self.revolving.is_empty();
        if let Some((motion, time)) = moment {
            motion.at_time(scene, time)?;
        }
        if is_revolved {
            self.revolving.revolve(scene, angle);
            self.orbit_angle = angle;
        }
        if moment.is_some() || is_revolved {
            let (renderer, uploaded) = (&self.renderer, &mut self.uploaded);
            progress.step("move", "Moving", || renderer.update(uploaded, scene))?;
        }
        match (moment, &self.bounds) {
            (Some(_), Some(bounds)) => camera::follow(scene, bounds, &frame.view, self.aspect, camera),
            _ => Ok(camera.clone()),
        }
    }

    /// Renders the images at a frame's time, one per eye. They depend on the frame alone, except for motion, which is
    /// relative to the previous one.
    fn drawn(&mut self, frame: &Posed, progress: &mut Progress) -> Result<Drawn, CliError> {
        let camera = self.moved(frame, progress)?;
        let eyes = self.args.stereo.stereo.map(|eyes| stereo::cameras(eyes, &camera, self.aspect)).transpose()?;
        let cameras = eyes.as_ref().map_or(std::slice::from_ref(&camera), |eyes| eyes);
        let size = self.args.output.size;
        let views: Vec<_> = cameras.iter().map(|camera| (camera, [size.width, size.height])).collect();
        let shown = Arc::new(ShownFrames::new(
            progress.bar(),
            self.renderer.settings().image.accumulate,
            self.drawn_count == 0,
        ));
        if self.renderer.engine().device.adapter_info().device_type == wgpu::DeviceType::Cpu {
            let shown = Arc::clone(&shown);
            self.renderer.watch_passes(Some(Box::new(move |pass| shown.pass(pass))));
        }
        let renderings = progress.step("render", "Rendering", || {
            let tell = |done| {
                shown.done(done);
                ControlFlow::Continue(())
            };
            Ok::<_, CliError>(self.renderer.render_frames(&self.uploaded, &views, tell)?)
        })?;
        self.renderer.watch_passes(None);
        let before = self.drawn_count;
        self.drawn_count += 1;
        Ok(Drawn { renderings, camera, before })
    }
}
