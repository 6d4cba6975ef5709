//! `lanternfish view a.exr b.exr`, and `render --open`: shows image files in a window.

use std::path::{Path, PathBuf};

use lanternfish_metrics::{exr_layers, read_exr_layer, read_png};
use lanternfish_viewer::{ImageOfFile, RenderedImages};

use crate::{
    args::{RenderArgs, view::OnlyWindowArgs},
    compare::failed,
    ending::has_ending,
    error::CliError,
    progress::Progress,
    scene::SceneName,
    shot::Shot,
    window,
};

/// Flags that apply to images.
const KNOWN: [&str; 5] = ["size", "exposure", "tone-map", "adapter", "quiet"];

/// True if the name is that of an image, not a scene.
pub fn is_image(name: &SceneName) -> bool {
    name.demo().is_none() && is_of_image(name.path())
}

fn is_of_image(path: &Path) -> bool {
    has_ending(path, "exr") || has_ending(path, "png")
}

/// Shows the images on the command line.
pub fn run(shot: &Shot, window: &OnlyWindowArgs) -> Result<(), CliError> {
    let own = [("record", window.record.is_some()), ("shaders", window.shaders.is_some())];
    let own = own.into_iter().filter_map(|(name, is_said)| is_said.then_some(name.to_owned()));
    if let Some(flag) = shot.names().into_iter().chain(own).find(|name| !KNOWN.contains(&name.as_str())) {
        let what = format_args!("--{flag}: {} is an image, to which this flag does not apply", shot.args.scene);
        return Err(CliError::new(what, format!("leave the flag out; images take --{}", KNOWN.join(", --"))));
    }
    let paths: Vec<_> =
        [shot.args.scene.path()].into_iter().chain(window.renderings.iter().map(PathBuf::as_path)).collect();
    // Sets up the log as for other commands.
    Progress::start(shot.args.run.quiet).finish();
    show(&shot.args, &paths)
}

/// Opens a window on images and returns when it is closed.
pub fn show(args: &RenderArgs, paths: &[&Path]) -> Result<(), CliError> {
    let renderings = paths.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let image = args.settings().image;
    open(RenderedImages {
        renderings: renderings.concat(),
        exposure: image.exposure,
        tone_map: image.tone_map,
        size: [args.output.size.width, args.output.size.height],
        adapter: args.run.adapter.clone().unwrap_or_default(),
        read: Box::new(|path| read(path).map_err(|error| error.to_string())),
    })
}

fn open(renderings: RenderedImages) -> Result<(), CliError> {
    lanternfish_viewer::compare(renderings).map_err(window::failed)
}

/// The image of a file, or all its layers if it has no unnamed one.
fn read(path: &Path) -> Result<Vec<ImageOfFile>, CliError> {
    let name = path.file_name().unwrap_or(path.as_os_str()).display();
    if has_ending(path, "png") {
        let image = read_png(path).map_err(failed)?;
        return Ok(vec![ImageOfFile { name: name.to_string(), image, is_radiance: false }]);
    }
    if !has_ending(path, "exr") {
        let what = format_args!("{}: unsupported image format", path.display());
        return Err(CliError::new(what, "name .exr files (linear radiance) or .png files"));
    }
    let layers = exr_layers(path).map_err(failed)?;
    let of = |layer: &str, name: String| {
        Ok(ImageOfFile { name, image: read_exr_layer(path, layer).map_err(failed)?, is_radiance: true })
    };
    match layers.iter().any(String::is_empty) || layers.is_empty() {
        true => Ok(vec![of("", name.to_string())?]),
        false => layers.iter().map(|layer| of(layer, format!("{name}, {layer}"))).collect(),
    }
}
