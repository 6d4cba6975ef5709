//! Checks existing images against those that a run would write.

use lanternfish::debug_views::Scale;
use lanternfish_metrics::{RgbImage, read_exr_layer, read_png};

use crate::{args::RenderArgs, legend, output::Output, stereo::StereoLayout};

/// Size and layers of the requested images.
#[derive(Debug)]
pub struct Expected {
    width: usize,
    height: usize,
    layers: &'static [&'static str],
}

/// Layer names of the two eyes.
pub const EYES: [&str; 2] = ["left", "right"];

impl Expected {
    pub fn of(args: &RenderArgs) -> Self {
        let (mut width, mut height) = (args.output.size.width as usize, args.output.size.height as usize);
        let has_layers = args.stereo.stereo.is_some() && args.stereo.stereo_layout == StereoLayout::Layers;
        if args.stereo.stereo.is_some() && !has_layers {
            width *= 2;
        }
        if args.look.debug_view.and_then(Scale::of).is_some() {
            (width, height) = legend::size_with(width, height);
        }
        Self { width, height, layers: if has_layers { &EYES } else { &[""] } }
    }

    /// The fault of a file, all of whose pixels are decoded; `None` if it is complete.
    pub fn fault(&self, output: &Output) -> Option<Fault> {
        if !output.path.exists() {
            return Some(Fault::Missing);
        }
        let sized = |image: Result<RgbImage, lanternfish_metrics::MetricsError>| match image {
            Err(error) => Some(Fault::Broken(error.to_string())),
            Ok(image) if (image.width, image.height) != (self.width, self.height) => {
                let Self { width, height, .. } = self;
                let what = format!("{} x {} pixels, not {width} x {height}", image.width, image.height);
                Some(Fault::Broken(format!("{}: {what}", output.path.display())))
            }
            Ok(_) => None,
        };
        match output.is_radiance() {
            true => self.layers.iter().find_map(|layer| sized(read_exr_layer(&output.path, layer))),
            false => sized(read_png(&output.path)),
        }
    }
}

/// The fault of an image file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    Missing,
    /// The file exists but is invalid: the path and the reason.
    Broken(String),
}
