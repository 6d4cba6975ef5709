//! Frame after frame: each moved to its time, rendered, written.

use lanternfish::{
    GpuScene, RenderedImage, Renderer, Report,
    debug_views::Scale,
    settings::{Exposure, Settings},
};
use lanternfish_scene::{Bounds, Camera, Scene};

use super::existing::EYES;
use crate::{
    args::RenderArgs,
    camera,
    error::CliError,
    legend, light_rig,
    motion::Motion,
    output::Output,
    parse::Frames,
    progress::Progress,
    report,
    shot::ShotFrame,
    stereo::{self, StereoLayout},
};

/// What images are made with.
pub struct RenderedImages<'a> {
    args: &'a RenderArgs,
    renderer: Renderer,
    uploaded: GpuScene,
    /// As the last frame left it, where anything in it may be another in the next; what was uploaded is the same.
    scene: Option<Scene>,
    motion: Option<Motion>,
    /// The scene's box as it was loaded, where something moves.
    bounds: Option<Bounds>,
    aspect: f32,
    scale: Option<Scale>,
    may_have_faint_sky: bool,
    /// What was metered as the frame that is next.
    metered: Option<Vec<RenderedImage>>,
    /// What all images cost that were made.
    pub cost: Report,
    /// Exposure at which images are shown, EV, once one is.
    pub exposure: Option<f32>,
}

/// True if one of the images decides how all are shown.
pub fn are_metered(settings: &Settings, output: &Output) -> bool {
    settings.exposure == Exposure::Auto && settings.debug_view.is_none() && !output.is_radiance()
}

impl<'a> RenderedImages<'a> {
    /// `scene` was just uploaded, as it is at 0 s. It is kept where something moves, or where it `may_have_faint_sky`.
    pub fn new(
        args: &'a RenderArgs,
        renderer: Renderer,
        uploaded: GpuScene,
        scene: Scene,
        motion: Option<Motion>,
        may_have_faint_sky: bool,
    ) -> Self {
        let size = args.output.size;
        let aspect = size.width as f32 / size.height as f32;
        let bounds = motion.is_some().then(|| scene.bounds());
        let scene = Some(scene).filter(|_| motion.is_some() || may_have_faint_sky);
        let scale = renderer.settings().debug_view.and_then(Scale::of);
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
            may_have_faint_sky,
            metered,
            cost,
            exposure,
        }
    }

    /// Decides by the first frame of the sequence how all are shown, whether it is requested or not: each by itself would
    /// flicker. A scene at night may be given a faint sky besides. Where it `is_next`, it is not drawn a second time.
    pub fn meter(
        &mut self,
        first: &ShotFrame,
        camera: &Camera,
        is_next: bool,
        progress: &mut Progress,
    ) -> Result<(), CliError> {
        let mut renderings = self.drawn(first, camera, progress)?;
        if self.may_have_faint_sky
            && let (Some(scene), Some(sky)) = (&mut self.scene, light_rig::faint_sky(&renderings[0]))
        {
            scene.sky = sky;
            self.renderer.update(&mut self.uploaded, scene)?;
            renderings = self.drawn(first, camera, progress)?;
            let sky = sky.to_array().map(|x| x.to_string()).join(",");
            progress.note(&format!(
                "the scene's lights leave most of the image black, and it has no environment: a faint sky was added \
                 (--sky {sky} repeats that, --light-rig none leaves it out)"
            ));
        }
        if let Some(ev) = renderings[0].exposure {
            self.renderer.set_exposure(Exposure::Ev(ev))?;
            let all = match self.args.track.frames {
                Some(Frames::Span(_)) => ", metered at 0 s",
                Some(Frames::Count(count)) if count > 1 => ", metered in the first image",
                _ => "",
            };
            progress.note(&format!("shown at {ev:+} EV{all}; --exposure {ev} repeats that, more is brighter"));
        }
        self.metered = Some(renderings).filter(|_| is_next);
        Ok(())
    }

    /// Renders a frame, for what it leaves to the next one alone.
    pub fn show(&mut self, frame: &ShotFrame, camera: &Camera, progress: &mut Progress) -> Result<(), CliError> {
        self.drawn(frame, camera, progress).map(|_| ())
    }

    /// Renders a frame and writes it.
    pub fn make(
        &mut self,
        frame: &ShotFrame,
        camera: &Camera,
        output: &Output,
        progress: &mut Progress,
    ) -> Result<(), CliError> {
        let mut renderings = match self.metered.take() {
            Some(metered) => metered,
            None => self.drawn(frame, camera, progress)?,
        };
        let writing = format!("Writing {}", output.path.display());
        let layers = self.args.stereo.stereo.is_some() && self.args.stereo.stereo_layout == StereoLayout::Layers;
        if layers {
            let named: Vec<_> = EYES.into_iter().zip(&renderings).collect();
            progress.step("write", &writing, || output.write_layers(&named))?;
        }
        let first = renderings.remove(0);
        self.exposure = self.exposure.or(first.exposure.filter(|_| !output.is_radiance()));
        let rendering = match renderings.pop() {
            Some(second) => stereo::side_by_side(first, second),
            None => first,
        };
        report::add(&mut self.cost, rendering.report.clone());
        let rendering = match &self.scale {
            Some(scale) => legend::below(rendering, scale),
            None => rendering,
        };
        if !layers {
            progress.step("write", &writing, || output.write(&rendering))?;
        }
        Ok(())
    }

    /// What is seen at a frame's time, an image an eye. It depends on the frame alone, not on those before it; motion
    /// is from what was drawn last.
    fn drawn(
        &mut self,
        frame: &ShotFrame,
        camera: &Camera,
        progress: &mut Progress,
    ) -> Result<Vec<RenderedImage>, CliError> {
        let mut camera = camera.clone();
        if let (Some(motion), Some(scene), Some(bounds), Some(time)) =
            (&self.motion, &mut self.scene, &self.bounds, frame.time)
        {
            motion.at_time(scene, time);
            let (renderer, uploaded) = (&self.renderer, &mut self.uploaded);
            progress.step("move", "Moving", || renderer.update(uploaded, scene))?;
            camera = camera::follow(scene, bounds, &frame.view, self.aspect, &camera)?;
        }
        let eyes = self.args.stereo.stereo.map(|eyes| stereo::cameras(eyes, &camera, self.aspect)).transpose()?;
        let cameras = eyes.as_ref().map_or(std::slice::from_ref(&camera), |eyes| eyes);
        let size = self.args.output.size;
        let views: Vec<_> = cameras.iter().map(|camera| (camera, size.width, size.height)).collect();
        let bar = progress.bar();
        let all = self.renderer.settings().accumulate;
        progress.step("render", "Rendering", || {
            Ok(self.renderer.render_frames(&self.uploaded, &views, |done| {
                bar.show(f64::from(done) / f64::from(all), format!("{done} of {all} frames"));
            })?)
        })
    }
}
