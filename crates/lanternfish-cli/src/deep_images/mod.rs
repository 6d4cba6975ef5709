//! `lanternfish deep-images`: renders images of deep images.
//!
//! 1. Read the scene and the camera as `render` does.
//! 2. Build the deep images ([`looker`]).
//! 3. Draw points, or read texels and colour them; arrange several images side by side ([`sheet`]).

mod args;
mod looker;
mod sheet;

use clap::ArgMatches;
use glam::{UVec2, Vec3};
use lanternfish::view::View;
use lanternfish_gpu::{Gpu, checked, driver_warning};

pub use self::args::{DeepImagesArgs, HELP};
use crate::{
    camera,
    error::CliError,
    output::{self, Output},
    progress::Progress,
    scene, shot,
};

pub fn run(args: &DeepImagesArgs, said: &ArgMatches) -> Result<(), CliError> {
    let shot = shot::resolve(&args.scene, said)?;
    let path = args.output.output.clone();
    let path = path.unwrap_or_else(|| output::default_path(&args.scene).with_extension("deep-images.png"));
    let output = Output::choose(Some(&path), &args.scene)?;
    if output.is_radiance() {
        let what = format!("{}: images of deep images hold no radiance", path.display());
        return Err(CliError::new(what, "end the name with .png"));
    }
    let flags = &shot.args;
    let mut progress = Progress::start(flags.run.quiet);
    let loading = format!("Loading {}", flags.scene);
    let scene = progress.step("load", &loading, || scene::load_part(&flags.scene, &flags.part))?;
    let size = UVec2::new(flags.output.size.width, flags.output.size.height);
    let camera = camera::choose(&scene, &shot.views()[0], size.x as f32 / size.y as f32)?;
    let view = View::new(&camera, size, Vec3::ZERO, &scene.bounds());

    let choice = flags.run.adapter.clone().unwrap_or_default();
    let gpu = progress.step("adapter", "Opening the adapter", || Gpu::open(&choice))?;
    progress.warn(driver_warning(&gpu.device.adapter_info()));
    let looked = checked(&gpu.device, "deep images", || looker::look(args, &gpu, &scene, &view, &mut progress));
    let (rendering, said) = looked?;
    progress.step("write", &format!("Writing {}", path.display()), || output.write(&rendering, None, &[]))?;
    progress.finish();
    let text = format!("{said}{}\n", path.display());
    output::print(&text)
}
